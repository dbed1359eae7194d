// Frames as a stream sends them.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/frame_stream.h"
#include "partiemc/frame.h"

namespace partiemc::client {

/// Errors: RESOURCE_EXHAUSTED with a Violation for more particles than the server takes.
absl::Status CheckParticleCount(const Frame& frame, const StreamLimits& limits);

/// `frame` at `time` as a request. Copies each array once.
/// Errors: RESOURCE_EXHAUSTED with a Violation for more bytes than the server takes.
absl::StatusOr<grpc::ByteBuffer> EncodeFrameRequest(const Frame& frame, double time,
                                                    std::uint64_t sequence,
                                                    const StreamLimits& limits);

}  // namespace partiemc::client
