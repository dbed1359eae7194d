// The messages of streams whose frames come in parts: what they mean to the call of part 0, which
// has the session, and to those of the others.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/stream/frame_assembler.h"
#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "server/stream/stream_state_machine.h"

namespace partiemc::server {

/// Parses a request that holds a frame into `request`, whose buffers are used again. What is not
/// known of it is passed over, and kept nowhere. Errors: MALFORMED, OUT_OF_MEMORY of `field`; the
/// frame then has its `sequence` if that can be read, else 0.
absl::Status ParseFrame(grpc::ByteBuffer& bytes, v1::ReconstructRequest& request,
                        const std::string& field = "frame");

/// Whether what `open` says of parts can be. Errors: INVALID_ARGUMENT (OUT_OF_RANGE).
absl::Status CheckParts(const v1::OpenStream& open, const ServerLimits& limits);

/// Of the call of part 0. Not thread-safe as a whole, like StreamMessages.
class PartZero {
 public:
  /// Frames come as `open` says, the first with this number. Requires: CheckParts, and parts > 0.
  PartZero(const v1::OpenStream& open, const ServerLimits& limits, std::uint64_t next_sequence);

  const std::shared_ptr<FrameAssembler>& assembler() const { return assembler_; }

  /// A frame was read into `slot`.
  void Came(std::size_t slot, grpc::ByteBuffer& request);
  /// As StreamHandler.
  bool MayAnswer(std::size_t slot) const;
  std::chrono::milliseconds LookEvery() const;

  /// The frame in `slot`, parsed into `request` already, with its other parts where it is the next
  /// one. Errors: PARTS_MISSING, MALFORMED, OUT_OF_MEMORY, those of JoinParts.
  absl::Status Join(std::size_t slot, std::span<const std::string> attributes,
                    v1::ReconstructRequest& request);

 private:
  struct Slot {
    std::optional<std::uint64_t> sequence;  // Nothing where it could not be read.
    FrameAssembler::Clock::time_point came;
  };

  const std::chrono::milliseconds timeout_;
  const std::shared_ptr<FrameAssembler> assembler_;
  std::vector<Slot> slots_;
};

/// Of the call of another part.
class OtherPart {
 public:
  OtherPart(JoinedPart joined, std::size_t window);

  const JoinedPart& joined() const { return joined_; }

  /// As PartZero.
  void Came(std::size_t slot, grpc::ByteBuffer& request);
  bool MayAnswer(std::size_t slot) const;
  std::chrono::milliseconds LookEvery() const;
  /// The server has no room for the part in `slot`: refuses it.
  void Refuse(std::size_t slot, absl::Status why);
  /// The answer to the part in `slot`; leaves its refusal, if it was one, in `refusal`.
  v1::ReconstructResponse Answer(std::size_t slot, absl::Status& refusal);

 private:
  struct Slot {
    std::uint64_t sequence = 0;
    absl::Status refusal;
  };

  const JoinedPart joined_;
  std::vector<Slot> slots_;
};

}  // namespace partiemc::server
