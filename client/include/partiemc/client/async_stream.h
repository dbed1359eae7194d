// Sends frames and delivers each result through a callback or a future, without a receive loop in
// the caller.
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

/// Adapter that receives from a stream on its own thread. Each result is moved out with its
/// buffers, so the stream cannot reuse these buffers. One thread sends.
class AsyncStream {
 public:
  /// The result of one frame; empty for parts other than 0 (FrameParts). Errors: a status with a
  /// Violation (FindViolation) refuses this frame only, and the stream continues. Any other status
  /// ended the stream.
  using Answer = absl::StatusOr<FrameResult>;
  using Answered = std::function<void(Answer)>;
  /// Receives the events that do not answer a frame: Event::Kind::kNotice and kReconnected.
  using Told = std::function<void(const Event&)>;

  /// `stream` must outlive this object; no other code sends or receives on it. `told` runs on the
  /// receiving thread.
  explicit AsyncStream(FrameStream& stream, Told told = {});
  /// Cancels the stream unless Finish has returned. Frames without an answer get status CANCELLED.
  ~AsyncStream();
  AsyncStream(const AsyncStream&) = delete;
  AsyncStream& operator=(const AsyncStream&) = delete;

  /// Sends like FrameStream::Send and SendArrays: waits while the window is full. The future
  /// becomes ready with the answer, or with the status that ended the stream.
  std::future<Answer> Send(const Frame& frame, double time);
  std::future<Answer> SendArrays(const ParticleArrays& particles, double time);

  /// Sends like the methods above, but passes the answer to `answered`, which is called once. The
  /// receiving thread makes the call, in the order of the frames. If the stream does not accept the
  /// frame, Send makes the call before it returns. Until `answered` returns, later answers wait.
  /// `answered` must not call this object.
  void Send(const Frame& frame, double time, Answered answered);
  void SendArrays(const ParticleArrays& particles, double time, Answered answered);

  /// Ends the sending side and waits until every frame is answered. Errors: the status that ended
  /// the stream.
  absl::Status Finish();

 private:
  class Receiving;
  std::unique_ptr<Receiving> receiving_;
};

}  // namespace partiemc::client
