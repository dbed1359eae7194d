#include "prepared_frame.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "absl/strings/str_cat.h"
#include "bins/resolution.h"
#include "frame/frame_view.h"
#include "partiemc/status.h"
#include "periodic/frame_box.h"

namespace partiemc {
namespace {

// Checks a frame as the output of the stream requires.
absl::Status CheckForOutput(const PreparationInput& input, DistinctIdsScratch& scratch) {
  if (input.parameters.output == Output::kOutline) {
    return CheckFrame(input.given, input.parameters, input.limits, scratch);
  }
  ReconstructionParameters in_space;
  in_space.slice = SlicePlane{};  // Particles fill space.
  return CheckFrame(input.given, in_space, input.limits, scratch);
}

absl::Status CheckGiven(const PreparationInput& input, DistinctIdsScratch& scratch) {
  absl::Status status = CheckForOutput(input, scratch);
  const Frame& given = input.given;
  if (!status.ok() || !input.parameters.noise_filter) return status;
  if (given.ids.size() == given.ParticleCount()) return status;
  return InvalidFrame(kReasonCount, "ids", absl::StrCat(given.ids.size(), " values"),
                      absl::StrCat("must be one per particle (", given.ParticleCount(),
                                   "): the noise filter follows particles by their ids"));
}

// The coordinates that the outlines or the surface use: the first two or three of `axes`.
std::span<const int> AxesInUse(const PreparationInput& input, std::array<int, 3>& axes) {
  axes = {0, 1, 2};
  if (input.parameters.output == Output::kSurface || input.parameters.slice) return axes;
  const Axes in_plane = AxesOf(input.given, input.parameters.plane);
  axes = {in_plane.first, in_plane.second, in_plane.normal};
  return std::span(axes).first(2);
}

// Errors: CORRUPT_STATE if the state belongs to a stream with another number of coordinates.
absl::Status CheckHistory(const NoiseHistory& noise, std::size_t axes) {
  if (noise.given.size() == axes * noise.ids.size()) return absl::OkStatus();
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonCorruptState), "state.noise",
       absl::StrCat(noise.given.size(), " coordinates of ", noise.ids.size(), " particles"),
       absl::StrCat("must have ", axes, " coordinates per particle")});
}

absl::Status Filter(const PreparationInput& input, const Lengths& lengths,
                    std::span<const int> axes, FrameMemory& memory, NoiseFilterScratch& scratch,
                    Frame& frame) {
  absl::Status status = CheckHistory(input.state.noise, axes.size());
  if (!status.ok()) return status;
  const std::optional<PeriodicBox>&of_stream = input.parameters.box, &box = input.given.box;
  const BoxMotion motion = MotionOf(of_stream, input.state.noise.box, box, 1);
  status = FilterNoise({.frame = input.given,
                        .axes = axes,
                        .weight = *input.parameters.noise_filter,
                        .spacing = lengths.spacing,
                        .cell_size = lengths.cell_size,
                        .box = box,
                        .motion = motion,
                        .box_to_store = BoxToStore(of_stream, box),
                        .previous = input.state.noise,
                        .reserve =
                            [&](std::uint64_t bytes) {
                              return memory.ReserveParticles(bytes, "particles to filter");
                            }},
                       scratch, frame);
  memory.Done();
  return status;
}

// `radius`: the largest kernel radius, world units.
absl::Status LiftFrame(const PreparationInput& input, double radius, std::span<const int> axes,
                       FrameMemory& memory, LiftScratch& scratch, Frame& frame,
                       Prepared& prepared) {
  const ReconstructionParameters& parameters = input.parameters;
  // Rings that may cross themselves cannot be cut. Without a margin, Lift refuses bodies that
  // percolate.
  const double margin = KeepsGuarantees(parameters.placement) ? kCopyMargin * radius : 0;
  absl::Status status =
      Lift({.frame = frame,
            .box = *input.given.box,
            .names = input.names,
            .axes = axes,
            .range = 2 * radius,
            .margin = margin,
            .wraps = input.given.box->wraps,
            .reserve =
                [&](std::uint64_t bytes) {
                  return memory.ReserveParticles(bytes, "particles in a periodic box");
                }},
           scratch, prepared.lifted);
  memory.Done();
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const auto axis = static_cast<std::size_t>(axes[k]);
    if (!prepared.lifted.percolates[axis]) continue;
    prepared.window.axes[k] = input.given.box->axes[axis];
    prepared.reach[k] = std::min(margin, input.given.box->axes[axis]->length) - kCopyEnd * radius;
  }
  frame = prepared.lifted.frame;
  return status;
}

}  // namespace

absl::Status PrepareFrame(const PreparationInput& input, FrameMemory& memory,
                          const PreparationScratch& scratch, Frame& frame, Prepared& prepared) {
  const ReconstructionParameters& parameters = input.parameters;
  const bool is_outline = parameters.output == Output::kOutline;
  frame = input.given;
  prepared.lifted = {.frame = frame, .particles = frame.ParticleCount()};
  absl::Status status = CheckGiven(input, scratch.distinct_ids);
  if (!status.ok()) return status;
  const auto decided = DecideLengths(parameters, input.given, input.state, scratch.spacing);
  if (!decided.ok()) return decided.status();
  prepared.lengths = *decided;
  if (!prepared.lengths) return absl::OkStatus();
  const Lengths& lengths = *prepared.lengths;
  SizeRange sizes;
  if (parameters.sizes == Sizes::kOwn) {
    // Before copies are added, so that errors name a given particle.
    const auto range = RangeOfSizes(input.given, parameters, lengths);
    if (!range.ok()) return range.status();
    sizes = *range;
    prepared.largest_size = std::max(prepared.largest_size, sizes.Reach());
  }
  // Slices and surfaces have no check of the resolution.
  if (is_outline && !parameters.slice) {
    status =
        CheckStep(input.given, parameters.plane, lengths.spacing * sizes.smallest, prepared.doubts);
    if (!status.ok() && !lengths.is_provisional) return status;
  }
  if (parameters.box) {
    status = CheckBoxLengths(parameters.box, *input.given.box, parameters.kernel_radius,
                             lengths.spacing, sizes);
    if (!status.ok()) return status;
  }
  std::array<int, 3> all_axes;
  const std::span<const int> axes = AxesInUse(input, all_axes);
  if (parameters.noise_filter && !lengths.is_provisional) {
    status = Filter(input, lengths, axes, memory, scratch.noise, frame);
    if (!status.ok()) return status;
    prepared.is_filtered = true;
  }
  if (!parameters.box || !is_outline) return absl::OkStatus();
  prepared.is_lifted = true;
  const double radius = parameters.kernel_radius * lengths.spacing * sizes.Reach();
  return LiftFrame(input, radius, axes, memory, scratch.lift, frame, prepared);
}

BoxMotion MotionInPlane(const ReconstructionParameters& parameters, const Frame& frame,
                        const std::optional<PeriodicBox>& before, double cell_size) {
  const BoxMotion in_space = MotionOf(parameters.box, before, frame.box, cell_size);
  if (!in_space.any) return in_space;
  const Axes axes = AxesOf(frame, parameters.plane);
  const auto along = [&](int axis) { return in_space.axes[static_cast<std::size_t>(axis)]; };
  return {.axes = {along(axes.first), along(axes.second), {}}, .any = true};
}

LatticePeriods PeriodsOf(const ReconstructionParameters& parameters, const Frame& frame,
                         double cell_size) {
  LatticePeriods periods;
  if (!frame.box) return periods;
  const Axes axes = AxesOf(frame, parameters.plane);
  const std::array<int, 2> in_plane{axes.first, axes.second};
  for (std::size_t k = 0; k < in_plane.size(); ++k) {
    const auto& axis = frame.box->axes[static_cast<std::size_t>(in_plane[k])];
    if (axis) periods.cells[k] = axis->length / cell_size;
  }
  return periods;
}

}  // namespace partiemc
