// What a client needs to go on with a stream elsewhere: opaque to it, untrusted when it comes back.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"

namespace partiemc::server {

/// The reasons for which a checkpoint is refused (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonCorruptCheckpoint = "CORRUPT_CHECKPOINT";
inline constexpr std::string_view kReasonCheckpointMismatch = "CHECKPOINT_MISMATCH";

/// A stream between two frames.
struct Checkpoint {
  std::uint64_t next_sequence = 1;
  State state;
};

/// Bytes with a version and a checksum, bound to the method's version and to `parameters`, as
/// resolved: under others the same frames would give other digests. The same on every machine.
/// Size: 36 bytes and those of the state.
std::string Serialize(const Checkpoint& checkpoint, const ReconstructionParameters& parameters);

/// The checkpoint that Serialize wrote; from no bytes at all the beginning of a stream. A checksum
/// is no signature: whoever makes up a checkpoint gets the stream that he described, and every part
/// of it has been checked. Errors, each with a Violation: INVALID_ARGUMENT (CORRUPT_CHECKPOINT,
/// CORRUPT_STATE); FAILED_PRECONDITION (CHECKPOINT_MISMATCH) for another method or other
/// parameters.
absl::StatusOr<Checkpoint> ParseCheckpoint(std::string_view bytes,
                                           const ReconstructionParameters& parameters);

}  // namespace partiemc::server
