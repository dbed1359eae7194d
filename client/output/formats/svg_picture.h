// Parts that SVG pictures of outlines and of surfaces share.
#pragma once

#include <cstddef>
#include <string>

#include "client/output/color_map.h"
#include "client/output/frame_record.h"

namespace partiemc::client {

/// Length of a picture's longer side, in SVG units. World coordinates are scaled to it, because
/// readers of SVG use single precision, which world coordinates can exceed.
inline constexpr double kLongerSide = 1000;

/// Maps coordinates of a plane to SVG units: y points down, the upper left corner of the box with
/// its margin is (0, 0).
class Picture {
 public:
  /// `steps`: coordinates are rounded to 1 / `steps` SVG units.
  Picture(Box box, double steps);

  double width() const { return Round(width_); }
  double height() const { return Round(height_); }
  /// SVG units per world unit.
  double scale() const { return scale_; }

  void AppendPoint(std::string& out, const double* point) const;

 private:
  double Round(double value) const;

  double steps_, left_, top_, scale_, width_, height_;
};

/// The colour of the map for a position in the range, as a number from 0 to kColorBands - 1; 0 for
/// NaN.
std::size_t BandOf(double share);
/// The position of a band's centre in the range.
double ShareOfBand(std::size_t band);

/// Appends the start of the file: the element `svg`, a title and a white background. `has_legend`:
/// leaves room for a legend below the picture.
void AppendHead(std::string& out, const FrameRecord& frame, const Picture& picture, bool has_legend,
                const std::string& style);

/// Appends the legend of an attribute: a colour bar with the ends of the range.
void AppendLegend(std::string& out, const std::string& name, const ValueRange& range,
                  const Picture& picture);

}  // namespace partiemc::client
