// The positions nearest to one, and what they tell of the spacing.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace partiemc {

/// The six positions nearest to a point, as offsets from it. On a square lattice these are all at
/// one constant and two at its diagonal, on a hexagonal one the whole ring around.
class NearRing {
 public:
  /// Takes an offset that is among the six nearest. The point itself and positions that are there
  /// already count for nothing.
  void Add(double x, double y) {
    const double square = x * x + y * y;
    if (square >= reach_square() || square == 0) return;
    for (const Offset& offset : offsets_) {
      if (offset.x == x && offset.y == y) return;
    }
    std::size_t k = kCount - 1;
    for (; k > 0 && offsets_[k - 1].square > square; --k) offsets_[k] = offsets_[k - 1];
    offsets_[k] = {x, y, square};
  }

  /// Squared distance beyond which nothing is among the nearest: infinite until there are six.
  double reach_square() const { return offsets_[kCount - 1].square; }

  /// Whether the six lie around the point at like distances: no half-plane is free of them, and the
  /// farthest is at most 1.6 times as far as the second nearest. The nearest may be nearer: the
  /// particles of many simulations form pairs. Of bodies' particles that are not at an edge, 0.4
  /// (shaken or thinned at random) to 1 (in order) are surrounded; of random ones 0.24 and fewer.
  bool IsAround() const;

  /// About the spacing, where IsAround(): the distance of the fourth nearest, 1 to 1.4 spacings.
  double Distance() const { return std::sqrt(offsets_[3].square); }

 private:
  static constexpr std::size_t kCount = 6;
  // The square lattice's diagonal is at 1.41, a little noise included.
  static constexpr double kMaxRatio = 1.6;

  // Two offsets that span less than this (a sine) do not tell that the side between them is taken:
  // the straight edge of a lattice, bent by noise, has everything on one side.
  static constexpr double kMinSine = 0.25;

  struct Offset {
    double x = 0, y = 0, square = std::numeric_limits<double>::infinity();
  };
  std::array<Offset, kCount> offsets_;  // Nearest first.
};

inline bool NearRing::IsAround() const {
  const double farthest = reach_square();
  if (!std::isfinite(farthest) || farthest > kMaxRatio * kMaxRatio * offsets_[1].square) {
    return false;
  }
  // Seen from each offset, another one comes within half a turn to its left.
  return std::all_of(offsets_.begin(), offsets_.end(), [&](const Offset& a) {
    return std::any_of(offsets_.begin(), offsets_.end(), [&](const Offset& b) {
      const double cross = a.x * b.y - a.y * b.x;
      return cross > 0 && cross * cross >= kMinSine * kMinSine * (a.square * b.square);
    });
  });
}

/// Whether `surrounded` of `asked` points are enough to believe what they agree on: a dozen, and
/// three tenths. A strip of four layers has enough of them, ten drops do not.
constexpr bool AreEnough(std::size_t surrounded, std::size_t asked) {
  return surrounded >= 12 && 10 * surrounded >= 3 * asked;
}

}  // namespace partiemc
