// Measures of shells, computed from their triangles.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "partiemc/surface.h"

namespace partiemc::support {

/// Sets area, volume and centroid of every shell. A level of detail has the measures of the exact
/// surface, which Validate refuses.
inline void MeasureShells(Surface& surface) {
  using Point = std::array<double, 3>;
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    ShellMeasures& measures = surface.measures[shell];
    const double* const origin = &surface.points[3 * std::size_t{surface.point_offsets[shell]}];
    double area = 0, volume = 0;
    Point sum = {};
    for (auto t = surface.triangle_offsets[shell]; t < surface.triangle_offsets[shell + 1]; ++t) {
      std::array<Point, 3> at;
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t k = 0; k < 3; ++k) {
          at[c][k] =
              surface.points[3 * std::size_t{surface.triangles[3 * std::size_t{t} + c]} + k] -
              origin[k];
        }
      }
      const auto cross = [](const Point& a, const Point& b) {
        return Point{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                     a[0] * b[1] - a[1] * b[0]};
      };
      Point u, v;
      for (std::size_t k = 0; k < 3; ++k) u[k] = at[1][k] - at[0][k], v[k] = at[2][k] - at[0][k];
      const Point normal = cross(u, v), side = cross(at[1], at[2]);
      area += std::hypot(normal[0], normal[1], normal[2]) / 2;
      const double part = (at[0][0] * side[0] + at[0][1] * side[1] + at[0][2] * side[2]) / 6;
      volume += part;
      for (std::size_t k = 0; k < 3; ++k) {
        sum[k] += part * (at[0][k] + at[1][k] + at[2][k]) / 4;
      }
    }
    measures.area = area;
    measures.volume = volume;
    measures.centroid_x = origin[0] + sum[0] / volume;
    measures.centroid_y = origin[1] + sum[1] / volume;
    measures.centroid_z = origin[2] + sum[2] / volume;
  }
}

}  // namespace partiemc::support
