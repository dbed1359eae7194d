// Parses the flags of `partiemc replay`.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/cli/replay_flags.h"
#include "client/input/base/recorded_box.h"
#include "partiemc/parameters.h"

namespace partiemc::client {

/// The name of the attribute that selects particles: from --phases, else from the first --wall that
/// is an outline of particles. Empty without such a flag.
std::string PhaseAttributeOf(const ReplayFlags& flags);

/// Whether the caller must estimate the spacing before the stream opens, because surfaces and
/// slices require a given one. True for these with --spacing first-frame, or if both --spacing and
/// `recorded_spacing` are absent.
bool IsEstimatedInSpace(const ReplayFlags& flags, std::optional<double> recorded_spacing);

/// `spacing`: of the recording, or an estimate. Used without --spacing, and for surfaces and slices
/// with --spacing first-frame.
/// `recorded_box`: for --periodic without --box. Without any box the parameters have none.
/// Errors: INVALID_ARGUMENT, one line that names the flag.
absl::StatusOr<ReconstructionParameters> ParametersOf(
    const ReplayFlags& flags, std::optional<double> spacing,
    const std::optional<RecordedBox>& recorded_box = std::nullopt);

/// The plane of one --slice: x=C, y=C, z=C, or a point and a normal, six numbers. Empty for any
/// other text.
std::optional<SlicePlane> SliceOf(std::string_view text);

/// Frames per second of `--rate`; absent for "max". Errors: INVALID_ARGUMENT.
absl::StatusOr<std::optional<double>> RateOf(std::string_view text);

/// Absent unless the whole text is a positive, finite number.
std::optional<double> PositiveNumber(std::string_view text);

}  // namespace partiemc::client
