// Joins the parts of a frame, which several processes have sent.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::server {

/// The reason of the error if the parts of a frame do not fit together (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonPartMismatch = "PART_MISMATCH";

/// Appends the particles of `parts` (parts 1, 2, ...) to `frame` (part 0). If particles have ids,
/// they are sorted by id, so the result does not depend on their distribution over the parts.
/// Otherwise they stay in the order of the parts. Drops scalars that are not in `attributes`.
/// Consumes the arrays of the parts. `frame` keeps its sequence number, its time and its box. Parts
/// without particles may have any format. Additional memory: at most the size of the arrays, and 8
/// bytes per particle.
///
/// Errors: INVALID_ARGUMENT with a Violation whose field is "parts[k].FIELD" for part number k;
/// `frame` is invalid afterwards. BYTE_COUNT, UNSUPPORTED (see wire::DecodeFrame); PART_MISMATCH if
/// parts differ in position format, optional arrays, components of a scalar, time or box. The time
/// of parts 1, 2, ... may be 0, and their box may be absent.
absl::Status JoinParts(std::span<v1::ParticleFrame> parts, std::span<const std::string> attributes,
                       v1::ParticleFrame& frame);

}  // namespace partiemc::server
