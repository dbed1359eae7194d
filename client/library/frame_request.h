// Encodes frames as requests and checks them against the server's limits.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/frame_stream.h"
#include "wire/frame_rows.h"

namespace partiemc::client {

/// Errors: RESOURCE_EXHAUSTED with a Violation if there are more particles than the server allows.
absl::Status CheckParticleCount(std::size_t particles, const StreamLimits& limits);

/// Encodes `frame` as a request. Copies each array once. Errors: RESOURCE_EXHAUSTED with a
/// Violation if the request has more bytes than the server allows.
absl::StatusOr<grpc::ByteBuffer> EncodeFrameRequest(const wire::FrameRows& frame,
                                                    std::uint64_t sequence,
                                                    const StreamLimits& limits);

/// The error for a frame that got no slot in the window within `timeout`: DEADLINE_EXCEEDED with a
/// Violation.
absl::Status SendTimeout(std::chrono::milliseconds timeout);

}  // namespace partiemc::client
