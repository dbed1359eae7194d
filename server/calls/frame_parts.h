// Prepares the frames of a stream for its session, whether they arrive whole or in parts.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/stream/frame_assembler.h"
#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "wire/codec.h"

namespace partiemc::server {

/// Parses a request with a frame into `request` and reuses its buffers; drops unknown fields.
/// Errors: MALFORMED (names `field`), OUT_OF_MEMORY (always names "frame"). After an error, only
/// the `sequence` of the frame in `request` is valid; it is 0 if it cannot be read.
absl::Status ParseFrame(grpc::ByteBuffer& bytes, v1::ReconstructRequest& request,
                        const std::string& field = "frame");

/// Checks the fields of `open` that concern parts. Errors: INVALID_ARGUMENT (OUT_OF_RANGE).
absl::Status CheckParts(const v1::OpenStream& open, const ServerLimits& limits);

/// The steps of ReconstructCall that differ for frames in parts. This base class is for frames that
/// arrive whole, each in one message; its steps do nothing. There is one slot for each frame in
/// flight. The thread rules of StreamHandler apply. OnFrame is called at the end of a read.
class FrameArrival {
 public:
  explicit FrameArrival(std::shared_ptr<FrameAssembler> assembler = nullptr)
      : assembler_(std::move(assembler)) {}
  virtual ~FrameArrival() = default;

  /// The assembler that the calls of all parts share; null if frames arrive whole.
  const std::shared_ptr<FrameAssembler>& assembler() const { return assembler_; }
  /// As StreamHandler::LookEvery.
  std::chrono::milliseconds LookEvery() const;

  /// A frame was read into `slot`.
  virtual void OnFrame(std::size_t /*slot*/, grpc::ByteBuffer& /*request*/) {}
  // As StreamHandler:
  virtual bool MayAnswer(std::size_t /*slot*/) const { return true; }
  virtual std::uint64_t ComputedBytes(std::uint64_t bytes) const { return bytes; }
  virtual bool DropFrame(std::size_t /*slot*/, const absl::Status& /*why*/) { return false; }

  /// Completes the frame in `slot` from its parts: `request` is its parsed message, `bytes` its
  /// serialised message. If the client has requested an echo, `bytes` becomes the message of the
  /// complete frame.
  virtual absl::Status Complete(std::size_t /*slot*/, const wire::Outputs& /*outputs*/,
                                v1::ReconstructRequest& /*request*/, grpc::ByteBuffer& /*bytes*/) {
    return absl::OkStatus();
  }
  /// Returns the response to the part in `slot` if this call sends parts of another call's stream,
  /// otherwise nothing.
  virtual std::optional<v1::ReconstructResponse> RespondToPart(std::size_t /*slot*/) {
    return std::nullopt;
  }
  /// The responses to all frames below `next_sequence` are made. `with_checkpoint`: the last one
  /// contains a checkpoint.
  virtual void OnAnswered(std::uint64_t /*next_sequence*/, bool /*with_checkpoint*/) {}
  /// The call has ended.
  virtual void End(const absl::Status& /*status*/) {}

  /// Describes the part of another call's stream that this call sends; null if this call has its
  /// own stream.
  virtual const JoinedPart* joined() const { return nullptr; }

 private:
  const std::shared_ptr<FrameAssembler> assembler_;
};

/// The steps for the call of part 0, which owns the session of the stream.
class PartZero final : public FrameArrival {
 public:
  /// `next_sequence`: number of the first frame. Requires: CheckParts was OK; `open` has parts > 0.
  PartZero(const v1::OpenStream& open, const ServerLimits& limits, std::uint64_t next_sequence);

  void OnFrame(std::size_t slot, grpc::ByteBuffer& request) override;
  bool MayAnswer(std::size_t slot) const override;
  std::uint64_t ComputedBytes(std::uint64_t bytes) const override;
  /// Joins the parts only if the frame is the next one; the session refuses any other frame.
  /// Errors: PARTS_MISSING, MALFORMED, OUT_OF_MEMORY, and the errors of JoinParts.
  absl::Status Complete(std::size_t slot, const wire::Outputs& outputs,
                        v1::ReconstructRequest& request, grpc::ByteBuffer& bytes) override;
  void OnAnswered(std::uint64_t next_sequence, bool with_checkpoint) override;
  void End(const absl::Status& status) override { assembler()->End(status); }

 private:
  struct Slot {
    std::optional<std::uint64_t> sequence;  // Absent if it could not be read.
    FrameAssembler::Clock::time_point came;
  };

  absl::Status Join(std::span<const std::string> attributes, v1::ReconstructRequest& request);

  std::vector<Slot> slots_;
};

/// The steps for the call of another part.
class OtherPart final : public FrameArrival {
 public:
  OtherPart(JoinedPart joined, std::size_t window);

  void OnFrame(std::size_t slot, grpc::ByteBuffer& request) override;
  bool MayAnswer(std::size_t slot) const override;
  std::uint64_t ComputedBytes(std::uint64_t /*bytes*/) const override { return 0; }
  bool DropFrame(std::size_t slot, const absl::Status& why) override;
  std::optional<v1::ReconstructResponse> RespondToPart(std::size_t slot) override;
  void End(const absl::Status& /*status*/) override { assembler()->Leave(joined_.seat); }
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
