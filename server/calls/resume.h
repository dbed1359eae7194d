// Writes the checkpoints of a stream, and resumes streams from them.
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

/// The reason of RESOURCE_EXHAUSTED for a checkpoint that is too large (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonCheckpointBytes = "CHECKPOINT_BYTES";

/// The terms that a stream with this token keeps from `open`. The name may still be empty.
StreamTerms TermsOf(const v1::OpenStream& open, const wire::Outputs& outputs,
                    std::string_view token);

/// Continues the new `session` from the checkpoint in `resume`, and sets the name in `terms` to the
/// checkpoint's. Errors, each with a Violation: INVALID_ARGUMENT (STREAM_TOKEN), RESOURCE_EXHAUSTED
/// (CHECKPOINT_BYTES, before the checkpoint is read), and the errors of ParseCheckpoint.
absl::Status Resume(const v1::ResumeStream& resume, const ServerContext& context, Session& session,
                    StreamTerms& terms);

/// The checkpoint for the response to a frame, before which `session` expected number `sequence`.
/// Empty if the stream's interval has none here, if the frame used no number, or if the checkpoint
/// could exceed the limit.
std::string CheckpointAfter(std::uint64_t sequence, const Session& session,
                            const StreamTerms& terms, const ServerContext& context);

}  // namespace partiemc::server
