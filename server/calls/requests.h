// Parses requests within limits.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace partiemc::server {

/// Limit for requests for information and requests of watchers: far above their size, and too small
/// to exhaust the memory.
inline constexpr std::size_t kMaxSmallRequestBytes = 4096;

/// "partiemc.v1.ReconstructionService".
const std::string& ServiceName();

/// Parses a request and clears its bytes. Errors: INVALID_ARGUMENT (MALFORMED) for more than
/// `max_bytes`, more than wire::kMaxFields fields, or another message.
absl::Status ParseRequest(grpc::ByteBuffer& bytes, std::uint64_t max_bytes,
                          google::protobuf::Message& request);

}  // namespace partiemc::server
