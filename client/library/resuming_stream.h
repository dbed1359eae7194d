// Implements Stream over successive calls.
//
// Holds every frame from Send until a checkpoint covers it. After a loss it opens a new call with
// the last checkpoint and resends all later frames in order. It drops results that the caller has
// already received. Each result is therefore delivered once. Results depend only on checkpoint and
// frames, so their bits do not change.
//
//   streaming (call_) --lost--> StreamConnector --opened--> streaming
//       |                           +-- refused, or give_up_after passed: failed (failure_)
//       +-- all frames answered: end; permanent error: failed
//
// Only the receiver's thread opens and replaces calls; the sender only queues.
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

  // Require the lock and may release it while they wait. Receiver's thread:
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
  // Any thread:
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
  // Constant after opening:
  StreamInfo info_;
  bool survives_ = false;  // Reconnects after a loss.

  mutable Monitor monitor_;
  StreamConnector connector_;
  wire::ReconstructedFrame scratch_;  // Receiver's thread only.
  bool owes_event_ = false;           // A kReconnected event is due. Receiver's thread only.

  // Guarded by the monitor:
  std::unique_ptr<StreamCall> call_;  // Null while reconnecting.
  ResendBuffer resend_{1};
  std::string token_, checkpoint_;
  std::uint64_t checkpoint_next_ = 1;  // The first frame after the checkpoint.
  std::uint64_t next_answer_ = 1;      // The next frame to deliver.
  std::uint64_t next_of_call_ = 1;     // The next frame that call_ answers.
  std::uint64_t over_below_ = 0;       // All parts below this frame are over, as reported by call_.
  Clock::time_point due_since_, adopted_at_;  // Start of the deadline.
  bool finished_ = false;                     // FinishSending was called.
  absl::Status failure_;                      // Status that ended the stream.
};

}  // namespace partiemc::client
