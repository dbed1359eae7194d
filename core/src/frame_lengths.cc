#include "frame_lengths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/bits.h"
#include "bins/resolution.h"
#include "bins/spacing_doubt.h"
#include "frame/calibration.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// With SpacingRule::kEveryFrame, the estimate of a later frame is clamped to these limits, in cells
// of the existing lattice (with grains, in pairs of cells), so that a kernel spans a sensible
// number of cells.
constexpr double kMinSpacingInCells = 0.25;
constexpr double kMaxSpacingInCells = 4;

// Volumes of one frame may differ from h^2 by this factor. A smaller particle would determine the
// guard term of F for the whole frame. Beside a larger particle, float sums would lose the others.
constexpr double kMaxVolumeRatio = 1e6;

// Volumes are doubtful if more than half of them are above this factor times h^2, or more than half
// below h^2 divided by it. Disks of diameter h have 0.79 h^2, hexagonal packing 0.87 h^2.
constexpr double kDoubtfulVolumeRatio = 2;

// The side of a square whose area is the median volume.
double SpacingOfVolumes(std::span<const float> volumes, std::vector<double>& scratch) {
  scratch.assign(volumes.begin(), volumes.end());
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
  std::nth_element(scratch.begin(), middle, scratch.end());
  return std::sqrt(*middle);
}

// The spacing for grains: the smallest diameter, or more if the largest would be too large for this
// spacing or its lattice. Requires: the frame has volumes.
double SpacingOfGrains(const ReconstructionParameters& parameters, std::span<const float> volumes) {
  const auto [least, most] = std::ranges::minmax_element(volumes);
  constexpr double kLargest = ReconstructionParameters::kLargestGrain;
  static_assert(kLargest * kGrainKernelRadius <= kTileSize, "kernels reach neighbouring tiles");
  const double ratio =
      std::min(parameters.kMostSizeRatio, kLargest * CellUnit(parameters) * parameters.cell_size);
  return std::max(std::sqrt(double{*least}), std::sqrt(double{*most}) / ratio);
}

// The spacing that the particles of a frame show; empty if there is no estimate. If the particles
// do not agree on a spacing, the volumes give a better estimate than the distances.
absl::StatusOr<std::optional<SpacingEstimate>> OwnSpacing(
    const ReconstructionParameters& parameters, const Frame& frame, SpacingScratch& scratch) {
  std::optional<SpacingEstimate> own;
  if (parameters.sizes == Sizes::kOwn) {
    if (!frame.volumes.empty()) {
      own = SpacingEstimate{parameters.boundary == Boundary::kGrains
                                ? SpacingOfGrains(parameters, frame.volumes)
                                : SpacingOfSizes(frame.volumes),
                            true};
    }
  } else {
    own = EstimateSpacing(frame, parameters.plane, scratch);
    if ((!own || !own->is_agreed) && !frame.volumes.empty()) {
      own = SpacingEstimate{SpacingOfVolumes(frame.volumes, scratch.weights), false};
    }
  }
  if (!own || (own->spacing >= ReconstructionParameters::kMinSpacing &&
               own->spacing <= ReconstructionParameters::kMaxSpacing))
    return own;
  if (!own->is_agreed) return std::nullopt;
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(kReasonOutOfRange), "positions",
                         absl::StrCat("spacing of ", ShortestNumber(own->spacing)),
                         "must have a spacing in [1e-60, 1e60]"});
}

}  // namespace

double SpacingOfSizes(std::span<const float> volumes) {
  double sum = 0;
  for (const float volume : volumes) sum += volume;
  return std::sqrt(sum / static_cast<double>(volumes.size()));
}

absl::StatusOr<std::optional<Lengths>> DecideLengths(const ReconstructionParameters& parameters,
                                                     const Frame& frame, const State& state,
                                                     SpacingScratch& scratch) {
  std::optional<double> spacing = parameters.spacing;
  if (!spacing && parameters.spacing_rule == SpacingRule::kFirstFrame) spacing = state.spacing;
  bool is_provisional = false;
  if (!spacing) {
    const auto own = OwnSpacing(parameters, frame, scratch);
    if (!own.ok()) return own.status();
    const bool is_agreed = *own && (*own)->is_agreed;
    is_provisional = !is_agreed && !state.spacing;
    if (is_agreed || (is_provisional && *own)) {
      spacing = (*own)->spacing;
    } else {
      spacing = state.spacing;
    }
  }
  if (!spacing) return std::nullopt;
  const double unit = CellUnit(parameters);
  const double cell_size = state.cell_size.value_or(unit * parameters.cell_size * *spacing);
  const double cell = cell_size / unit;
  return Lengths{std::clamp(*spacing, kMinSpacingInCells * cell, kMaxSpacingInCells * cell),
                 cell_size, is_provisional};
}

absl::StatusOr<double> LightestVolume(const Frame& frame, double usual, Doubts& doubts) {
  if (frame.volumes.empty()) return usual;
  double lightest = std::numeric_limits<double>::infinity();
  std::size_t large = 0, small = 0;
  for (std::size_t k = 0; k < frame.volumes.size(); ++k) {
    const double volume = frame.volumes[k];
    if (!(volume <= kMaxVolumeRatio * usual && volume >= usual / kMaxVolumeRatio)) {
      return ViolationError(
          absl::StatusCode::kInvalidArgument,
          {std::string(kReasonOutOfRange), absl::StrCat("volumes[", k, "]"), ShortestNumber(volume),
           absl::StrCat("must be within a factor of 1e6 of the volume by the spacing, ",
                        ShortestNumber(usual))});
    }
    lightest = std::min(lightest, volume);
    large += volume > kDoubtfulVolumeRatio * usual ? 1 : 0;
    small += kDoubtfulVolumeRatio * volume < usual ? 1 : 0;
  }
  if (2 * std::max(large, small) > frame.volumes.size()) {
    doubts.Add(Doubt::kVolumesContradictSpacing);
  }
  return lightest;
}

absl::StatusOr<SizeRange> RangeOfSizes(const Frame& frame,
                                       const ReconstructionParameters& parameters,
                                       const Lengths& lengths) {
  if (frame.volumes.empty()) return SizeRange{};
  const auto [least, most] = std::ranges::minmax_element(frame.volumes);
  const double spacing = lengths.spacing;
  const bool is_in_space = parameters.slice.has_value();
  const auto size_of = [is_in_space](double volume) {
    return is_in_space ? CubeRoot(volume) : std::sqrt(volume);
  };
  const SizeRange sizes{size_of(*least) / spacing, size_of(*most) / spacing};
  constexpr double kRatio = ReconstructionParameters::kMostSizeRatio;
  // A kernel reaches at most the tiles beside the tile of its particle. In space, the same limit
  // bounds the bricks that a particle reaches.
  const double largest =
      std::min(kRatio, kTileSize * lengths.cell_size / (parameters.kernel_radius * spacing));
  const double smallest =
      parameters.boundary == Boundary::kGrains
          ? std::max(1 / kRatio, parameters.kSmallestGrain * lengths.cell_size / spacing)
          : 1 / kRatio;
  // Volumes are rounded to float.
  constexpr double kBelow = 1 - 1e-6, kRounded = 1 + 1e-6;
  if (sizes.smallest >= kBelow * smallest && sizes.largest <= largest * kRounded) return sizes;
  // Names the smallest or the largest size. If both are wrong, the side with fewer particles is
  // named.
  const auto count = [&](auto is_beyond) {
    return std::ranges::count_if(frame.volumes, is_beyond);
  };
  const auto above = count([&](float v) { return size_of(v) > largest * kRounded * spacing; });
  const auto below = count([&](float v) { return size_of(v) < kBelow * smallest * spacing; });
  const bool is_large = above > 0 && (below == 0 || above <= below);
  const auto worst = is_large ? most : least;
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonOutOfRange), absl::StrCat("volumes[", worst - frame.volumes.begin(), "]"),
       ShortestNumber(*worst),
       absl::StrCat("must have a ", std::string(is_in_space ? "cube" : "square"),
                    " root, the size, of ", ShortestNumber(smallest), " to ",
                    ShortestNumber(largest), " spacings of ", ShortestNumber(spacing))});
}

absl::Status JudgeLengths(const Frame& frame, Plane plane, const Lengths& lengths,
                          const Scale& scale, const ParticleBins& bins, Doubts& doubts) {
  absl::Status fine = CheckResolution(frame, plane, bins.tiles, lengths.cell_size,
                                      lengths.spacing * scale.sizes.smallest, doubts);
  if (lengths.is_provisional) {
    doubts.Add(Doubt::kSpacingProvisional);
    return absl::OkStatus();
  }
  if (!scale.is_slice && !scale.has_grains && ContradictsSpacing(bins, scale))
    doubts.Add(Doubt::kSpacingContradicted);
  return fine;
}

}  // namespace partiemc
