// Frames and curves as SVG, coloured by the page's style.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "client/evaluation/paper/paper.h"

namespace partiemc::evaluation {

/// A <div> with a figure for each shot, all in the same scale and section of the world. Spray
/// (rings below a hundredth of the largest) does not decide what is shown.
std::string PictureRow(std::span<const Shot> shots);

/// A curve of a chart. `style` is a class of the page's style sheet.
struct Series {
  std::string name;
  std::string style;
  std::vector<double> values;  ///< One for each label.
};

/// A <figure> with curves from zero up, and a legend with each curve's mean.
/// Requires: at least two labels.
std::string LineChart(const std::string& title, std::span<const std::string> labels,
                      std::span<const Series> series);

/// A <figure> with a group of bars for each label, from zero up.
std::string BarChart(const std::string& title, std::span<const std::string> labels,
                     std::span<const Series> series);

}  // namespace partiemc::evaluation
