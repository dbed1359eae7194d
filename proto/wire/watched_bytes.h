// A serialised result for watchers, who all share its bytes.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::wire {

/// Immutable except for EchoParticles. Copies share reference-counted slices.
class WatchedBytes {
 public:
  /// Takes the frame of `response`, but not the checkpoint, which only the producer receives.
  /// Shares the memory of `response`. Requires: `response` is ToBytes of a ReconstructResponse with
  /// a frame without particles.
  explicit WatchedBytes(grpc::ByteBuffer& response);

  /// Takes over a serialised ReconstructedFrame. Does not check it.
  explicit WatchedBytes(std::string frame) { AppendOwn(std::move(frame)); }

  /// Adds the format, positions, ids, volumes, velocities, scalars and box of `frame`; nothing if
  /// `frame` has no particles. Copies them: slices of the producer's request could keep much larger
  /// buffers of received bytes alive.
  void EchoParticles(const v1::ParticleFrame& frame);

  /// Size of the serialised ReconstructedFrame.
  std::size_t size() const { return size_; }

  /// Bytes of memory that this object keeps alive, including other parts of a shared response.
  std::size_t memory() const { return memory_; }

  /// The serialised ReconstructedFrame, copied.
  std::string ToString() const;

  /// A serialised WatchStreamResponse with the frame and these fields of WatchedFrame. Shares the
  /// memory of the frame.
  grpc::ByteBuffer ToResponse(std::uint64_t dropped, std::uint64_t oldest_sequence) const;

 private:
  void AppendOwn(std::string bytes);
  void Append(std::span<const grpc::Slice> whole, std::size_t offset, std::size_t length);

  std::vector<grpc::Slice> slices_;
  std::size_t size_ = 0, memory_ = 0;
  const std::uint8_t* counted_ = nullptr;  // Begin of the slice that memory_ counted last.
};

}  // namespace partiemc::wire
