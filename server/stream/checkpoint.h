// Checkpoints: the bytes with which a client resumes a stream, on this or another server. The
// client does not interpret them; the server treats them as untrusted input.
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

/// Reasons of refused checkpoints (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonCorruptCheckpoint = "CORRUPT_CHECKPOINT";
inline constexpr std::string_view kReasonCheckpointMismatch = "CHECKPOINT_MISMATCH";
inline constexpr std::string_view kReasonCheckpointSignature = "CHECKPOINT_SIGNATURE";

/// Properties of a stream that must be the same when a client resumes it, in addition to the
/// parameters.
struct StreamTerms {
  std::string lineage = {};               ///< LineageOf the stream token.
  std::string name = {};                  ///< The stream's name; generated if the client gave none.
  std::uint64_t labels = 0;               ///< FingerprintOf the labels.
  std::uint32_t outputs = 0;              ///< A number that identifies the requested outputs.
  std::uint32_t checkpoint_interval = 0;  ///< In frames.
};

std::uint64_t FingerprintOf(const std::map<std::string, std::string>& labels);

/// The contents of a checkpoint: a stream between two frames.
struct Checkpoint {
  std::uint64_t next_sequence = 1;
  std::string name = {};  ///< Name of the stream.
  State state = {};
};

/// Maximum size of a checkpoint without its state, in bytes.
inline constexpr std::size_t kMaxCheckpointOverhead = 300;

/// Serialises a checkpoint, with a version and a checksum. The checkpoint is valid only for this
/// version of the method, for `parameters` (with defaults resolved) and for `terms`, so a client
/// can continue only the same stream. It is signed if `keys` is not null. The bytes do not depend
/// on the machine.
/// Requires: `terms` has a valid lineage and name.
std::string Serialize(std::uint64_t next_sequence, const State& state,
                      const ReconstructionParameters& parameters, const StreamTerms& terms,
                      const CheckpointKeys* keys);

/// Parses a checkpoint that Serialize wrote for the same parameters and terms. If `bytes` is empty,
/// returns the start of a new stream. If `terms.name` is empty, accepts a checkpoint with any name.
///
/// Security: with `keys`, the signature is checked before anything else is read. Without `keys`, a
/// signature is ignored, and the checksum only detects accidental damage. A client can then forge a
/// checkpoint. Every part of the checkpoint is validated, so a forgery affects only this client's
/// own stream.
///
/// Errors, each with a Violation:
/// - FAILED_PRECONDITION (CHECKPOINT_SIGNATURE).
/// - FAILED_PRECONDITION (CHECKPOINT_MISMATCH): another version, method, stream, parameters or
///   terms. The violation's value names the difference.
/// - INVALID_ARGUMENT (CORRUPT_CHECKPOINT, CORRUPT_STATE).
absl::StatusOr<Checkpoint> ParseCheckpoint(std::string_view bytes,
                                           const ReconstructionParameters& parameters,
                                           const StreamTerms& terms, const CheckpointKeys* keys);

}  // namespace partiemc::server
