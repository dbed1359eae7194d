// The sending half of a replay: input -> two frames read ahead -> stream.
//
//   reader thread    Sequence::Next -> queue of two
//   sender thread    queue -> pace -> FrameStream::Send, or LatestSender::Offer -> frames that wait
//                    for their answers
//   caller           TakeAnswered for each answer, in order; Recycle when the frame is done with
//
// Memory: the queue, the window of the stream and one frame in each hand.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/replay/bounded_queue.h"
#include "client/input/sequence.h"
#include "partiemc/client/frame_stream.h"
#include "partiemc/client/latest_sender.h"

namespace partiemc::client {

/// What happens to frames that come faster than the stream takes them.
enum class SendPolicy {
  kBlock,   ///< They wait; none is lost.
  kLatest,  ///< The newest one is sent, as a simulator does that never waits; others are skipped.
};

class FrameFeeder {
 public:
  /// A frame that was refused before it was sent, hence without an answer.
  struct Refused {
    std::string source;
    std::string message;
  };

  /// Starts at once. `input` and `stream` must outlive it. Absent rate: as fast as it goes. Of what
  /// particles carry besides, `attributes` are sent along.
  FrameFeeder(Sequence& input, FrameStream& stream, std::optional<double> frames_per_second,
              SendPolicy policy, std::vector<std::string> attributes);
  /// Stops as Stop does.
  ~FrameFeeder();

  /// The frame that the answer just received belongs to. Requires: called once for each result or
  /// refusal, in their order.
  std::unique_ptr<RecordedFrame> TakeAnswered();
  void Recycle(std::unique_ptr<RecordedFrame> frame);
  std::vector<Refused> TakeRefused();
  /// Frames that were not sent because newer ones came.
  std::uint64_t skipped_count() const;

  /// Cancels the stream and reads no further.
  void Stop();
  /// Waits for both threads. To be called when the stream has ended, or after Stop.
  /// Errors: that of the input.
  absl::Status Join();

 private:
  using FramePointer = std::unique_ptr<RecordedFrame>;

  void Read();
  void SendAll();
  bool SendOne(FramePointer frame);
  bool Offer(LatestSender& sender, FramePointer frame);
  OfferHooks Hooks();
  Frame View(const RecordedFrame& recorded);
  void ViewAttributes(const RecordedFrame& recorded);
  void RefuseLast(const absl::Status& status);
  bool Pace(std::size_t sent);

  Sequence& input_;
  FrameStream& stream_;
  const std::optional<double> frames_per_second_;
  const SendPolicy policy_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  BoundedQueue<FramePointer> read_ahead_{2};
  absl::Status input_status_;  // Of the reader thread until it is joined.
  const std::vector<std::string> attribute_names_;
  std::vector<float> as_float32_;      // Of the sender thread alone.
  std::vector<Attribute> attributes_;  // Likewise.

  mutable std::mutex mutex_;
  std::condition_variable stopped_;
  bool stop_ = false;
  std::deque<FramePointer> offered_;  // And neither being sent nor skipped.
  std::deque<FramePointer> unanswered_;
  std::uint64_t skipped_ = 0;
  std::vector<FramePointer> free_;
  std::vector<Refused> refused_;
  std::thread reader_, sender_;
};

}  // namespace partiemc::client
