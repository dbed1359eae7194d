// A message that comes in piece by piece.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace partiemc::server {

/// Takes memory as the message comes, whatever its sender has announced: at most about as much as
/// has come, and 16 KiB.
class GatheredMessage {
 public:
  /// Bytes that have come.
  std::size_t size() const { return size_; }

  /// Where the next bytes go; never empty. `expected`: how many may still come, or a guess.
  std::span<std::uint8_t> Room(std::size_t expected);
  /// So many were written to Room().
  void Filled(std::size_t bytes);

  /// The message, whose memory is handed over; the next one begins.
  grpc::ByteBuffer Take();
  void Clear();

 private:
  void CloseChunk();

  std::vector<grpc::Slice> whole_;
  grpc::Slice chunk_;  // The last; its first bytes have come.
  std::size_t filled_ = 0, size_ = 0;
};

}  // namespace partiemc::server
