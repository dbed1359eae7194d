// The six nearest neighbours of a position, and the spacing that they show.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace partiemc {

/// The six positions nearest to a point, as offsets. On a square lattice they are the four
/// neighbours along the axes and two diagonal ones, on a hexagonal lattice all six neighbours.
class NearRing {
 public:
  /// Adds an offset if it is among the six nearest. The point itself and repeated positions are
  /// ignored.
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

  /// Offsets beyond this squared distance are ignored; infinite until six offsets are known.
  double reach_square() const { return offsets_[kCount - 1].square; }

  /// Whether the six positions surround the point at similar distances: no half-plane is free of
  /// them, and the farthest is at most 1.6 times as far as the second nearest. The nearest may be
  /// much closer, because particles of many simulations form pairs. In bodies, 40 % (shaken or
  /// thinned at random) to 100 % (regular) of the inner particles are surrounded; of random points,
  /// at most 24 %.
  bool IsAround() const;

  /// The distance of the fourth nearest position: 1 to 1.4 spacings. Requires: IsAround().
  double Distance() const { return std::sqrt(offsets_[3].square); }

 private:
  static constexpr std::size_t kCount = 6;
  // Maximum ratio of the distances of the farthest and the second nearest. In a square lattice the
  // ratio is 1.41, because the farthest is a diagonal neighbour; the margin above 1.41 is for
  // noise.
  static constexpr double kMaxRatio = 1.6;

  // An offset counts as left of another only if the sine of the angle between them is at least
  // this. Otherwise, because of noise, a particle at the straight edge of a lattice would count as
  // surrounded.
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
  // No half-plane is free if each offset has another one on its left, less than half a turn away.
  return std::all_of(offsets_.begin(), offsets_.end(), [&](const Offset& a) {
    return std::any_of(offsets_.begin(), offsets_.end(), [&](const Offset& b) {
      const double cross = a.x * b.y - a.y * b.x;
      return cross > 0 && cross * cross >= kMinSine * kMinSine * (a.square * b.square);
    });
  });
}

/// Whether enough of `asked` samples are surrounded to trust their distances: at least 12, and at
/// least 30 %. A strip of four layers of particles has enough; ten drops do not.
constexpr bool AreEnough(std::size_t surrounded, std::size_t asked) {
  return surrounded >= 12 && 10 * surrounded >= 3 * asked;
}

/// SamplesContradict examines at most kAsked samples. It stops after kAskedFirst if fewer than
/// kCauseToAsk of them contradict the spacing.
inline constexpr std::size_t kAsked = 64, kAskedFirst = 16, kCauseToAsk = 3;

/// Whether enough of the sampled particles contradict the spacing (AreEnough). `count`: number of
/// all particles. probe.Contradicts(particle) examines a particle. Once probe.IsExhausted(), the
/// particles examined so far decide.
template <typename Probe>
bool SamplesContradict(std::size_t count, Probe& probe) {
  const std::size_t most = count < kAsked ? count : kAsked;
  std::size_t asked = 0, contradicting = 0;
  for (; asked < most && !probe.IsExhausted(); ++asked) {
    if (asked == kAskedFirst && contradicting < kCauseToAsk) return false;
    // Multiples of an odd number modulo a power of 2, so that the first samples are spread over all
    // particles, too.
    const std::size_t place = asked * 37 % kAsked;
    if (probe.Contradicts(count <= kAsked ? asked : count * place / kAsked)) ++contradicting;
  }
  return AreEnough(contradicting, asked);
}

}  // namespace partiemc
