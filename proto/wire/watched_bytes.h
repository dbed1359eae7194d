// A result as watchers get it: the bytes that were serialised for its producer, shared by all
// messages that carry them.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::wire {

/// Immutable but for EchoParticles, and cheap to copy: slices are counted references.
class WatchedBytes {
 public:
  /// The frame in `response`, which ToBytes made of a ReconstructResponse, all of it and nothing
  /// else: what stands beside it, its checkpoint, is between the producer and the server. Shares
  /// the memory of `response`.
  /// Requires: a frame, without particles.
  explicit WatchedBytes(grpc::ByteBuffer& response);

  /// A serialised ReconstructedFrame, which nobody has looked at.
  explicit WatchedBytes(const std::string& frame) { AppendOwn(frame); }

  /// Adds positions, ids, volumes and velocities of the frame in `request`, the bytes of a
  /// ReconstructRequest that was parsed into `frame`, by sharing their memory.
  void EchoParticles(grpc::ByteBuffer& request, const v1::ParticleFrame& frame);

  /// Of the serialised ReconstructedFrame.
  std::size_t size() const { return size_; }

  /// What keeping it keeps from being freed: pieces of memory that have other parts of an answer or
  /// a request, too.
  std::size_t memory() const { return memory_; }

  /// The serialised ReconstructedFrame, copied.
  std::string ToString() const;

  /// A serialised WatchStreamResponse with the frame and these fields of WatchedFrame. Copies
  /// nothing but a few bytes of its own.
  grpc::ByteBuffer ToResponse(std::uint64_t dropped, std::uint64_t oldest_sequence) const;

 private:
  void AppendOwn(const std::string& bytes);
  void Append(const grpc::ByteBuffer& whole, std::size_t offset, std::size_t length);

  std::vector<grpc::Slice> slices_;
  std::size_t size_ = 0, memory_ = 0;
  const std::uint8_t* counted_ = nullptr;  // The piece of memory that was counted last.
};

}  // namespace partiemc::wire
