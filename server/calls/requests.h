// Requests from bytes, within bounds.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace partiemc::server {

/// Far above what a request for information takes, or one of a watcher; so small that nobody fills
/// memory with them.
inline constexpr std::size_t kMaxSmallRequestBytes = 4096;

/// "partiemc.v1.ReconstructionService".
const std::string& ServiceName();

/// Parses a request, and gives its bytes up. Errors: INVALID_ARGUMENT (MALFORMED) for more than
/// `max_bytes` or wire::kMaxFields fields, or for what is no such message.
absl::Status ParseRequest(grpc::ByteBuffer& bytes, std::uint64_t max_bytes,
                          google::protobuf::Message& request);

}  // namespace partiemc::server
