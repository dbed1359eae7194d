// Evaluates the level set and its gradient at any point near the outline.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "bins/masked_particles.h"
#include "crossings/crossings.h"
#include "field/slice_formula.h"
#include "frame/scale.h"
#include "sampler/neighbour_grid.h"
#include "sampler/point_kernels.h"
#include "sampler/query_batch.h"

namespace partiemc {

/// F, phi and their gradients at a point x. Lengths are in cells, gradients have no unit.
struct FieldSample {
  double density = 0;             ///< f
  double mean_x = 0, mean_y = 0;  ///< xbar - x: the weighted mean of positions, from the point.
  double phi = 0;                 ///< |x - xbar| - r
  double phi_x = 0, phi_y = 0;    ///< grad phi; 0 if x = xbar.
  double spread = 0;              ///< sigma
  double value = 0;               ///< F (level_set_formula.h)
  /// grad F: the gradient of the term that decides F. If sizes differ, the local size counts as
  /// constant.
  double gradient_x = 0, gradient_y = 0;
  double size = 1;           ///< The local size, in spacings.
  bool has_support = false;  ///< A particle is within the kernel radius.
};

/// A point in cells relative to a tile; kNoTile if no sample is possible there.
struct FieldPoint {
  std::uint32_t tile = kNoTile;
  double x = 0, y = 0;
};

/// The members of FieldSample that vertices need.
struct LevelSetSample {
  double value = 0;
  double gradient_x = 0, gradient_y = 0;
  double size = 1;
};
using FieldPoints = PointGroup<Point>;
using FieldSamples = std::array<LevelSetSample, kPointsAtOnce>;

/// An index of the particles near the outline. Particles are sorted into rows of buckets
/// (NeighbourGrid) that span adjacent tiles. A query visits the buckets around its points. All
/// const functions are thread-safe.
class LevelSetSampler {
 public:
  /// Indexes the particles for samples at points in active cells, and in cells at most `wander`
  /// cells away from an active cell along each axis. `tells_sources`: whether SourceOf may be
  /// called. Cost: linear in the particles of the tiles around these cells; in all particles if
  /// Scale::reach and `wander` together exceed kMaskMargin.
  void Build(const ParticleBins& bins, const Crossings& crossings, const Scale& scale,
             double wander, bool tells_sources);

  /// The sample at a point of a tile, in cells relative to the tile, 0 <= x, y <= 32. Requires:
  /// IsIndexed(tile). If Covers is false for the point, particles may be missing. Particles are
  /// summed in the order of buckets, then of the bins (SampleAtPoints). Cost: linear in the
  /// particles of the rows of buckets that the kernel radius reaches.
  FieldSample Sample(std::uint32_t tile, double x, double y) const;

  /// Sets samples[q][k] to the sample at point k of groups[q], for 1 to kQueriesAtOnce groups. This
  /// is faster than one by one, if the points of a group are near each other. A sample's last bits
  /// depend on its group.
  void Sample(std::span<const FieldPoints> groups, std::span<FieldSamples> samples) const;

  /// Calls visit(x, y, particle) for the particles within `radius` of a point, and for some farther
  /// away. All coordinates are in cells relative to `tile`. Requires: radius <= Scale::reach.
  template <typename Visit>
  void ForEachNear(std::uint32_t tile, double x, double y, double radius, Visit visit) const;

  /// The distance within which a particle counts, in cells: `radius`, plus `per_size` times the
  /// particle's size if sizes differ.
  struct Range {
    double radius, per_size;
  };

  /// Sets `near` to the particles within `range` of any of `points`, and some farther away. `near`
  /// is valid until the next Build. Points have members x and y, in cells relative to the tile.
  /// Particles beyond Scale::reach may be missing. Requires: at least one point.
  template <typename Member>
  void FindNear(std::uint32_t tile, std::span<const Member> points, const Range& range,
                NeighbourRows& near) const;

  /// The index in the frame of a `particle` of ForEachNear. Requires: Build with `tells_sources`.
  std::uint32_t SourceOf(std::uint32_t particle) const { return source_[particle]; }

  bool IsIndexed(std::uint32_t tile) const { return tiles_[tile].is_asked; }

  /// Whether a sample at a point of a tile, 0 <= x, y < 32, misses no particle: the cell of the
  /// point is at most `wander` cells (Build) from an active cell.
  bool Covers(std::uint32_t tile, double x, double y) const {
    return IsIndexed(tile) && (asked_[tile][static_cast<int>(y)] >> static_cast<int>(x) & 1) != 0;
  }

 private:
  // Adjacent tiles in a row whose particles are sorted together. Each row of buckets spans all
  // these tiles, so a query reads one span per row. Empty buckets bridge a single missing tile, so
  // a query never needs two runs in one row of tiles.
  struct Run {
    std::uint32_t first_tile = 0, last_tile = 0;
    std::int32_t first_column = 0;  // In tiles.
    std::uint32_t row_stride = 0;   // Buckets per row.
    std::uint32_t first_bucket = 0;
    std::uint32_t first_particle = 0;
  };

  // The run in the row of tiles above, beside or below a tile; without columns if there is none.
  struct RunBeside {
    std::uint32_t bucket = 0;  // At the tile's first column in the first row, modulo 2^32.
    std::uint32_t row_stride = 0;
    int first = 0, end = 0;  // Columns [first, end) of buckets, relative to the tile.
  };

  // sqrt(2) - 1, rounded up. A diagonal of a box is at most the longer side plus this times the
  // shorter one.
  static constexpr double kDiagonal = 0.41422;

  // In cells; added to the radius of the disc that selects particles, because floats are rounded.
  // The additional particles contribute nothing.
  static constexpr double kDiscMargin = 1e-3;

  struct Tile {
    std::array<RunBeside, 3> runs;  // Below, beside, above.
    float column;                   // The column of its first node, modulo kColumnPeriod.
    bool is_asked;                  // Points may lie in its cells.
  };

  Range KernelRange() const {
    return scale_.has_own_sizes ? Range{0, scale_.kernel_radius} : Range{scale_.kernel_radius, 0};
  }
  void MarkTiles(const ParticleBins& bins, const Crossings& crossings, double wander);
  // The number of offsets of a run: one for each bucket, and two more.
  std::uint32_t OffsetCount(const Run& run) const {
    return run.row_stride * static_cast<std::uint32_t>(grid_.rows.size()) + 2;
  }
  void FindRuns(const ParticleBins& bins, bool tells_sources);
  void LinkRuns(const TileDirectory& directory, std::uint32_t tile);
  void SortRun(const ParticleBins& bins, const Run& run);
  template <typename Visit>
  void ForEachInSpace(std::uint32_t tile, double x, double y, Visit visit) const;
  FieldSample SampleSlice(std::uint32_t tile, double x, double y) const;
  void JoinGrains(std::uint32_t tile, const Point& point, LevelSetSample& sample) const;
  SliceSums SliceSumsAt(std::uint32_t tile, double x, double y) const;

  Scale scale_;
  NeighbourGrid grid_;
  std::vector<Tile> tiles_;
  std::vector<BitRows> asked_;   // By tile: cells in which points may lie.
  std::vector<BitRows> wanted_;  // By tile: cells with particles that points in `asked_` need.
  std::vector<Run> runs_;
  std::vector<std::uint32_t> run_of_;  // By tile, or kNoRun.
  std::vector<std::uint32_t> bucket_offsets_;
  // The selected particles of each run, tile by tile. The particles of a tile end at chosen_end_.
  struct Chosen {
    std::uint32_t bucket, particle;  // Indices: of its bucket in the run, and in the bins.
  };
  std::vector<Chosen> chosen_;
  std::vector<std::uint32_t> chosen_end_;
  std::vector<float> x_, y_, weight_, height_, size_;
  std::vector<std::uint32_t> source_;
};

template <typename Member>
void LevelSetSampler::FindNear(std::uint32_t tile, std::span<const Member> points,
                               const Range& range, NeighbourRows& near) const {
  const bool has_sizes = scale_.has_own_sizes;
  const double radius =
      has_sizes ? std::min(range.radius + range.per_size * scale_.sizes.largest, scale_.reach)
                : range.radius;
  Point low{points.front().x, points.front().y};
  Point high = low;
  for (const Member& point : points.subspan(1)) {
    low = {std::min(low.x, point.x), std::min(low.y, point.y)};
    high = {std::max(high.x, point.x), std::max(high.y, point.y)};
  }
  const Tile& of = tiles_[tile];
  near.x = x_.data();
  near.y = y_.data();
  near.weight = weight_.empty() ? nullptr : weight_.data();
  near.size = size_.empty() ? nullptr : size_.data();
  near.origin_x = static_cast<float>(static_cast<int>(low.x));
  near.origin_y = static_cast<float>(static_cast<int>(low.y));
  near.column = of.column + near.origin_x;
  near.centre_x = static_cast<float>((low.x + high.x) / 2 - near.origin_x);
  near.centre_y = static_cast<float>((low.y + high.y) / 2 - near.origin_y);
  // At least half the diagonal of the bounding box of the points.
  const double width = high.x - low.x, height = high.y - low.y;
  const double half = (std::max(width, height) + kDiagonal * std::min(width, height)) / 2;
  const double disc = radius + half + kDiscMargin;
  near.reach_square = static_cast<float>(disc * disc);
  near.reach = static_cast<float>(range.radius + half + kDiscMargin);
  near.reach_per_size = static_cast<float>(range.per_size);
  // A particle nearer to the rim than half the resolution of positions has a kernel of 0, so it
  // need not be found.
  const double reach = radius - NeighbourGrid::kStep / 2;
  const auto& [columns, rows] = grid_;
  const int first_column = columns.Along(low.x - reach) - columns.size();
  const int last_column = columns.Along(high.x + reach) - columns.size();
  const int first_row = rows.Along(low.y - reach), last_row = rows.Along(high.y + reach);
  near.band_count = 0;
  for (int y = rows.TileOf(first_row); y <= rows.TileOf(last_row); ++y) {
    const RunBeside& run = of.runs[y];
    const int column = std::max(first_column, run.first);
    const int end = std::min(last_column + 1, run.end);
    if (column >= end) continue;
    const int row = std::max(first_row - y * rows.size(), 0);
    const std::uint32_t bucket = run.bucket + row * run.row_stride + column;
    near.bands[near.band_count++] = {
        .offsets = bucket_offsets_.data() + bucket,
        .columns = end - column,
        .rows = std::min(last_row - y * rows.size() + 1, rows.size()) - row,
        .row_stride = static_cast<int>(run.row_stride),
        .origin_y = near.origin_y - static_cast<float>((y - 1) * kTileSize)};
  }
}

template <typename Visit>
void LevelSetSampler::ForEachNear(std::uint32_t tile, double x, double y, double radius,
                                  Visit visit) const {
  const Point point{x, y};
  NeighbourRows near;
  FindNear(tile, std::span(&point, 1), {radius + NeighbourGrid::kStep, 0}, near);
  for (const NeighbourBand& band : std::span(near.bands).first(near.band_count)) {
    for (int row = 0; row < band.rows; ++row) {
      const std::uint32_t* const offsets = band.offsets + row * band.row_stride;
      for (std::uint32_t e = offsets[0]; e < offsets[band.columns]; ++e) {
        float along = x_[e] - near.column;
        if (along > kColumnPeriod / 2) along -= kColumnPeriod;
        if (along < -kColumnPeriod / 2) along += kColumnPeriod;
        visit(double{near.origin_x} + along, double{near.origin_y} + (y_[e] - band.origin_y), e);
      }
    }
  }
}

}  // namespace partiemc
