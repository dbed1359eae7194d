#include "point_field.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cell_mask.h"
#include "level_set_formula.h"
#include "near_entries.h"
#include "parallel.h"

namespace partiemc {
void PointField::MarkTiles(const ParticleBins& bins, const Crossings& crossings, double wander) {
  const auto tiles = static_cast<std::uint32_t>(bins.tiles.size());
  boxes_.assign(tiles, {});
  asked_.resize(tiles);
  const auto is_active = [&](std::uint32_t tile) {
    if (tile == kNoTile) return false;
    const std::size_t end =
        tile + 1 < tiles ? crossings.tiles[tile + 1].first_cell : crossings.cells.size();
    return crossings.tiles[tile].first_cell < end;
  };
  // Farther than a mask holds everything is asked for.
  const int distance = static_cast<int>(std::min<double>(std::ceil(wander), kMaskMargin));
  const bool all = wander > kMaskMargin;
  ParallelFor(tiles, [&](std::uint32_t tile) {
    const Neighbourhood& near = bins.tiles.neighbours(tile);
    if (!std::any_of(near.begin(), near.end(), is_active)) return;
    asked_[tile] = CellsNear(bins.tiles, tile, distance, [&](std::uint32_t of) -> const BitRows& {
      return crossings.tiles[of].active;
    });
    if (all) asked_[tile].fill(~std::uint32_t{0});
    if (IsEmpty(asked_[tile])) return;
    boxes_[tile] = HasMasks() ? grid_.Around(Widened(asked_[tile], Reach(), Reach())) : grid_.All();
  });
}

void PointField::Build(const ParticleBins& bins, const Crossings& crossings, const Scale& scale,
                       double wander) {
  scale_ = scale;
  grid_ = BucketGrid(scale.kernel_radius);
  MarkTiles(bins, crossings, wander);

  const auto tiles = static_cast<std::uint32_t>(bins.tiles.size());
  std::uint32_t bucket_count = 0;
  first_bucket_.resize(tiles);
  for (std::uint32_t tile = 0; tile < tiles; ++tile) {
    first_bucket_[tile] = bucket_count;
    if (IsIndexed(tile)) bucket_count += boxes_[tile].count() + 2;
  }
  bucket_offsets_.resize(bucket_count);
  const auto for_each_indexed = [&](auto visit) {
    ParallelFor(tiles, [&](std::uint32_t tile) {
      if (IsIndexed(tile)) visit(tile);
    });
  };
  first_entry_.resize(tiles);
  for_each_indexed([&](std::uint32_t tile) { first_entry_[tile] = CountEntries(bins, tile); });
  std::uint32_t entry_count = 0;
  for (std::uint32_t tile = 0; tile < tiles; ++tile) {
    if (IsIndexed(tile)) entry_count += std::exchange(first_entry_[tile], entry_count);
  }
  x_.resize(entry_count + kRowPadding);
  y_.resize(entry_count + kRowPadding);
  source_.resize(entry_count);
  weight_.resize(bins.weight.empty() ? 0 : entry_count + kRowPadding);
  for_each_indexed([&](std::uint32_t tile) { FillEntries(bins, tile); });
}

std::span<std::uint32_t> PointField::OffsetsOf(std::uint32_t tile) {
  return {bucket_offsets_.data() + first_bucket_[tile], std::size_t{boxes_[tile].count()} + 2};
}

// The particles within reach of a point that may be asked for.
NearWalk PointField::Near(const ParticleBins& bins, std::uint32_t tile, NearFields fields) const {
  if (!HasMasks()) return NearWalk(bins, tile, nullptr, fields);
  const CellMask mask = Widened(asked_[tile], Reach(), Reach());
  return NearWalk(bins, tile, &mask, fields);
}

// Counts the particles in each bucket of a tile, two places behind it. Returns how many they are.
std::uint32_t PointField::CountEntries(const ParticleBins& bins, std::uint32_t tile) {
  const std::span<std::uint32_t> offsets = OffsetsOf(tile);
  std::fill(offsets.begin(), offsets.end(), 0);
  BucketGrid::Buckets buckets;
  std::uint32_t count = 0;
  Near(bins, tile, NearFields::kPositions).ForEachBlock([&](const NearEntries& near) {
    grid_.Find(near, boxes_[tile], buckets);
    for (int k = 0; k < near.count; ++k) ++offsets[buckets[k] + 2];
    count += static_cast<std::uint32_t>(near.count);
  });
  return count;
}

// Turns the counts of a tile's buckets into offsets, and fills the buckets.
void PointField::FillEntries(const ParticleBins& bins, std::uint32_t tile) {
  // Where the next entry of a bucket goes stands one place behind it, and in the end is where the
  // next bucket starts.
  const std::span<std::uint32_t> offsets = OffsetsOf(tile);
  std::uint32_t next = first_entry_[tile];
  for (std::uint32_t& offset : offsets) offset = next += offset;
  BucketGrid::Buckets buckets;
  Near(bins, tile, NearFields::kAll).ForEachBlock([&](const NearEntries& near) {
    grid_.Find(near, boxes_[tile], buckets);
    for (int k = 0; k < near.count; ++k) {
      const std::uint32_t to = offsets[buckets[k] + 1]++;
      x_[to] = near.x[k];
      y_[to] = near.y[k];
      source_[to] = near.source[k];
      if (!bins.weight.empty()) weight_[to] = bins.weight[near.entry[k]];
    }
  });
}

namespace {

// The spread of the particles (level_set_formula.h) from their moments, in units of R^2.
class Spread {
 public:
  Spread(const PointSums& sums, double inverse_square)
      : sums_(sums),
        share_(inverse_square / sums.kernel),
        xx_(sums.kxx * share_),
        xy_(sums.kxy * share_),
        yy_(sums.kyy * share_),
        value_(LargerEigenvalue(xx_, xy_, yy_)) {}

  double value() const { return value_; }

  LatticePoint Gradient(const PointThirdSums& third) const {
    // The eigenvector's square e e^T = (M - s' I) / (s - s'), s' the smaller eigenvalue; where both
    // are the same, either direction is as good.
    const double gap = 2 * value_ - (xx_ + yy_);
    const double exx = gap > 0 ? (value_ - yy_) / gap : 0.5;
    const double exy = gap > 0 ? xy_ / gap : 0;
    const double eyy = 1 - exx;
    // ds = e . dM e, where M is a ratio of sums, and d_a = x_i - x falls as x grows.
    const auto along = [&](double dxx, double dxy, double dyy, double slope) {
      return (exx * dxx + 2 * exy * dxy + eyy * dyy) * share_ - value_ * slope / sums_.kernel;
    };
    return {
        along(third.xxx - 2 * sums_.moment_x, third.xxy - sums_.moment_y, third.xyy, sums_.slope_x),
        along(third.xxy, third.xyy - sums_.moment_x, third.yyy - 2 * sums_.moment_y,
              sums_.slope_y)};
  }

 private:
  const PointSums& sums_;
  double share_, xx_, xy_, yy_, value_;
};

}  // namespace

FieldSample PointField::Sample(std::uint32_t tile, double x, double y) const {
  const LatticePoint point{x, y};
  const PointQuery query{RowsNear(tile, {&point, 1}, scale_.kernel_radius), {point}, 1};
  QuerySums sums;
  SumAtPoints(Kernel(), {&query, 1}, {&sums, 1});
  return SampleOf(query, point, sums[0]);
}

void PointField::Sample(std::span<const FieldPoints> places,
                        std::span<FieldSamples> samples) const {
  std::array<PointQuery, kQueriesAtOnce> queries;
  for (std::size_t q = 0; q < places.size(); ++q) {
    const auto& [tile, points, count] = places[q];
    const NearRows near = RowsNear(tile, std::span(points).first(count), scale_.kernel_radius);
    queries[q] = {near, points, count};
  }
  std::array<QuerySums, kQueriesAtOnce> sums;
  SumAtPoints(Kernel(), std::span(queries).first(places.size()), sums);
  for (std::size_t q = 0; q < places.size(); ++q) {
    for (std::size_t k = 0; k < places[q].count; ++k) {
      samples[q][k] = SampleOf(queries[q], places[q].points[k], sums[q][k]);
    }
  }
}

FieldSample PointField::SampleOf(const NearRows& near, const LatticePoint& point,
                                 const PointSums& sums) const {
  FieldSample sample;
  if (sums.kernel <= 0) {
    sample.phi = scale_.kernel_radius - scale_.reference_radius;
    sample.value = scale_.VoidValue();
    return sample;
  }
  sample.has_support = true;
  sample.density = sums.density;
  const double share = 1 / sums.kernel;
  sample.mean_x = sums.moment_x * share;
  sample.mean_y = sums.moment_y * share;
  const double distance = std::sqrt(sample.mean_x * sample.mean_x + sample.mean_y * sample.mean_y);
  sample.phi = distance - scale_.reference_radius;
  if (distance > 0) {
    // grad |v| with v = x - xbar = -mean and d xbar_a / dx_b = (sum k_b (d_a - mean_a)) / sum k.
    const double jxx = (sums.xx - sample.mean_x * sums.slope_x) * share;
    const double jxy = (sums.xy - sample.mean_x * sums.slope_y) * share;
    const double jyx = (sums.xy - sample.mean_y * sums.slope_x) * share;
    const double jyy = (sums.yy - sample.mean_y * sums.slope_y) * share;
    const double unit_x = sample.mean_x / distance;
    const double unit_y = sample.mean_y / distance;
    sample.phi_x = unit_x * jxx + unit_y * jyx - unit_x;
    sample.phi_y = unit_x * jxy + unit_y * jyy - unit_y;
  }
  const LevelSetFormula<double> formula(scale_);
  const Spread spread(sums, Kernel().inverse_square);
  sample.spread = spread.value();
  sample.value = formula.Value(sums.density, sample.phi, sample.spread);
  if (sample.value == sample.phi) {
    sample.gradient_x = sample.phi_x;
    sample.gradient_y = sample.phi_y;
  } else if (sample.value == formula.Gap(sample.spread)) {
    const LatticePoint gradient = spread.Gradient(ThirdSumsAtPoint(Kernel(), near, point));
    sample.gradient_x = gradient.x * scale_.gap_slope;
    sample.gradient_y = gradient.y * scale_.gap_slope;
  } else {
    // Guard and saturation fall with the density alike.
    sample.gradient_x = -sums.density_x * scale_.guard_slope;
    sample.gradient_y = -sums.density_y * scale_.guard_slope;
  }
  return sample;
}

}  // namespace partiemc
