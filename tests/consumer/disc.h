// The consumer's particles: a disc that drifts to the right.
#pragma once

#include <vector>

inline constexpr double kSpacing = 0.01;

/// Interleaved coordinates of a lattice cut to a disc of 20 spacings, `shift` spacings to the
/// right.
inline std::vector<double> Disc(double shift) {
  constexpr int kRadius = 20;
  std::vector<double> xy;
  for (int row = -kRadius; row <= kRadius; ++row) {
    for (int column = -kRadius; column <= kRadius; ++column) {
      if (row * row + column * column > kRadius * kRadius) continue;
      xy.push_back((column + shift) * kSpacing);
      xy.push_back(row * kSpacing);
    }
  }
  return xy;
}

/// Each particle stands for a square of one spacing; an outline that is 5 % off is wrong.
inline bool IsAreaOf(double area, const std::vector<double>& xy) {
  const double expected = static_cast<double>(xy.size()) / 2 * kSpacing * kSpacing;
  return area > 0.95 * expected && area < 1.05 * expected;
}
