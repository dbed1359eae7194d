// Frames in parts: a layer between a stream's call and its messages.
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
#include "wire/codec.h"

namespace partiemc::server {

/// Parses a request with a frame into `request`, whose buffers are reused; drops unknown fields.
/// Errors: MALFORMED, OUT_OF_MEMORY of `field`; the frame then has its `sequence` if that can be
/// read, else 0.
absl::Status ParseFrame(grpc::ByteBuffer& bytes, v1::ReconstructRequest& request,
                        const std::string& field = "frame");

/// Checks the fields of `open` about parts. Errors: INVALID_ARGUMENT (OUT_OF_RANGE).
absl::Status CheckParts(const v1::OpenStream& open, const ServerLimits& limits);

/// How the frames of a stream arrive: whole, each in one message. Streams in parts add a layer. One
/// slot for each frame in flight. Not thread-safe: relies on the rules of StreamStateMachine.
class FrameArrival {
 public:
  virtual ~FrameArrival() = default;

  /// A frame was read into `slot`.
  virtual void OnFrame(std::size_t /*slot*/, grpc::ByteBuffer& /*request*/) {}
  // As StreamHandler:
  virtual bool MayAnswer(std::size_t /*slot*/) const { return true; }
  virtual std::chrono::milliseconds LookEvery() const { return std::chrono::milliseconds(0); }
  virtual std::uint64_t ComputedBytes(std::uint64_t bytes) const { return bytes; }
  virtual bool Drop(std::size_t /*slot*/, const absl::Status& /*why*/) { return false; }
  /// Null without parts.
  virtual std::shared_ptr<FrameAssembler> assembler() const { return nullptr; }

  /// Adds the other parts to the frame in `slot`, parsed into `request`. `bytes` is its message;
  /// with echo it becomes that of the whole frame.
  virtual absl::Status Complete(std::size_t /*slot*/, const wire::Outputs& /*outputs*/,
                                v1::ReconstructRequest& /*request*/, grpc::ByteBuffer& /*bytes*/) {
    return absl::OkStatus();
  }
  /// The response to a frame that this call does not compute; leaves its refusal, if it is one, in
  /// `refusal`.
  virtual std::optional<v1::ReconstructResponse> Respond(std::size_t /*slot*/,
                                                         absl::Status& /*refusal*/) {
    return std::nullopt;
  }
  /// A frame has its response.
  virtual void OnAnswered(std::uint64_t /*next_sequence*/, bool /*with_checkpoint*/) {}
  virtual void End(const absl::Status& /*status*/) {}
  /// The part that this call sends of another call's stream.
  virtual const JoinedPart* joined() const { return nullptr; }
};

/// The call of part 0, which has the session.
class PartZero final : public FrameArrival {
 public:
  /// Requires: CheckParts, and parts > 0. The first frame has this number.
  PartZero(const v1::OpenStream& open, const ServerLimits& limits, std::uint64_t next_sequence);

  void OnFrame(std::size_t slot, grpc::ByteBuffer& request) override;
  bool MayAnswer(std::size_t slot) const override;
  std::chrono::milliseconds LookEvery() const override;
  std::uint64_t ComputedBytes(std::uint64_t bytes) const override;
  std::shared_ptr<FrameAssembler> assembler() const override { return assembler_; }
  /// Errors: PARTS_MISSING, MALFORMED, OUT_OF_MEMORY, those of JoinParts.
  absl::Status Complete(std::size_t slot, const wire::Outputs& outputs,
                        v1::ReconstructRequest& request, grpc::ByteBuffer& bytes) override;
  void OnAnswered(std::uint64_t next_sequence, bool with_checkpoint) override;
  void End(const absl::Status& status) override { assembler_->End(status); }

 private:
  struct Slot {
    std::optional<std::uint64_t> sequence;  // Absent if it could not be read.
    FrameAssembler::Clock::time_point came;
  };

  absl::Status Join(std::span<const std::string> attributes, v1::ReconstructRequest& request);

  const std::chrono::milliseconds timeout_;
  const std::shared_ptr<FrameAssembler> assembler_;
  std::vector<Slot> slots_;
};

/// The call of another part.
class OtherPart final : public FrameArrival {
 public:
  OtherPart(JoinedPart joined, std::size_t window);

  void OnFrame(std::size_t slot, grpc::ByteBuffer& request) override;
  bool MayAnswer(std::size_t slot) const override;
  std::chrono::milliseconds LookEvery() const override;
  std::uint64_t ComputedBytes(std::uint64_t /*bytes*/) const override { return 0; }
  bool Drop(std::size_t slot, const absl::Status& why) override;
  std::shared_ptr<FrameAssembler> assembler() const override { return joined_.assembler; }
  std::optional<v1::ReconstructResponse> Respond(std::size_t slot, absl::Status& refusal) override;
  void End(const absl::Status& /*status*/) override { joined_.assembler->Leave(joined_.seat); }
  const JoinedPart* joined() const override { return &joined_; }

 private:
  struct Slot {
    std::uint64_t sequence = 0;
    absl::Status refusal;
  };

  const JoinedPart joined_;
  std::vector<Slot> slots_;
};

}  // namespace partiemc::server
