// Creates the checkpoints of a stream, and resumes streams from checkpoints.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/calls/server_context.h"
#include "server/stream/checkpoint.h"
#include "server/stream/session.h"
#include "wire/codec.h"

namespace partiemc::server {

/// The reason of RESOURCE_EXHAUSTED if a checkpoint is too large (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonCheckpointBytes = "CHECKPOINT_BYTES";

/// Returns the properties in `open` that a later resume must not change, for a stream with this
/// stream token. The name may still be empty.
StreamTerms TermsOf(const v1::OpenStream& open, const wire::Outputs& outputs,
                    std::string_view token);

/// Continues the stream of the checkpoint in `resume` with the new `session`, and sets the name in
/// `terms` to the checkpoint's name. Errors, each with a Violation: INVALID_ARGUMENT
/// (STREAM_TOKEN), RESOURCE_EXHAUSTED (CHECKPOINT_BYTES, before the checkpoint is read), and the
/// errors of ParseCheckpoint.
absl::Status Resume(const v1::ResumeStream& resume, const ServerContext& context, Session& session,
                    StreamTerms& terms);

/// Returns the checkpoint for the response to a frame; `sequence` is the number that `session`
/// expected before this frame. Empty if no checkpoint is due at this number, if the frame did not
/// use up the number, or if the checkpoint could exceed its size limit.
std::string CheckpointAfter(std::uint64_t sequence, const Session& session,
                            const StreamTerms& terms, const ServerContext& context);

}  // namespace partiemc::server
