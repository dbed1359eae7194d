// What a client needs to go on with a stream elsewhere: opaque to it, untrusted when it comes back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"
#include "server/security/checkpoint_keys.h"

namespace partiemc::server {

/// The reasons for which a checkpoint is refused (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonCorruptCheckpoint = "CORRUPT_CHECKPOINT";
inline constexpr std::string_view kReasonCheckpointMismatch = "CHECKPOINT_MISMATCH";
inline constexpr std::string_view kReasonCheckpointSignature = "CHECKPOINT_SIGNATURE";

/// What a stream keeps through all its resumes, beside its parameters. Labels and outputs count by
/// a number that is another for others.
struct StreamTerms {
  std::string lineage = {};  ///< LineageOf its token.
  std::string name = {};     ///< As resolved.
  std::uint64_t labels = 0;  ///< FingerprintOf them.
  std::uint32_t outputs = 0;
  std::uint32_t checkpoint_interval = 0;
};

std::uint64_t FingerprintOf(const std::map<std::string, std::string>& labels);

/// A stream between two frames.
struct Checkpoint {
  std::uint64_t next_sequence = 1;
  std::string name = {};  ///< Of the stream.
  State state = {};
};

/// The most bytes that a checkpoint has beside those of the state.
inline constexpr std::size_t kMaxCheckpointOverhead = 300;

/// Bytes with a version and a checksum, bound to the method's version, to `parameters`, as
/// resolved, and to `terms`: for others the same frames would be answered otherwise. Signed if
/// there are `keys`. The same on every machine.
/// Requires: a lineage and a name that a stream can have.
std::string Serialize(std::uint64_t next_sequence, const State& state,
                      const ReconstructionParameters& parameters, const StreamTerms& terms,
                      const CheckpointKeys* keys);

/// The checkpoint that Serialize wrote for the same parameters and terms; from no bytes at all,
/// which are bound to nothing, the beginning of a stream. `terms.name` may be empty: then the name
/// is the checkpoint's.
/// With `keys` nothing of it is looked at before its signature holds. Without, a signature counts
/// for nothing, and a checksum is none: whoever makes up a checkpoint gets the stream that he
/// described, and every part of it has been checked.
/// Errors, each with a Violation: FAILED_PRECONDITION (CHECKPOINT_SIGNATURE; CHECKPOINT_MISMATCH
/// for another version or method, stream, parameters or terms, the value says which);
/// INVALID_ARGUMENT (CORRUPT_CHECKPOINT, CORRUPT_STATE).
absl::StatusOr<Checkpoint> ParseCheckpoint(std::string_view bytes,
                                           const ReconstructionParameters& parameters,
                                           const StreamTerms& terms, const CheckpointKeys* keys);

}  // namespace partiemc::server
