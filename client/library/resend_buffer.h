// Frames of a stream since its last checkpoint, held for resending.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <deque>

namespace partiemc::client {

/// Serialised frames in the order of their sequence numbers, without gaps. Shares their bytes with
/// gRPC. Not thread-safe.
class ResendBuffer {
 public:
  /// `first` is the sequence number of the frame that is added first.
  explicit ResendBuffer(std::uint64_t first) : first_(first) {}

  /// Adds the frame with the sequence number end().
  void Add(grpc::ByteBuffer request);
  /// Drops the frames below `sequence`.
  void DropBelow(std::uint64_t sequence);

  /// Requires: begin() <= sequence < end().
  const grpc::ByteBuffer& at(std::uint64_t sequence) const { return requests_[sequence - first_]; }
  std::uint64_t begin() const { return first_; }
  std::uint64_t end() const { return first_ + requests_.size(); }
  std::uint64_t bytes() const { return bytes_; }

 private:
  std::uint64_t first_;
  std::uint64_t bytes_ = 0;
  std::deque<grpc::ByteBuffer> requests_;
};

}  // namespace partiemc::client
