// Colours of numbers, in pictures: the map of the viewer's page, violet over teal to yellow-green,
// its lightness in equal steps.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "partiemc/result.h"

namespace partiemc::client {

/// So many colours tell numbers apart in a picture.
inline constexpr std::size_t kColorBands = 32;

/// "#rrggbb" of a share from 0 to 1; what lies outside has the colour of the end.
std::string ColorOf(double share);

/// The attribute of this name; none for an empty name, and where there is none.
const AttributeValues* FindAttribute(const Result& result, const std::string& name);

/// An attribute as one number a point: of a vector its length.
std::vector<double> MagnitudesOf(const AttributeValues& attribute);

/// What the colours reach from and to.
struct ValueRange {
  double low = 0, high = 0;

  /// 0 to 1; .5 where there is only one number.
  double ShareOf(double value) const { return high > low ? (value - low) / (high - low) : .5; }
};

/// Of `values`, which are finite; 0 to 0 without any.
ValueRange RangeOf(std::span<const double> values);

}  // namespace partiemc::client
