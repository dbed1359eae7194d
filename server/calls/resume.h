// How a stream is resumed, and what it gives its producer for that: checkpoints between messages,
// sessions and the server's keys and limits.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/security/checkpoint_keys.h"
#include "server/stream/checkpoint.h"
#include "server/stream/limits.h"
#include "server/stream/session.h"
#include "wire/codec.h"

namespace partiemc::server {

/// The reason of RESOURCE_EXHAUSTED for a checkpoint that is too large (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonCheckpointBytes = "CHECKPOINT_BYTES";

/// What of `open` a stream with this token keeps. Its name may still be empty.
StreamTerms TermsOf(const v1::OpenStream& open, const wire::Outputs& outputs,
                    std::string_view token);

/// Has `session`, just opened, go on where `resume` says; a name that `terms` leave open becomes
/// that of the checkpoint, if there is one.
/// Errors, each with a Violation: INVALID_ARGUMENT (STREAM_TOKEN), RESOURCE_EXHAUSTED
/// (CHECKPOINT_BYTES, before anything of it is looked at), those of ParseCheckpoint.
absl::Status Resume(const v1::ResumeStream& resume, const ServerLimits& limits,
                    const CurrentCheckpointKeys& keys, Session& session, StreamTerms& terms);

/// The checkpoint that belongs to the answer of the frame for which `session` expected number
/// `sequence`; empty where the stream's interval has none, where the frame used up no number, and
/// where it might be larger than a server takes.
std::string CheckpointAfter(std::uint64_t sequence, const Session& session,
                            const StreamTerms& terms, const ServerLimits& limits,
                            const CurrentCheckpointKeys& keys);

}  // namespace partiemc::server
