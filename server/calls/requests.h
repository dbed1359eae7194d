// Parses requests within limits.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace partiemc::server {

/// Size limit for requests for information and for requests of watchers. It is far above the size
/// of real requests, and too small to exhaust the memory.
inline constexpr std::size_t kMaxSmallRequestBytes = 4096;

/// "partiemc.v1.ReconstructionService".
const std::string& ServiceName();

/// Parses a request and clears its bytes. Errors: INVALID_ARGUMENT (MALFORMED) if it has more than
/// `max_bytes` or more than wire::kMaxFields fields, or if it is not a message of this type.
absl::Status ParseRequest(grpc::ByteBuffer& bytes, std::uint64_t max_bytes,
                          google::protobuf::Message& request);

}  // namespace partiemc::server
