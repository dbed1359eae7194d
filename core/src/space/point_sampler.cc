#include "space/point_sampler.h"

#include <algorithm>
#include <cmath>

namespace partiemc::space {
namespace {

QueryPoint QueryAt(const Vec3& point) {
  return {static_cast<float>(point.x), static_cast<float>(point.y), static_cast<float>(point.z)};
}

float InverseSquare(const Scale& scale) {
  return static_cast<float>(1 / (scale.kernel_radius * scale.kernel_radius));
}

double WeightOf(const SpaceBins& bins, const Scale& scale) {
  return bins.weight.empty() ? scale.uniform_weight : 1;
}

}  // namespace

void PointSampler::MoveTo(std::uint32_t brick, const NearBox& box) {
  is_in_brick_ = is_in_brick_ && brick == brick_;
  brick_ = brick;
  box_ = box;
  if (!bins_.size.empty()) {
    is_whole_ = Select();
    return;
  }
  int blocks = 0;
  is_on_rows_ = IsOnRows();
  CollectBlocks([&](const NearBlock&) { ++blocks; });
  is_whole_ = blocks <= 1;
}

// With own sizes: selects the particles whose kernels reach the box. Returns false if not all fit
// in `block_`. A search with the reaches of all size classes is slow. So one search serves the
// brick if its particles fit, then one selection serves each part of 4 x 4 x 4 cells.
bool PointSampler::Select() {
  const auto radius = static_cast<float>(scale_.kernel_radius);
  if (!is_in_brick_) {
    constexpr float kSide = kBrickSize;
    has_whole_ = whole_.Collect(bins_, brick_, {{0, 0, 0}, {kSide, kSide, kSide}}, radius);
    has_part_ = false;
    is_in_brick_ = true;
  }
  constexpr float kPart = 4;
  NearBox part;
  for (int axis = 0; axis < 3; ++axis) {
    part.low[axis] = kPart * std::floor(box_.low[axis] / kPart);
    part.high[axis] = std::max(part.low[axis] + kPart, box_.high[axis]);
  }
  const bool is_within = *std::ranges::min_element(part.low) >= 0 &&
                         *std::ranges::max_element(part.high) <= static_cast<float>(kBrickSize);
  if (!has_part_ || part.low != part_box_.low || part.high != part_box_.high) {
    part_box_ = part;
    has_part_ = has_whole_ && is_within ? SelectReaching(whole_, part, radius, part_)
                                        : part_.Collect(bins_, brick_, part, radius);
    if (!has_part_ && !part_.Collect(bins_, brick_, box_, radius)) return false;
  }
  return SelectReaching(part_, box_, radius, block_);
}

// Whether the box is a cube of `rows_`. Sets its corner.
bool PointSampler::IsOnRows() {
  if (rows_ == nullptr || !rows_->is_exact()) return false;
  const auto side = static_cast<float>(rows_->side());
  for (int axis = 0; axis < 3; ++axis) {
    corner_[axis] = static_cast<int>(box_.low[axis]);
    const auto low = static_cast<float>(corner_[axis]);
    if (box_.low[axis] != low || box_.high[axis] != low + side) return false;
  }
  return true;
}

template <typename Visit>
void PointSampler::ForEachBlock(Visit visit) {
  if (is_whole_) {
    visit(block_);
  } else {
    CollectBlocks(visit);
  }
}

template <typename Visit>
void PointSampler::CollectBlocks(Visit visit) {
  if (is_on_rows_) {
    const auto for_each_run = [&](auto visit_run) {
      rows_->ForEachRun(bins_, brick_, corner_, visit_run);
    };
    ForEachBlockOf(bins_, for_each_run, block_, visit);
  } else {
    ForEachNearBlock(bins_, brick_, box_, static_cast<float>(scale_.kernel_radius), block_, visit);
  }
}

double PointSampler::Value(const Vec3& point) {
  PartialMoments moments;
  const QueryPoint at = QueryAt(point);
  ForEachBlock(
      [&](const NearBlock& block) { AddMoments(block, at, InverseSquare(scale_), moments); });
  return LevelSetOf(Total(moments), scale_).value;
}

PointSample PointSampler::Sample(const Vec3& point) {
  PartialMoments moments;
  PartialSlopes partial;
  const QueryPoint at = QueryAt(point);
  ForEachBlock([&](const NearBlock& block) {
    AddMomentsAndSlopes(block, at, InverseSquare(scale_), moments, partial);
  });
  const Sums sums = Total(moments);
  const LevelSetAt level = LevelSetOf(sums, scale_);
  if (!(sums.kernel > 0)) return {level.value, {}, 1};
  const Slopes slopes = bins_.size.empty()
                            ? TotalOf(partial, WeightOf(bins_, scale_))
                            : SizedTotalOf(partial, scale_.uniform_weight, sums.kernel);
  return {level.value, sums.size * GradientOf(level.term, sums, slopes, at), sums.size};
}

Sums PointSampler::Total(const PartialMoments& moments) const {
  return bins_.size.empty() ? TotalOf(moments, WeightOf(bins_, scale_))
                            : SizedTotalOf(moments, scale_.uniform_weight);
}

Vec3 PointSampler::GradientOf(Term term, const Sums& sums, const Slopes& slopes,
                              const QueryPoint& point) {
  switch (term) {
    case Term::kPhi:
      return GradientOfPhi(sums, slopes, scale_);
    case Term::kGap:
      return GradientOfGap(sums, slopes, point);
    case Term::kGuard:
    case Term::kSaturation:
      break;
  }
  const double six = 6 / (scale_.kernel_radius * scale_.kernel_radius);
  return (-six * scale_.guard_slope) * slopes.density;
}

// With the largest eigenvalue m of M = sum k D D^T and its unit eigenvector v:
//   grad m = 6 / R^2 sum t^2 D (v . D)^2 / s - 2 (v . sum k D / s) v,
//   sigma = m / (R^2 sum k).
Vec3 PointSampler::GradientOfGap(const Sums& sums, const Slopes& slopes, const QueryPoint& point) {
  const Vec3 v = Eigenvector(sums.second, LargestEigenvalue(sums.second));
  PartialThirds partial;
  ForEachBlock(
      [&](const NearBlock& block) { AddThirds(block, point, InverseSquare(scale_), v, partial); });
  const Vec3 third{partial.Total(0), partial.Total(1), partial.Total(2)};
  const double square = scale_.kernel_radius * scale_.kernel_radius;
  const double six = 6 / square;
  const double along = bins_.size.empty() ? Dot(v, sums.first) : partial.Total(3);
  const Vec3 of_moment = six * third - (2 * along) * v;
  const double spread = SpreadOf(sums, scale_);
  return (scale_.gap_slope / sums.kernel) *
         ((1 / square) * of_moment - (spread * six) * slopes.first);
}

}  // namespace partiemc::space
