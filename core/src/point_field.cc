#include "point_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace partiemc {
namespace {

// Wide kernels get wider buckets: a query then still looks at about ten rows of them.
constexpr double kBucketsPerRadius = 4;

}  // namespace

void PointField::MarkTiles(const ParticleBins& bins, const Crossings& crossings, bool neighbours) {
  first_bucket_.assign(bins.tiles.size(), kNoTile);
  for (std::uint32_t tile = 0; tile < bins.tiles.size(); ++tile) {
    const BitRows& active = crossings.tiles[tile].active;
    if (std::all_of(active.begin(), active.end(), [](std::uint32_t row) { return row == 0; })) {
      continue;
    }
    first_bucket_[tile] = 0;
    if (!neighbours) continue;
    for (const std::uint32_t near : bins.tiles.neighbours(tile)) {
      if (near != kNoTile) first_bucket_[near] = 0;
    }
  }
}

void PointField::Build(const ParticleBins& bins, const Crossings& crossings, const Scale& scale,
                       bool neighbours) {
  scale_ = scale;
  bucket_size_ = std::max(1.0, scale.kernel_radius / kBucketsPerRadius);
  margin_ = scale.kernel_radius;
  bucket_columns_ = static_cast<int>(std::floor((kTileSize + 2 * margin_) / bucket_size_)) + 1;
  MarkTiles(bins, crossings, neighbours);

  const auto buckets = static_cast<std::uint32_t>(bucket_columns_ * bucket_columns_ + 1);
  first_entry_.assign(bins.tiles.size(), 0);
  std::uint32_t bucket_count = 0;
  std::uint32_t entry_count = 0;
  for (std::uint32_t tile = 0; tile < bins.tiles.size(); ++tile) {
    if (first_bucket_[tile] == kNoTile) continue;
    first_bucket_[tile] = bucket_count;
    first_entry_[tile] = entry_count;
    bucket_count += buckets;
    entry_count += bins.offsets[tile + 1] - bins.offsets[tile];
  }
  bucket_offsets_.resize(bucket_count);
  x_.resize(entry_count);
  y_.resize(entry_count);
  source_.resize(entry_count);
  weight_.resize(bins.weight.empty() ? 0 : entry_count);
  tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(bins.tiles.size()),
                    [&](std::uint32_t tile) {
                      if (first_bucket_[tile] != kNoTile) SortTile(bins, tile);
                    });
}

void PointField::SortTile(const ParticleBins& bins, std::uint32_t tile) {
  const std::span<std::uint32_t> offsets(
      bucket_offsets_.data() + first_bucket_[tile],
      static_cast<std::size_t>(bucket_columns_) * bucket_columns_ + 1);
  std::fill(offsets.begin(), offsets.end(), 0);
  const auto bucket_of = [&](std::uint32_t e) {
    return Buckets(bins.y[e], 0).first * bucket_columns_ + Buckets(bins.x[e], 0).first;
  };
  for (std::uint32_t e = bins.offsets[tile]; e < bins.offsets[tile + 1]; ++e) {
    ++offsets[bucket_of(e)];
  }
  std::uint32_t next = first_entry_[tile];
  for (std::uint32_t& offset : offsets) {
    const std::uint32_t count = offset;
    offset = next;
    next += count;
  }
  for (std::uint32_t e = bins.offsets[tile]; e < bins.offsets[tile + 1]; ++e) {
    const std::uint32_t entry = offsets[bucket_of(e)]++;
    x_[entry] = bins.x[e];
    y_[entry] = bins.y[e];
    source_[entry] = bins.source[e];
    if (!bins.weight.empty()) weight_[entry] = bins.weight[e];
  }
  // Filling moved every offset to the start of the next bucket.
  std::copy_backward(offsets.begin(), offsets.end() - 1, offsets.end());
  offsets.front() = first_entry_[tile];
}

PointField::BucketRange PointField::Buckets(double centre, double radius) const {
  const auto bucket = [this](double coordinate) {
    const int index = static_cast<int>(std::floor((coordinate + margin_) / bucket_size_));
    return std::clamp(index, 0, bucket_columns_ - 1);
  };
  return {bucket(centre - radius), bucket(centre + radius)};
}

FieldSample PointField::Sample(std::uint32_t tile, double x, double y) const {
  const double inverse_square = 1 / (scale_.kernel_radius * scale_.kernel_radius);
  double weight = 0;                                 // sum k
  double moment_x = 0, moment_y = 0;                 // sum k d, d = x_i - x
  double slope_x = 0, slope_y = 0;                   // sum grad k
  double xx = 0, xy = 0, yx = 0, yy = 0;             // sum (dk / da) d_b, named ba
  double density = 0, density_x = 0, density_y = 0;  // sum w k and its gradient
  const bool weighted = !weight_.empty();
  ForEachNear(tile, x, y, scale_.kernel_radius, [&](double px, double py, std::uint32_t entry) {
    const double dx = px - x;
    const double dy = py - y;
    const double t = 1 - (dx * dx + dy * dy) * inverse_square;
    if (t <= 0) return;
    const double k = t * t * t;
    const double slope = 6 * t * t * inverse_square;
    const double kx = slope * dx;
    const double ky = slope * dy;
    weight += k;
    moment_x += k * dx;
    moment_y += k * dy;
    slope_x += kx;
    slope_y += ky;
    xx += kx * dx;
    xy += ky * dx;
    yx += kx * dy;
    yy += ky * dy;
    const double w = weighted ? static_cast<double>(weight_[entry]) : scale_.uniform_weight;
    density += w * k;
    density_x += w * kx;
    density_y += w * ky;
  });

  FieldSample sample;
  if (weight <= 0) {
    sample.phi = scale_.kernel_radius - scale_.reference_radius;
    sample.value = scale_.VoidValue();
    return sample;
  }
  sample.has_support = true;
  sample.density = density;
  sample.mean_x = moment_x / weight;
  sample.mean_y = moment_y / weight;
  const double distance = std::sqrt(sample.mean_x * sample.mean_x + sample.mean_y * sample.mean_y);
  sample.phi = distance - scale_.reference_radius;
  if (distance > 0) {
    // grad |v| with v = x - xbar = -mean and d xbar_a / dx_b = (sum k_b (d_a - mean_a)) / sum k.
    const double jxx = (xx - sample.mean_x * slope_x) / weight;
    const double jxy = (xy - sample.mean_x * slope_y) / weight;
    const double jyx = (yx - sample.mean_y * slope_x) / weight;
    const double jyy = (yy - sample.mean_y * slope_y) / weight;
    sample.phi_x = (sample.mean_x * jxx + sample.mean_y * jyx - sample.mean_x) / distance;
    sample.phi_y = (sample.mean_x * jxy + sample.mean_y * jyy - sample.mean_y) / distance;
  }
  const double guard_value = (scale_.guard - density) * scale_.guard_slope;
  if (sample.phi >= guard_value) {
    sample.value = sample.phi;
    sample.gradient_x = sample.phi_x;
    sample.gradient_y = sample.phi_y;
  } else {
    sample.value = guard_value;
    sample.gradient_x = -density_x * scale_.guard_slope;
    sample.gradient_y = -density_y * scale_.guard_slope;
  }
  return sample;
}

}  // namespace partiemc
