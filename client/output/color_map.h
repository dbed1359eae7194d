// Colours of an attribute in SVG pictures: the page's map from violet over teal to yellow-green,
// with lightness in equal steps.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "partiemc/result.h"

namespace partiemc::client {

/// Number of colours in a picture.
inline constexpr std::size_t kColorBands = 32;

/// Returns the colour "#rrggbb" at a position in the map. `share` is clamped to 0 to 1.
std::string ColorOf(double share);

/// The attribute of this name, or null.
const AttributeValues* FindAttribute(const Result& result, const std::string& name);

/// One number per point: the value of a scalar, the length of a vector.
std::vector<double> MagnitudesOf(const AttributeValues& attribute);

/// Number of channels: 1 for a scalar; for a vector the length and each component.
std::size_t ChannelCount(const AttributeValues& attribute);

/// One number per point: channel 0 is MagnitudesOf, channel k is component k - 1.
/// Requires: channel < ChannelCount(attribute).
std::vector<double> ChannelOf(const AttributeValues& attribute, std::size_t channel);

/// Range of the colours.
struct ValueRange {
  double low = 0, high = 0;

  /// Position of a value in the range, 0 to 1; .5 if the range is empty.
  double ShareOf(double value) const { return high > low ? (value - low) / (high - low) : .5; }
};

/// Range of finite values; 0 to 0 without values.
ValueRange RangeOf(std::span<const double> values);

}  // namespace partiemc::client
