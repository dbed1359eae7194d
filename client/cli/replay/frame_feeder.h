// The sending half of a replay: input -> read-ahead queue of two frames -> stream.
//
//   reader thread    Sequence::Next -> queue of two
//   sender thread    queue -> pace -> FrameStream::Send or LatestSender::Offer -> unanswered frames
//   caller           TakeAnswered for each response, in order; Recycle after use
//
// Memory: the queue, the window of the stream, and one frame per thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/replay/bounded_queue.h"
#include "client/input/sequence.h"
#include "common/mutex.h"
#include "partiemc/client/frame_stream.h"
#include "partiemc/client/latest_sender.h"

namespace partiemc::client {

/// Policy for frames that are due while the stream is busy.
enum class SendPolicy {
  kBlock,   ///< Wait; no frame is lost.
  kLatest,  ///< Send the newest frame, skip and count the others.
};

/// Checks that `frame` has an orthogonal box. With `of_stream`, also that the box is periodic along
/// each periodic axis of `of_stream`. Errors: FAILED_PRECONDITION.
absl::Status CheckBox(const RecordedFrame& frame,
                      const std::optional<PeriodicBox>& of_stream = std::nullopt);

class FrameFeeder {
 public:
  /// A frame that the library refused to send. It has no response.
  struct Refused {
    std::string source;
    std::string message;
  };

  /// Starts both threads. Requires: `input` and `stream` outlive this object. If
  /// `frames_per_second` is absent, frames are sent as fast as possible. `attributes` names the
  /// attributes to send. `box`: the box of the stream; absent: recorded boxes are not sent.
  FrameFeeder(Sequence& input, FrameStream& stream, std::optional<double> frames_per_second,
              SendPolicy policy, std::vector<std::string> attributes,
              std::optional<PeriodicBox> box);
  /// Calls Stop and Join.
  ~FrameFeeder();

  /// Returns the frame that the last received response answers. Requires: one call for each result
  /// or refusal, in order.
  std::unique_ptr<RecordedFrame> TakeAnswered() ABSL_LOCKS_EXCLUDED(mutex_);
  void Recycle(std::unique_ptr<RecordedFrame> frame) ABSL_LOCKS_EXCLUDED(mutex_);
  /// The frames refused since the last call.
  std::vector<Refused> TakeRefused() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Number of frames that newer ones replaced before they were sent.
  std::uint64_t skipped_count() const ABSL_LOCKS_EXCLUDED(mutex_);

  /// Cancels the stream and reads no further.
  void Stop() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Waits for both threads. Requires: the stream has ended, or Stop was called.
  /// Errors: the error of the input.
  absl::Status Join();

 private:
  using FramePointer = std::unique_ptr<RecordedFrame>;

  void Read() ABSL_LOCKS_EXCLUDED(mutex_);
  void SendAll();
  bool SendOne(FramePointer frame) ABSL_LOCKS_EXCLUDED(mutex_);
  bool Offer(LatestSender& sender, FramePointer frame) ABSL_LOCKS_EXCLUDED(mutex_);
  OfferHooks Hooks();
  Frame View(const RecordedFrame& recorded);
  void ViewAttributes(const RecordedFrame& recorded);
  void RefuseLast(const absl::Status& status) ABSL_LOCKS_EXCLUDED(mutex_);
  bool Pace(std::size_t sent) ABSL_LOCKS_EXCLUDED(mutex_);

  Sequence& input_;
  FrameStream& stream_;
  const std::optional<double> frames_per_second_;
  const SendPolicy policy_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  BoundedQueue<FramePointer> read_ahead_{2};
  absl::Status input_status_;  // Owned by the reader thread until Join.
  const std::vector<std::string> attribute_names_;
  const std::optional<PeriodicBox> box_;
  std::vector<float> as_float32_;      // Owned by the sender thread.
  std::vector<Attribute> attributes_;  // Owned by the sender thread.

  mutable Mutex mutex_;
  CondVar stopped_;
  bool stop_ ABSL_GUARDED_BY(mutex_) = false;
  std::deque<FramePointer> offered_ ABSL_GUARDED_BY(mutex_);  // kLatest: neither sent nor skipped.
  std::deque<FramePointer> unanswered_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t skipped_ ABSL_GUARDED_BY(mutex_) = 0;
  std::vector<FramePointer> free_ ABSL_GUARDED_BY(mutex_);
  std::vector<Refused> refused_ ABSL_GUARDED_BY(mutex_);
  std::thread reader_, sender_;
};

}  // namespace partiemc::client
