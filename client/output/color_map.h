// Colours of an attribute in SVG pictures: the page's map from violet over teal to yellow-green,
// with lightness in equal steps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "partiemc/result.h"

namespace partiemc::client {

/// Number of different colours in a picture.
inline constexpr std::size_t kColorBands = 32;

/// Red, green and blue, sRGB.
using Rgb = std::array<std::uint8_t, 3>;

/// Returns the colour at a position in the map. `share` is clamped to 0 to 1.
Rgb RgbOf(double share);
/// "#rrggbb".
std::string TextOf(const Rgb& color);
/// TextOf(RgbOf(share)).
std::string ColorOf(double share);

/// The attribute of this name. Null if there is none or `name` is empty.
const AttributeValues* FindAttribute(const Result& result, const std::string& name);

/// One number per point: the value of a scalar, the length of a vector.
std::vector<double> MagnitudesOf(const AttributeValues& attribute);

/// Number of channels: 1 for a scalar; for a vector the length and each component.
std::size_t ChannelCount(const AttributeValues& attribute);

/// One number per point: channel 0 is MagnitudesOf, channel k is component k - 1.
/// Requires: channel < ChannelCount(attribute).
std::vector<double> ChannelOf(const AttributeValues& attribute, std::size_t channel);

/// The values that have the first and the last colour of the map.
struct ValueRange {
  double low = 0, high = 0;

  /// Position of a value in the range, not clamped: 0 at `low`, 1 at `high`; .5 if they are equal.
  double ShareOf(double value) const { return high > low ? (value - low) / (high - low) : .5; }
};

/// The least and the largest value; 0 and 0 without values. Requires: all values are finite.
ValueRange RangeOf(std::span<const double> values);

}  // namespace partiemc::client
