// Collects a message that arrives in pieces.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace partiemc::server {

/// Collects the bytes of a message as they arrive. Allocates at most twice the received bytes plus
/// 16 KiB, whatever length the client announces.
class GatheredMessage {
 public:
  /// Received bytes.
  std::size_t size() const { return size_; }

  /// Returns space for the next bytes; never empty. `expected`: an estimate of the bytes that will
  /// follow.
  std::span<std::uint8_t> Room(std::size_t expected);
  /// Records that `bytes` were written to Room().
  void Filled(std::size_t bytes);

  /// Returns the message and starts the next one.
  grpc::ByteBuffer Take();
  void Clear();

 private:
  void CloseChunk();

  std::vector<grpc::Slice> whole_;
  grpc::Slice chunk_;  // The current slice; its first `filled_` bytes are set.
  std::size_t filled_ = 0, size_ = 0;
};

}  // namespace partiemc::server
