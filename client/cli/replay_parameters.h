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

/// The attribute that --phases names; empty without a name.
std::string PhaseAttributeOf(const ReplayFlags& flags);

/// Whether the spacing is estimated before the stream opens: surfaces and slices require one.
bool IsEstimatedInSpace(const ReplayFlags& flags, std::optional<double> recorded_spacing);

/// Uses `spacing` if the flags give none: that of the recording, or the estimate. Uses
/// `recorded_box` for --periodic without --box. If both boxes are absent, the parameters have none.
/// Errors: INVALID_ARGUMENT, one line that names the flag.
absl::StatusOr<ReconstructionParameters> ParametersOf(
    const ReplayFlags& flags, std::optional<double> spacing,
    const std::optional<RecordedBox>& recorded_box = std::nullopt);

/// Frames per second of `--rate`; absent for "max". Errors: INVALID_ARGUMENT.
absl::StatusOr<std::optional<double>> RateOf(std::string_view text);

/// A positive, finite number and nothing else.
std::optional<double> PositiveNumber(std::string_view text);

}  // namespace partiemc::client
