// Implements Stream over successive calls.
//
// The stream holds every frame from Send until a checkpoint covers it. After a loss the stream
// opens a new call with the last checkpoint and resends all later frames in order. It drops
// repeated results, so the caller receives each result once. Results depend only on checkpoint and
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
  static absl::StatusOr<std::unique_ptr<ResumingStream>> Open(
      std::string_view address, const StreamOptions& options,
      const TimeAndChance& surroundings = {});

  const StreamInfo& info() const override { return info_; }
  std::string CurrentId() const override ABSL_LOCKS_EXCLUDED(monitor_.mutex);
  absl::StatusOr<std::uint64_t> Send(const Frame& frame, double time) override;
  absl::StatusOr<std::uint64_t> SendArrays(const ParticleArrays& particles, double time) override;
  absl::Status FinishSending() override ABSL_LOCKS_EXCLUDED(monitor_.mutex);
  absl::StatusOr<Received> Receive(Event& event,
                                   std::optional<std::chrono::milliseconds> wait) override
      ABSL_LOCKS_EXCLUDED(monitor_.mutex);
  std::optional<Reconnecting> reconnecting() const override ABSL_LOCKS_EXCLUDED(monitor_.mutex);
  std::size_t InFlight() const override ABSL_LOCKS_EXCLUDED(monitor_.mutex);
  void Cancel() override ABSL_LOCKS_EXCLUDED(monitor_.mutex);

 private:
  using TimePoint = Clock::TimePoint;
  using OptionalTime = std::optional<TimePoint>;

  ResumingStream(std::vector<std::string> addresses, const StreamOptions& options,
                 const TimeAndChance& surroundings);

  // Called by the receiver's thread. Methods that require the mutex may release it while they wait.
  absl::Status OpenFirst() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  absl::StatusOr<Received> Advance(Event& event, OptionalTime until)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  absl::StatusOr<bool> GoOn(OptionalTime until) ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  absl::Status CheckReplica(const StreamConnector::Opened& opened, const StreamInfo& info) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  void Adopt(StreamConnector::Opened opened, std::size_t window)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  absl::StatusOr<bool> Deliver(StreamCall::Response response, Event& event)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  void Remember(const v1::ReconstructResponse& answer)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  absl::StatusOr<bool> EndCall() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  void LoseCall(std::unique_ptr<StreamCall> call, const Loss& loss)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  OptionalTime AnswerDue() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  bool IsOverdue() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  absl::Status TooSlowToAnswer() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  // Any thread:
  absl::StatusOr<std::uint64_t> SendRows(const wire::FrameRows& frame, std::size_t particles)
      ABSL_LOCKS_EXCLUDED(monitor_.mutex);
  absl::Status Fail(absl::Status failure) ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  absl::Status WaitToSend(TimePoint start, std::uint64_t bytes)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  bool MaySend(std::uint64_t bytes) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  absl::Status TooSlowToSend() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  std::optional<absl::Status> FatalEnd() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  bool all_answered() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex) {
    return next_answer_ == resend_.end();
  }
  bool sends_other_part() const { return options_.parts.part > 0; }
  std::uint64_t FirstToSend(const StreamConnector::Opened& opened) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  // For Clang's thread-safety analysis: connector and call use the same monitor. Does nothing.
  void AssertShared() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex)
      ABSL_ASSERT_EXCLUSIVE_LOCK(connector_.mutex(), call_->mutex()) {}

  const StreamOptions options_;
  // Constant after opening:
  StreamInfo info_;
  bool survives_ = false;  // True if the stream reconnects after a loss.

  mutable Monitor monitor_;
  StreamConnector connector_;
  wire::ReconstructedFrame scratch_;  // Receiver's thread only.
  bool owes_event_ = false;           // A kReconnected event is due. Receiver's thread only.

  // Null while reconnecting.
  std::unique_ptr<StreamCall> call_ ABSL_GUARDED_BY(monitor_.mutex);
  ResendBuffer resend_ ABSL_GUARDED_BY(monitor_.mutex){1};
  std::string id_ ABSL_GUARDED_BY(monitor_.mutex);  // Of the last call.
  std::string token_ ABSL_GUARDED_BY(monitor_.mutex);
  std::string checkpoint_ ABSL_GUARDED_BY(monitor_.mutex);
  // The first frame after the checkpoint.
  std::uint64_t checkpoint_next_ ABSL_GUARDED_BY(monitor_.mutex) = 1;
  // The next frame whose response the caller receives, and the next frame that call_ answers. After
  // a reconnection the second may be smaller: call_ then repeats some responses, which are dropped.
  std::uint64_t next_answer_ ABSL_GUARDED_BY(monitor_.mutex) = 1;
  std::uint64_t next_of_call_ ABSL_GUARDED_BY(monitor_.mutex) = 1;
  // Parts other than 0 only: call_ does not answer frames below this number, because the server has
  // already completed them.
  std::uint64_t over_below_ ABSL_GUARDED_BY(monitor_.mutex) = 0;
  // Starts of deadlines. `adopted_at_`: when call_ was opened. `due_since_`: then, or later when a
  // frame was sent, or FinishSending called, while no frame was unanswered.
  TimePoint due_since_ ABSL_GUARDED_BY(monitor_.mutex);
  TimePoint adopted_at_ ABSL_GUARDED_BY(monitor_.mutex);
  bool finished_ ABSL_GUARDED_BY(monitor_.mutex) = false;  // FinishSending was called.
  // Whether the server of the last call uses boxes of frames.
  bool frame_boxes_ ABSL_GUARDED_BY(monitor_.mutex) = true;
  bool sends_boxes_ ABSL_GUARDED_BY(monitor_.mutex) = false;  // A frame had a box of its own.
  absl::Status failure_ ABSL_GUARDED_BY(monitor_.mutex);      // Status that ended the stream.
};

}  // namespace partiemc::client
