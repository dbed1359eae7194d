#include "attributes/attributes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "attributes/plane_fit.h"
#include "base/parallel.h"
#include "base/point.h"
#include "bins/lattice.h"

namespace partiemc {
namespace {

constexpr std::size_t kVerticesAtOnce = 256;

// Divides a tile into square buckets. The side of a bucket is a power of two in cells: the largest
// up to `radius`, but at least one cell.
class Buckets {
 public:
  explicit Buckets(double radius) {
    while (shift_ < kTileShift && (2 << shift_) <= radius) ++shift_;
  }
  int Along() const { return kTileSize >> shift_; }
  // One offset for each bucket, and the end of the last bucket.
  std::size_t OffsetCount() const { return static_cast<std::size_t>(Along()) * Along() + 1; }
  int Of(double coordinate) const { return static_cast<int>(coordinate) >> shift_; }
  std::size_t Of(const BinnedParticle& particle) const {
    return static_cast<std::size_t>(Of(particle.y)) * Along() + Of(particle.x);
  }

 private:
  int shift_ = 0;
};

class Interpolation {
 public:
  Interpolation(const Frame& frame, const ParticleBins& bins, const Scale& scale,
                const ParticleSubset& subset, AttributeScratch& scratch)
      : frame_(frame),
        bins_(bins),
        scale_(scale),
        subset_(subset),
        scratch_(scratch),
        buckets_(scale.reach) {}

  void FindTiles(std::span<const double> vertices) {
    const TileDirectory& directory = bins_.tiles;
    scratch_.tile_of.resize(vertices.size() / 2);
    scratch_.is_wanted.assign(directory.size(), 0);
    TileCoordinate last{};
    std::uint32_t tile = kNoTile;
    for (std::size_t k = 0; k < scratch_.tile_of.size(); ++k) {
      const TileCoordinate at{TileAlong(vertices[2 * k + 1]), TileAlong(vertices[2 * k])};
      if (tile == kNoTile || at != last) tile = directory.Find(last = at);
      scratch_.tile_of[k] = tile;
      if (tile != kNoTile) scratch_.is_wanted[tile] |= 1;
    }
    for (std::uint32_t t = 0; t < directory.size(); ++t) {
      if ((scratch_.is_wanted[t] & 1) == 0) continue;
      for (const std::uint32_t near : directory.neighbours(t)) {
        if (near != kNoTile) scratch_.is_wanted[near] |= 2;
      }
    }
  }

  // Sorts the particles of each wanted tile by bucket, once. The particles of a tile have the same
  // range of indices as in the bins.
  void SortParticles() {
    scratch_.particles.resize(bins_.particles.size());
    scratch_.inverse_size.resize(bins_.size.size());
    scratch_.buckets.resize(bins_.tiles.size() * buckets_.OffsetCount());
    scratch_.sorted.resize(bins_.tiles.size());
    ParallelFor(bins_.tiles.size(), [&](std::size_t tile) {
      if (scratch_.is_wanted[tile] == 0 || scratch_.sorted[tile] != 0) return;
      SortTile(tile);
      scratch_.sorted[tile] = 1;
    });
  }

  void At(std::span<const double> vertices, std::vector<AttributeValues>& values) const {
    ParallelForRanges(vertices.size() / 2, kVerticesAtOnce,
                      [&](std::size_t first, std::size_t last) {
                        for (std::size_t k = first; k < last; ++k) {
                          AtVertex(k, {vertices[2 * k], vertices[2 * k + 1]}, values);
                        }
                      });
  }

 private:
  std::int32_t TileAlong(double world) const {
    return static_cast<std::int32_t>(std::floor(world / scale_.cell_size / kTileSize));
  }

  const std::uint32_t* OffsetsOf(std::size_t tile) const {
    return scratch_.buckets.data() + tile * buckets_.OffsetCount();
  }

  void SortTile(std::size_t tile) {
    std::uint32_t* const offsets = scratch_.buckets.data() + tile * buckets_.OffsetCount();
    const std::size_t count = buckets_.OffsetCount() - 1;
    const std::uint32_t first = bins_.offsets[tile], last = bins_.offsets[tile + 1];
    std::fill_n(offsets, count + 1, 0);
    for (std::uint32_t i = first; i < last; ++i) ++offsets[buckets_.Of(bins_.particles[i])];
    // Counting sort: `offsets` has the end of each bucket, which then moves down to its first
    // particle.
    std::uint32_t end = first;
    for (std::size_t bucket = 0; bucket <= count; ++bucket) {
      offsets[bucket] = end += offsets[bucket];
    }
    for (std::uint32_t i = last; i-- > first;) {
      const BinnedParticle& particle = bins_.particles[i];
      const double weight = bins_.weight.empty() ? scale_.uniform_weight : double{bins_.weight[i]};
      scratch_.particles[--offsets[buckets_.Of(particle)]] = {
          particle.x, particle.y, bins_.height.empty() ? 0 : bins_.height[i],
          static_cast<float>(weight), particle.source};
      if (!bins_.size.empty()) {
        scratch_.inverse_size[offsets[buckets_.Of(particle)]] = 1 / bins_.size[i];
      }
    }
  }

  // Calls visit(particle, w k, D_x, D_y, D_z) for each particle whose kernel reaches `point`. D is
  // in units of R times `size`, the local size in spacings: 1 for equal sizes.
  template <typename Visit>
  void ForEachAround(std::uint32_t tile, Point point, double size, const Visit& visit) const {
    const double radius = scale_.reach, unit = scale_.kernel_radius * size;
    for (std::size_t beside = 0; beside < 9; ++beside) {
      const std::uint32_t near = bins_.tiles.neighbours(tile)[beside];
      if (near == kNoTile || bins_.CountOf(near) == 0) continue;
      const double x = point.x - kTileSize * (static_cast<int>(beside % 3) - 1);
      const double y = point.y - kTileSize * (static_cast<int>(beside / 3) - 1);
      if (x + radius < 0 || y + radius < 0 || x - radius >= kTileSize || y - radius >= kTileSize) {
        continue;
      }
      const int left = buckets_.Of(std::max(x - radius, 0.0));
      const int right = std::min(buckets_.Of(x + radius), buckets_.Along() - 1);
      const int top = std::min(buckets_.Of(y + radius), buckets_.Along() - 1);
      for (int row = buckets_.Of(std::max(y - radius, 0.0)); row <= top; ++row) {
        const std::uint32_t* const offsets = OffsetsOf(near) + row * buckets_.Along();
        for (std::uint32_t i = offsets[left]; i < offsets[right + 1]; ++i) {
          const CarryingParticle& particle = scratch_.particles[i];
          const double dx = (particle.x - x) / unit, dy = (particle.y - y) / unit;
          const double dz = particle.height / unit;
          const double per_own =
              scratch_.inverse_size.empty() ? 1 : scratch_.inverse_size[i] * size;
          const double x_own = dx * per_own, y_own = dy * per_own;
          const double within = 1 - x_own * x_own - y_own * y_own - dz * dz;
          if (within <= 0) continue;
          visit(particle, particle.weight * within * within * within, dx, dy, dz);
        }
      }
    }
  }

  // The mean size around a point, in spacings, weighted by kernels and volumes.
  double SizeAt(std::uint32_t tile, Point point) const {
    if (!scale_.has_own_sizes) return 1;
    double sum = 0, weights = 0;
    ForEachAround(tile, point, 1,
                  [&](const CarryingParticle& particle, double weight, double, double, double) {
                    sum += weight * std::sqrt(particle.weight / scale_.uniform_weight);
                    weights += weight;
                  });
    return weights > 0 ? sum / weights : 1;
  }

  void AtVertex(std::size_t vertex, Point world, std::vector<AttributeValues>& values) const {
    PlaneFit fit;
    CarriedSums carried(frame_.attributes);
    if (const std::uint32_t tile = scratch_.tile_of[vertex]; tile != kNoTile) {
      const TileCoordinate& at = bins_.tiles[tile];
      const Point point{world.x / scale_.cell_size - double{kTileSize} * at.x,
                        world.y / scale_.cell_size - double{kTileSize} * at.y};
      ForEachAround(
          tile, point, SizeAt(tile, point),
          [&](const CarryingParticle& particle, double weight, double dx, double dy, double dz) {
            if (!subset_.Contains(particle.source)) return;
            fit.Add(weight, dx, dy, dz);
            carried.Add(frame_.attributes, particle.source, weight, dx, dy, dz);
          });
    }
    carried.Evaluate(fit, vertex, values);
  }

  const Frame& frame_;
  const ParticleBins& bins_;
  const Scale& scale_;
  const ParticleSubset& subset_;
  AttributeScratch& scratch_;
  const Buckets buckets_;
};

}  // namespace

// The points of the mesh begin with the points of the rings (guarantee M3).
std::span<const double> VerticesOf(const Rings& rings, const Mesh& mesh) {
  return mesh.points.size() > rings.points.size() ? mesh.points : rings.points;
}

void InterpolateAttributes(const Frame& frame, const ParticleBins& bins, const Scale& scale,
                           std::span<const double> vertices, AttributeScratch& scratch,
                           std::vector<AttributeValues>& values, const ParticleSubset& subset) {
  ResizeValues(frame.attributes, vertices.size() / 2, values);
  Interpolation interpolation(frame, bins, scale, subset, scratch);
  interpolation.FindTiles(vertices);
  interpolation.SortParticles();
  interpolation.At(vertices, values);
}

}  // namespace partiemc
