// A stream that goes on over one call after the other: what Stream is made of.
//
// Every frame is held from Send until a checkpoint covers it. After a loss a new call opens with
// the last checkpoint that has come, and gets every frame after it again, in order. Answers up to
// the last one that the caller has got are dropped. So each frame's answer is delivered once, and
// since results depend on checkpoint and frames alone, with the same bits.
//
//   streaming (call_) --lost--> StreamConnector --opened--> streaming
//       |                           +-- refused, or for too long: failed (failure_)
//       +-- everything is answered: end; what cannot be mended: failed
//
// The receiver's thread alone opens calls and replaces them; the sender only queues.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/resend_buffer.h"
#include "client/library/retry_policy.h"
#include "client/library/stream_call.h"
#include "client/library/stream_connector.h"
#include "partiemc/client/stream.h"
#include "wire/codec.h"
#include "wire/frame_rows.h"

namespace partiemc::client {

class ResumingStream final : public Stream {
 public:
  /// As Stream::Open.
  static absl::StatusOr<std::unique_ptr<ResumingStream>> Open(std::string_view address,
                                                              const StreamOptions& options);

  const StreamInfo& info() const override { return info_; }
  absl::StatusOr<std::uint64_t> Send(const Frame& frame, double time) override;
  absl::StatusOr<std::uint64_t> SendArrays(const ParticleArrays& particles, double time) override;
  absl::Status FinishSending() override;
  absl::StatusOr<Received> Receive(Event& event,
                                   std::optional<std::chrono::milliseconds> wait) override;
  std::optional<Reconnecting> reconnecting() const override;
  std::size_t InFlight() const override;
  void Cancel() override;

 private:
  using Clock = StreamCall::Clock;
  using Lock = StreamCall::Lock;
  using OptionalTime = std::optional<Clock::time_point>;

  ResumingStream(std::vector<std::string> addresses, const StreamOptions& options);

  // With the lock, which they may let go meanwhile. Of the receiver's thread:
  absl::Status OpenFirst(Lock& lock);
  absl::StatusOr<Received> Advance(Lock& lock, Event& event, OptionalTime until);
  absl::StatusOr<bool> GoOn(Lock& lock, OptionalTime until);
  absl::Status CheckReplica(const StreamConnector::Opened& opened, const StreamInfo& info) const;
  void Adopt(Lock& lock, StreamConnector::Opened opened, std::size_t window);
  absl::StatusOr<bool> Deliver(Lock& lock, StreamCall::Response response, Event& event);
  void Remember(const v1::ReconstructResponse& answer);
  absl::StatusOr<bool> EndCall(Lock& lock);
  void LoseCall(Lock& lock, std::unique_ptr<StreamCall> call, const Loss& loss);
  OptionalTime AnswerDue() const;
  // Of any thread:
  absl::StatusOr<std::uint64_t> SendRows(const wire::FrameRows& frame, std::size_t particles);
  absl::Status Fail(Lock& lock, absl::Status failure);
  absl::Status WaitToSend(Lock& lock, Clock::time_point start, std::uint64_t bytes);
  bool MaySend(std::uint64_t bytes) const;
  absl::Status TooSlowToSend() const;
  std::optional<absl::Status> FatalEnd() const;
  bool all_answered() const { return next_answer_ == resend_.end(); }
  bool sends_other_part() const { return options_.parts.part > 0; }
  std::uint64_t FirstToSend(const StreamConnector::Opened& opened) const;

  const StreamOptions options_;
  // Fixed once open:
  StreamInfo info_;
  bool survives_ = false;  // Its calls.

  mutable Monitor monitor_;
  StreamConnector connector_;
  wire::ReconstructedFrame scratch_;  // Of the receiver's thread alone.
  bool owes_event_ = false;           // Likewise: a reconnection is to be told.

  // Guarded by the monitor:
  std::unique_ptr<StreamCall> call_;  // Null while the connector looks for another.
  ResendBuffer resend_{1};
  std::string token_, checkpoint_;
  std::uint64_t checkpoint_next_ = 1;         // The number that the checkpoint expects.
  std::uint64_t next_answer_ = 1;             // To be delivered.
  std::uint64_t next_of_call_ = 1;            // To be answered by call_.
  std::uint64_t over_below_ = 0;              // Parts that call_ has found to be over.
  Clock::time_point due_since_, adopted_at_;  // What the deadline counts from.
  bool finished_ = false;                     // FinishSending was called.
  absl::Status failure_;                      // What the stream has ended for.
};

}  // namespace partiemc::client
