// Joins the parts of a frame, sent by several processes.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::server {

/// The reason if parts do not fit together (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonPartMismatch = "PART_MISMATCH";

/// Appends the particles of `parts` to `frame`, which is part 0. With ids, the particles are sorted
/// by id, so the result does not depend on their distribution over parts; otherwise they stay in
/// the order of the parts. Keeps the scalars in `attributes` only. Consumes the parts'
/// arrays. `frame` keeps its sequence and its time. Formats of parts without particles are ignored.
/// Additional memory: at most the size of the arrays, and 8 bytes a particle.
///
/// Errors, INVALID_ARGUMENT with a Violation of a field of parts[k], after which `frame` is
/// invalid: BYTE_COUNT, UNSUPPORTED (wire::DecodeFrame); PART_MISMATCH if parts differ in position
/// format, time (0: not set), optional arrays, or the components of a scalar.
absl::Status JoinParts(std::span<v1::ParticleFrame> parts, std::span<const std::string> attributes,
                       v1::ParticleFrame& frame);

}  // namespace partiemc::server
