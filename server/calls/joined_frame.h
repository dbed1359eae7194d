// One frame out of the parts that several processes have sent.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::server {

/// The reason for which parts make no frame (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonPartMismatch = "PART_MISMATCH";

/// Adds the particles of `parts` behind those of `frame`, which is part 0: by their ids, ascending,
/// where they have ids, else part by part and as they stand in each. So the frame depends on the
/// particles alone, and with ids not even on who sends which. Of scalars only those are kept that
/// `attributes` names. Gives up the parts' arrays. Takes at most as much memory as the arrays, and
/// 8 bytes a particle, beside them.
///
/// Parts without particles say nothing: their formats do not count. `frame` keeps its sequence and
/// its time.
/// Errors, INVALID_ARGUMENT with a Violation of a field of parts[k], after which `frame` is of no
/// use: those of wire::DecodeFrame (BYTE_COUNT, UNSUPPORTED); PART_MISMATCH where parts differ in
/// their position format, time (0: not told), which optional arrays they have, or the components
/// of a scalar.
absl::Status JoinParts(std::span<v1::ParticleFrame> parts, std::span<const std::string> attributes,
                       v1::ParticleFrame& frame);

}  // namespace partiemc::server
