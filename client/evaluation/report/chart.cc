// Curves and bars.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/str_format.h"
#include "client/evaluation/report/picture.h"
#include "client/evaluation/report/table.h"
#include "client/output/html.h"
#include "client/output/text.h"

namespace partiemc::evaluation {

using client::EscapeHtml;
namespace {

constexpr double kWidth = 620, kHeight = 220;
constexpr double kLeft = 52, kRight = 610, kTop = 10, kBottom = 196;
constexpr std::size_t kMostLabels = 12;  // As many fit below the axis.

// The next of 1, 2, 2.5, 5 times a power of ten: a step that gives about five rules.
double StepOf(double highest) {
  const double rough = highest / 5;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 2.5, 5.0}) {
    if (factor * power >= rough) return factor * power;
  }
  return 10 * power;
}

// Frame, rules and the scale of a chart from zero to the highest value.
class Axes {
 public:
  explicit Axes(std::span<const Series> series) {
    double highest = 0;
    for (const Series& one : series) {
      for (const double value : one.values) {
        if (std::isfinite(value)) highest = std::max(highest, value);
      }
    }
    if (highest > 0) step_ = StepOf(highest);
    high_ = step_ * std::max(1.0, std::ceil(highest / step_));
  }

  double Y(double value) const { return kBottom - (kBottom - kTop) * value / high_; }

  std::string Rules() const {
    std::string out;
    for (double value = 0; value <= high_ * (1 + 1e-9); value += step_) {
      absl::StrAppendFormat(&out,
                            "<line class=\"%s\" x1=\"%.0f\" x2=\"%.0f\" y1=\"%.1f\" y2=\"%.1f\"/>"
                            "<text x=\"%.0f\" y=\"%.1f\" text-anchor=\"end\">%s</text>\n",
                            value == 0 ? "axis" : "rule", kLeft, kRight, Y(value), Y(value),
                            kLeft - 6, Y(value) + 4, absl::StrFormat("%.6g", value));
    }
    return out;
  }

 private:
  double step_ = 1, high_ = 1;
};

std::string Label(double x, const std::string& text) {
  return absl::StrFormat("<text x=\"%.1f\" y=\"%.0f\" text-anchor=\"middle\">%s</text>\n", x,
                         kHeight - 8, EscapeHtml(text));
}

std::string Open(const std::string& title) {
  return absl::StrFormat(
      "<figure class=\"plot\"><figcaption>%s</figcaption>\n"
      "<svg class=\"chart\" viewBox=\"0 0 %.0f %.0f\" role=\"img\" aria-label=\"%s\">\n",
      EscapeHtml(title), kWidth, kHeight, EscapeHtml(title));
}

std::string Close(std::span<const Series> series) {
  std::string out = "</svg><ul class=\"legend\">";
  for (const Series& one : series) {
    const double mean = std::accumulate(one.values.begin(), one.values.end(), 0.0) /
                        static_cast<double>(one.values.size());
    absl::StrAppendFormat(&out, "<li><i class=\"%s\"></i>%s <b>mean %s</b></li>", one.style,
                          EscapeHtml(one.name), Significant(mean));
  }
  return out + "</ul></figure>\n";
}

}  // namespace

std::string LineChart(const std::string& title, std::span<const std::string> labels,
                      std::span<const Series> series) {
  const Axes axes(series);
  const auto x = [&](std::size_t k) {
    return kLeft +
           (kRight - kLeft) * static_cast<double>(k) / static_cast<double>(labels.size() - 1);
  };
  std::string out = Open(title) + axes.Rules();
  const std::size_t every = (labels.size() + kMostLabels - 1) / kMostLabels;
  for (std::size_t k = 0; k < labels.size(); k += every) out += Label(x(k), labels[k]);
  for (const Series& one : series) {
    std::string path;
    for (std::size_t k = 0; k < one.values.size(); ++k) {
      if (!std::isfinite(one.values[k])) continue;
      absl::StrAppendFormat(&path, "%s%.1f %.1f", path.empty() ? "M" : "L", x(k),
                            axes.Y(one.values[k]));
    }
    client::AppendAll(out, "<path class=\"curve ", one.style, "\" d=\"", path, "\"/>\n");
  }
  return out + Close(series);
}

std::string BarChart(const std::string& title, std::span<const std::string> labels,
                     std::span<const Series> series) {
  const Axes axes(series);
  const double group = (kRight - kLeft) / static_cast<double>(labels.size());
  const double bar = 0.8 * group / static_cast<double>(series.size());
  std::string out = Open(title) + axes.Rules();
  for (std::size_t k = 0; k < labels.size(); ++k) {
    const double left = kLeft + group * (static_cast<double>(k) + 0.1);
    out += Label(left + 0.4 * group, labels[k]);
    for (std::size_t s = 0; s < series.size(); ++s) {
      const double value = series[s].values[k];
      if (!std::isfinite(value)) continue;
      absl::StrAppendFormat(
          &out,
          "<rect class=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\">"
          "<title>%s, %s: %s</title></rect>\n",
          series[s].style, left + bar * static_cast<double>(s), axes.Y(value), 0.92 * bar,
          kBottom - axes.Y(value), EscapeHtml(series[s].name), EscapeHtml(labels[k]),
          Significant(value));
    }
  }
  return out + Close(series);
}

}  // namespace partiemc::evaluation
