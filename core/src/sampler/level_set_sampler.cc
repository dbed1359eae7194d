#include "sampler/level_set_sampler.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "base/prefetch.h"
#include "bins/cell_mask.h"
#include "bins/masked_particles.h"

namespace partiemc {
namespace {

constexpr std::uint32_t kNoRun = 0xffffffff;

// The number of tiles after which positions along x repeat.
constexpr std::int32_t kPeriodTiles = static_cast<std::int32_t>(kColumnPeriod) / kTileSize;

// The step of the central differences of the spread, in kernel radii.
constexpr double kGapStep = 1.0 / 1024;

}  // namespace

// Marks the cells in which points may lie, and the cells within reach of these cells.
void LevelSetSampler::MarkTiles(const ParticleBins& bins, const Crossings& crossings,
                                double wander) {
  const auto tiles = static_cast<std::uint32_t>(bins.tiles.size());
  tiles_.resize(tiles);
  asked_.resize(tiles);
  wanted_.resize(tiles);
  const auto is_active = [&](std::uint32_t tile) {
    if (tile == kNoTile) return false;
    const std::size_t end =
        tile + 1 < tiles ? crossings.tiles[tile + 1].first_cell : crossings.cells.size();
    return crossings.tiles[tile].first_cell < end;
  };
  const auto active_of = [&](std::uint32_t tile) -> const BitRows& {
    return crossings.tiles[tile].active;
  };
  BitRows all_cells;
  all_cells.fill(~std::uint32_t{0});
  // A mask ends at its margin. If the reach is larger, all cells are marked.
  const double distance = std::ceil(wander);
  const double reach = distance + std::ceil(scale_.reach);
  const int margin = static_cast<int>(std::min<double>(reach, kMaskMargin));
  const auto mark = [](CellMask& mask, double cells) {
    Widen(mask, static_cast<int>(cells), static_cast<int>(cells));
    return CellsOfNeighbour(mask, kOwnPlace);
  };
  ParallelFor(tiles, [&](std::uint32_t index) {
    const Neighbourhood& near = bins.tiles.neighbours(index);
    Tile& tile = tiles_[index];
    BitRows& asked = asked_[index];
    asked = {};
    wanted_[index] = reach > kMaskMargin ? all_cells : BitRows{};
    if (std::any_of(near.begin(), near.end(), is_active)) {
      CellMask mask = CellsAround(bins.tiles, index, margin, active_of);
      asked = distance > kMaskMargin ? all_cells : mark(mask, distance);
      if (reach <= kMaskMargin) wanted_[index] = mark(mask, reach - distance);
    }
    tile.is_asked = !IsEmpty(asked);
    tile.column = static_cast<float>(bins.tiles[index].x & (kPeriodTiles - 1)) * kTileSize;
  });
}

void LevelSetSampler::Build(const ParticleBins& bins, const Crossings& crossings,
                            const Scale& scale, double wander, bool tells_sources) {
  scale_ = scale;
  grid_ = NeighbourGrid(scale.reach);
  MarkTiles(bins, crossings, wander);
  FindRuns(bins, tells_sources);
  ParallelFor(runs_.size(), [&](std::size_t run) { SortRun(bins, runs_[run]); });
  ParallelFor(static_cast<std::uint32_t>(tiles_.size()),
              [&](std::uint32_t tile) { LinkRuns(bins.tiles, tile); });
}

// Groups the tiles with wanted particles into runs, and allocates memory for all their particles.
void LevelSetSampler::FindRuns(const ParticleBins& bins, bool tells_sources) {
  runs_.clear();
  run_of_.assign(tiles_.size(), kNoRun);
  std::uint32_t particle_count = 0;
  for (std::uint32_t tile = 0; tile < tiles_.size(); ++tile) {
    if (bins.CountOf(tile) == 0 || IsEmpty(wanted_[tile])) continue;
    const TileCoordinate& at = bins.tiles[tile];
    const auto goes_on = [&](const TileCoordinate& last) {
      return last.y == at.y && last.x + 2 >= at.x;
    };
    if (runs_.empty() || !goes_on(bins.tiles[runs_.back().last_tile])) {
      runs_.push_back({.first_tile = tile, .first_column = at.x, .first_particle = particle_count});
    }
    runs_.back().last_tile = tile;
    run_of_[tile] = static_cast<std::uint32_t>(runs_.size() - 1);
    // Reserves memory for all particles of the tile, because counting the needed ones takes longer.
    particle_count += bins.CountOf(tile);
  }
  std::uint32_t bucket_count = 0;
  for (Run& run : runs_) {
    const int tiles = bins.tiles[run.last_tile].x - run.first_column + 1;
    run.row_stride = static_cast<std::uint32_t>(tiles * grid_.columns.size());
    run.first_bucket = bucket_count;
    bucket_count += OffsetCount(run);
  }
  bucket_offsets_.resize(bucket_count);
  x_.resize(particle_count + kRowPadding);
  y_.resize(particle_count + kRowPadding);
  chosen_.resize(particle_count);
  chosen_end_.resize(tiles_.size());
  source_.resize(tells_sources ? particle_count : 0);
  const bool is_weighted = !bins.weight.empty() && bins.size.empty();
  weight_.resize(is_weighted ? particle_count + kRowPadding : 0);
  height_.resize(bins.height.empty() ? 0 : particle_count);
  size_.resize(bins.size.empty() ? 0 : particle_count + kRowPadding);
}

// Finds the runs around a tile.
void LevelSetSampler::LinkRuns(const TileDirectory& directory, std::uint32_t tile) {
  const Neighbourhood& neighbours = directory.neighbours(tile);
  for (int y = 0; y < 3; ++y) {
    RunBeside& beside = tiles_[tile].runs[y];
    beside = {};
    // All neighbours in this row that belong to a run belong to the same run.
    for (int x = 0; x < 3; ++x) {
      const std::uint32_t near = neighbours[y * 3 + x];
      if (near == kNoTile || run_of_[near] == kNoRun) continue;
      const Run& run = runs_[run_of_[near]];
      const int first = (run.first_column - directory[tile].x) * grid_.columns.size();
      beside = {.bucket = run.first_bucket - static_cast<std::uint32_t>(first),
                .row_stride = run.row_stride,
                .first = first,
                .end = first + static_cast<int>(run.row_stride)};
      break;
    }
  }
}

// Sorts the needed particles of a run by bucket, by a counting sort. At first offsets[b + 2] is the
// count of bucket b. Then offsets[b + 1] is the index of its next particle. At the end offsets[b]
// is the index of its first particle.
void LevelSetSampler::SortRun(const ParticleBins& bins, const Run& run) {
  const std::span offsets = std::span(bucket_offsets_).subspan(run.first_bucket, OffsetCount(run));
  std::fill(offsets.begin(), offsets.end(), 0);
  const auto for_each_tile = [&](auto visit) {
    for (std::uint32_t tile = run.first_tile; tile <= run.last_tile; ++tile) {
      if (run_of_[tile] != kNoRun) visit(tile);
    }
  };
  std::uint32_t chosen = run.first_particle;
  // Where the output of a tile would begin if all particles were needed. This memory is prefetched
  // while the particles are selected.
  std::uint32_t room = run.first_particle;
  for_each_tile([&](std::uint32_t tile) {
    const std::uint32_t count = bins.CountOf(tile);
    const auto ask = [&](const auto& values) {
      PrefetchLines(std::span(values).subspan(room, count));
    };
    ask(std::as_const(chosen_));
    ask(std::as_const(x_));
    ask(std::as_const(y_));
    room += count;
    const int columns = (bins.tiles[tile].x - run.first_column) * grid_.columns.size();
    const auto first = static_cast<std::uint32_t>(columns);
    const CellMask mask = MaskOf(wanted_[tile]);
    MaskedParticles(bins, tile, &mask).ForEachBlock([&](const ParticleBlock& near) {
      for (int k = 0; k < near.count; ++k) {
        const std::uint32_t bucket =
            grid_.rows.InTile(near.y[k]) * run.row_stride + first + grid_.columns.InTile(near.x[k]);
        chosen_[chosen++] = {bucket, near.particle[k]};
        ++offsets[bucket + 2];
      }
    });
    chosen_end_[tile] = chosen;
  });
  std::uint32_t next = run.first_particle;
  for (std::uint32_t& offset : offsets) offset = next += offset;
  chosen = run.first_particle;
  for_each_tile([&](std::uint32_t tile) {
    for (; chosen < chosen_end_[tile]; ++chosen) {
      const auto& [bucket, particle] = chosen_[chosen];
      const std::uint32_t to = offsets[bucket + 1]++;
      x_[to] = tiles_[tile].column + bins.particles[particle].x;
      y_[to] = bins.particles[particle].y;
      if (!source_.empty()) source_[to] = bins.particles[particle].source;
      if (!weight_.empty()) weight_[to] = bins.weight[particle];
      if (!bins.height.empty()) height_[to] = bins.height[particle];
      if (!bins.size.empty()) size_[to] = bins.size[particle];
    }
  });
}

// Calls visit(offset, 1 - d^2 / R^2, weight) for the particles of a slice at distances d < R.
template <typename Visit>
void LevelSetSampler::ForEachInSpace(std::uint32_t tile, double x, double y, Visit visit) const {
  const double inverse_square = 1 / (scale_.kernel_radius * scale_.kernel_radius);
  ForEachNear(tile, x, y, scale_.kernel_radius, [&](double px, double py, std::uint32_t particle) {
    const SpaceOffset to{px - x, py - y, height_[particle]};
    const double square = to.x * to.x + to.y * to.y + to.height * to.height;
    const double within = 1 - square * inverse_square;
    if (within <= 0) return;
    visit(to, within, weight_.empty() ? scale_.uniform_weight : weight_[particle]);
  });
}

SliceSums LevelSetSampler::SliceSumsAt(std::uint32_t tile, double x, double y) const {
  SliceSums sums;
  ForEachInSpace(tile, x, y, [&](const SpaceOffset& to, double within, double weight) {
    sums.Add(to, within, weight);
  });
  return sums;
}

FieldSample LevelSetSampler::SampleSlice(std::uint32_t tile, double x, double y) const {
  SliceSums sums;
  SliceSlopes slopes;
  ForEachInSpace(tile, x, y, [&](const SpaceOffset& to, double within, double weight) {
    sums.Add(to, within, weight);
    slopes.Add(to, within, weight);
  });
  FieldSample sample{.density = sums.density, .value = sums.Value(scale_)};
  sample.has_support = sums.kernel > 0;
  sample.phi = scale_.kernel_radius - scale_.reference_radius;
  if (!sample.has_support) return sample;
  sample.mean_x = sums.x / sums.kernel;
  sample.mean_y = sums.y / sums.kernel;
  sample.phi = sums.Phi(scale_);
  sample.spread = sums.Spread(scale_);
  const Point phi = slopes.OfPhi(sums, scale_);
  sample.phi_x = phi.x;
  sample.phi_y = phi.y;
  Point gradient = phi;
  if (sample.value != sample.phi) {
    // Guard and saturation have the same gradient.
    const Point density = slopes.OfDensity(scale_);
    gradient = {-scale_.guard_slope * density.x, -scale_.guard_slope * density.y};
    if (sample.value == (sample.spread - scale_.gap_spread) * scale_.gap_slope) {
      // Few points lie in gaps, so central differences are fast enough.
      const double step = kGapStep * scale_.kernel_radius;
      const auto spread = [&](double dx, double dy) {
        const SliceSums beside = SliceSumsAt(tile, x + dx, y + dy);
        return beside.kernel > 0 ? beside.Spread(scale_) : sample.spread;
      };
      const double slope = scale_.gap_slope / (2 * step);
      gradient = {slope * (spread(step, 0) - spread(-step, 0)),
                  slope * (spread(0, step) - spread(0, -step))};
    }
  }
  sample.gradient_x = gradient.x;
  sample.gradient_y = gradient.y;
  return sample;
}

// Replaces F by the distance to the nearest surface of a grain if this is smaller.
void LevelSetSampler::JoinGrains(std::uint32_t tile, const Point& point,
                                 LevelSetSample& sample) const {
  const double largest = scale_.spacing * scale_.sizes.largest / 2;
  const double range =
      std::min(largest + std::max(sample.value, 0.0), scale_.reach - NeighbourGrid::kStep);
  ForEachNear(tile, point.x, point.y, range, [&](double x, double y, std::uint32_t particle) {
    const double to_x = point.x - x, to_y = point.y - y;
    const double length = std::sqrt(to_x * to_x + to_y * to_y);
    const double distance = length - scale_.spacing * size_[particle] / 2;
    if (distance >= sample.value) return;
    const double inverse = length > 0 ? 1 / length : 0;
    sample = {distance, to_x * inverse, to_y * inverse, size_[particle]};
  });
}

FieldSample LevelSetSampler::Sample(std::uint32_t tile, double x, double y) const {
  if (scale_.is_slice) return SampleSlice(tile, x, y);
  const Point point{x, y};
  PointQuery query;
  query.points = {&point, 1};
  FindNear(tile, query.points, KernelRange(), query.near);
  PointSamples samples;
  SampleAtPoints(scale_, {&query, 1}, samples);
  LevelSetSample at{samples.value[0], samples.gradient_x[0], samples.gradient_y[0],
                    samples.size[0]};
  if (scale_.has_grains) JoinGrains(tile, point, at);
  return {.density = samples.density[0],
          .mean_x = samples.mean_x[0],
          .mean_y = samples.mean_y[0],
          .phi = samples.phi[0],
          .phi_x = samples.phi_x[0],
          .phi_y = samples.phi_y[0],
          .spread = samples.spread[0],
          .value = at.value,
          .gradient_x = at.gradient_x,
          .gradient_y = at.gradient_y,
          .size = at.size,
          .has_support = samples.kernel[0] > 0};
}

void LevelSetSampler::Sample(std::span<const FieldPoints> groups,
                             std::span<FieldSamples> samples) const {
  if (scale_.is_slice) {
    for (std::size_t q = 0; q < groups.size(); ++q) {
      for (std::size_t k = 0; k < groups[q].count; ++k) {
        const auto& [x, y] = groups[q].points[k];
        const FieldSample at = SampleSlice(groups[q].tile, x, y);
        samples[q][k] = {at.value, at.gradient_x, at.gradient_y};
      }
    }
    return;
  }
  std::array<PointQuery, kQueriesAtOnce> queries;
  for (std::size_t q = 0; q < groups.size(); ++q) {
    queries[q].points = std::span(groups[q].points).first(groups[q].count);
    FindNear(groups[q].tile, queries[q].points, KernelRange(), queries[q].near);
  }
  PointSamples at;
  SampleAtPoints(scale_, std::span(queries).first(groups.size()), at);
  std::size_t point = 0;
  for (std::size_t q = 0; q < groups.size(); ++q) {
    for (std::size_t k = 0; k < groups[q].count; ++k, ++point) {
      samples[q][k] = {at.value[point], at.gradient_x[point], at.gradient_y[point], at.size[point]};
      if (scale_.has_grains) JoinGrains(groups[q].tile, groups[q].points[k], samples[q][k]);
    }
  }
}

}  // namespace partiemc
