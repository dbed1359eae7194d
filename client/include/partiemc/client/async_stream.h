// Answers without a loop of one's own: each by a callback, or as a future.
//
//   partiemc::client::AsyncStream async(**stream);
//   auto answer = async.Send({.positions = std::span<const float>(xy)}, time);
//   ...
//   if (const auto result = answer.get(); result.ok()) Draw(result->result.rings);
//   async.Finish();
#pragma once

#include <functional>
#include <future>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/frame_stream.h"

namespace partiemc::client {

/// Sends on a stream and receives from it on a thread of its own. Each result is handed over with
/// its buffers, which Receive would use again. One thread sends.
class AsyncStream {
 public:
  /// What a frame became; of parts other than 0 (StreamOptions) nothing. Errors: one with a
  /// Violation (FindViolation) where it was refused, and the stream goes on; else what ended the
  /// stream.
  using Answer = absl::StatusOr<FrameResult>;
  using Answered = std::function<void(Answer)>;
  /// Told of what is no answer: Event::Kind::kNotice and kReconnected.
  using Told = std::function<void(const Event&)>;

  /// `stream` outlives this, and nobody else sends on it or receives from it. `told` is called on
  /// the receiving thread.
  explicit AsyncStream(FrameStream& stream, Told told = {});
  /// Cancels the stream unless Finish has returned; what is unanswered is answered by that.
  ~AsyncStream();
  AsyncStream(const AsyncStream&) = delete;
  AsyncStream& operator=(const AsyncStream&) = delete;

  /// As FrameStream::Send and SendArrays, so they wait for the window; the future never waits
  /// longer than the stream's deadline for a frame that is due.
  std::future<Answer> Send(const Frame& frame, double time);
  std::future<Answer> SendArrays(const ParticleArrays& particles, double time);

  /// The same, and `answered` is called once: on the receiving thread, in the order of the frames,
  /// or before Send returns where the stream does not take the frame. It holds up the answers
  /// behind it, and may not call this.
  void Send(const Frame& frame, double time, Answered answered);
  void SendArrays(const ParticleArrays& particles, double time, Answered answered);

  /// No more frames will come. Waits until each has been answered. Errors: what ended the stream.
  absl::Status Finish();

 private:
  class Receiving;
  std::unique_ptr<Receiving> receiving_;
};

}  // namespace partiemc::client
