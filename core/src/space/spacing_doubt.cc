#include "space/spacing_doubt.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "base/vec3.h"
#include "frame/near_ring.h"

namespace partiemc::space {
namespace {

// Visited particles and sixteenths of bricks after which the check ends: so many that kFullSearches
// searches for a neighbour can visit all of them, within these limits.
constexpr std::size_t kLeastLooks = std::size_t{1} << 20, kMostLooks = std::size_t{1} << 25;
constexpr std::size_t kFullSearches = 32, kBricksOfLook = 16;

// Limits of the distance of the sixth nearest position, in spacings. It is 1 on the cubic
// lattice, 1.2 in disorder, up to 1.4 at a free surface.
constexpr double kMaxDistance = 1.7;
constexpr double kMinDistance = 0.7;

// The ten positions nearest to a point, as offsets.
class NearShell {
 public:
  // Ignores the point itself and repeated positions.
  void Add(const Vec3& offset) {
    const double square = Dot(offset, offset);
    if (square >= reach_square() || square == 0) return;
    for (const Near& near : nearest_) {
      if (near.square == square && near.offset == offset) return;
    }
    std::size_t k = kCount - 1;
    for (; k > 0 && nearest_[k - 1].square > square; --k) nearest_[k] = nearest_[k - 1];
    nearest_[k] = {offset, square};
  }

  // Offsets beyond this squared distance are ignored; infinite until ten offsets are known.
  double reach_square() const { return nearest_[kCount - 1].square; }

  // Whether the positions lie all around at similar distances. Around a lone particle, in a thread
  // or in a film they do not, and their distances say nothing about the spacing.
  bool IsAround() const {
    if (!(reach_square() <= kMaxRatio * kMaxRatio * nearest_[1].square)) return false;
    Vec3 sum;
    double distances = 0;
    for (const Near& near : nearest_) {
      sum = sum + near.offset;
      distances += std::sqrt(near.square);
    }
    return Length(sum) <= kMaxImbalance * distances;
  }

  double Distance() const { return std::sqrt(nearest_[kDeciding].square); }

 private:
  static constexpr std::size_t kCount = 10, kDeciding = 5;
  // Largest ratio of the distances of the farthest and the second nearest. The cubic lattice has
  // 1.41, a film of one layer 1.73 or more.
  static constexpr double kMaxRatio = 1.7;
  // Largest length of the mean offset, in mean distances. A flat free surface of the cubic lattice
  // has .3.
  static constexpr double kMaxImbalance = 0.35;

  struct Near {
    Vec3 offset;
    double square = std::numeric_limits<double>::infinity();
  };
  std::array<Near, kCount> nearest_;  // Nearest first.
};

class Probe {
 public:
  Probe(const SpaceBins& bins, const Scale& scale)
      : bins_(bins),
        spacing_(scale.spacing),
        largest_(scale.sizes.largest),
        most_looks_(
            std::clamp(kFullSearches * (bins.source.size() + bins.bricks.size() / kBricksOfLook),
                       kLeastLooks, kMostLooks)) {}

  // Whether the distances around a particle contradict the spacing.
  bool Contradicts(std::size_t sampled) {
    const auto particle = static_cast<std::uint32_t>(sampled);
    const std::uint32_t brick = BrickOf(particle);
    const Sample at{
        brick, {bins_.x[particle], bins_.y[particle], bins_.z[particle]}, SizeOf(particle)};
    NearShell near;
    Gather(brick, at, near);
    const BrickNeighbours& neighbours = bins_.bricks.neighbours(brick);
    for (const std::uint32_t other : neighbours) {
      if (other != kNoIndex && other != brick) Gather(other, at, near);
    }
    const double widest = WidestPair(at);
    if (widest * widest * near.reach_square() > kBrickSize * kBrickSize) {
      looks_ += bins_.bricks.size() / kBricksOfLook;
      for (std::uint32_t other = 0; other < bins_.bricks.size() && !IsExhausted(); ++other) {
        // Around lone particles, most bricks are empty.
        const bool is_empty = bins_.FirstOf(other) == bins_.EndOf(other);
        if (!is_empty && std::ranges::count(neighbours, other) == 0) Gather(other, at, near);
      }
    }
    if (!near.IsAround()) return false;
    const double distance = near.Distance() / spacing_;
    return distance > kMaxDistance || distance < kMinDistance;
  }

  bool IsExhausted() const { return looks_ > most_looks_; }

 private:
  // A sampled particle. `place` is in cells from its brick, `size` in spacings.
  struct Sample {
    std::uint32_t brick;
    Vec3 place;
    double size;
  };

  std::uint32_t BrickOf(std::uint32_t particle) const {
    std::uint32_t low = 0, high = static_cast<std::uint32_t>(bins_.bricks.size());
    while (high - low > 1) {
      const std::uint32_t middle = low + (high - low) / 2;
      (bins_.FirstOf(middle) <= particle ? low : high) = middle;
    }
    return low;
  }
  double SizeOf(std::uint32_t particle) const {
    return bins_.size.empty() ? 1.0 : double{bins_.size[particle]};
  }
  // The largest possible mean size of the sample and another particle.
  double WidestPair(const Sample& at) const { return (at.size + largest_) / 2; }

  // Adds the particles of a brick to `near`, unless all of them are farther than the ten nearest.
  void Gather(std::uint32_t other, const Sample& at, NearShell& near) {
    const std::uint32_t first = bins_.FirstOf(other), end = bins_.EndOf(other);
    if (first == end) return;
    const BrickCoordinate &from = bins_.bricks[at.brick], &to = bins_.bricks[other];
    const auto along = [](std::int32_t low, std::int32_t high, double place) {
      return kBrickSize * (static_cast<double>(high) - low) - place;
    };
    const Vec3 corner{along(from.x, to.x, at.place.x), along(from.y, to.y, at.place.y),
                      along(from.z, to.z, at.place.z)};
    const auto across = [](double low) { return std::max({0.0, low, -low - kBrickSize}); };
    const Vec3 away{across(corner.x), across(corner.y), across(corner.z)};
    const double widest = WidestPair(at);
    if (Dot(away, away) >= widest * widest * near.reach_square()) return;
    looks_ += end - first;
    for (std::uint32_t p = first; p < end; ++p) {
      const Vec3 offset = corner + Vec3{bins_.x[p], bins_.y[p], bins_.z[p]};
      near.Add(2 / (at.size + SizeOf(p)) * offset);
    }
  }

  const SpaceBins& bins_;
  double spacing_, largest_;
  std::size_t most_looks_, looks_ = 0;
};

}  // namespace

bool ContradictsSpacing(const SpaceBins& bins, const Scale& scale) {
  Probe probe(bins, scale);
  return SamplesContradict(bins.source.size(), probe);
}

}  // namespace partiemc::space
