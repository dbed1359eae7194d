// One Reconstruct call: connects gRPC's threads to the threads of a ResumingStream.
//
//   any thread            Queue: frame -> `queue_`
//   gRPC's threads        the next frame of `queue_` is written when the server's window has room
//                         OnReadDone: response -> `ready_`, next read into a spare message
//   receiver's thread     Take: `ready_` -> caller; Recycle: the message is spare again
//
// gRPC's threads only pass pointers. A hold (gRPC's AddHold) keeps the call alive while another
// thread may start an operation. It is released when no more reads follow.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"

namespace partiemc::client {

/// Mutex shared by a stream and its calls, and the condition that signals changes.
struct Monitor {
  std::mutex mutex;
  std::condition_variable changed;
};

/// A call that takes longer to end after its last message is treated as broken.
inline constexpr std::chrono::seconds kEndTimeout(1);

/// Members with a `lock` require the monitor's lock and may release it while they run.
class StreamCall final
    : private grpc::ClientBidiReactor<grpc::ByteBuffer, v1::ReconstructResponse> {
 public:
  using Clock = std::chrono::steady_clock;
  using Lock = std::unique_lock<std::mutex>;
  using Response = std::unique_ptr<v1::ReconstructResponse>;

  /// `monitor` must outlive the call.
  StreamCall(Monitor& monitor, std::shared_ptr<grpc::Channel> channel, std::string address);
  /// Cancels and waits until gRPC has finished with the call. Requires: the lock is not held.
  ~StreamCall() override;

  /// Sends `open`. Call first and once. Requires: the lock is not held.
  void Start(const v1::OpenStream& open);
  /// Sets the number of frames that may be written ahead of their answers, and starts reading. Call
  /// once, after the first response; before, only that response is read.
  void SetWindow(Lock& lock, std::size_t frames);

  /// Appends `frame` to the queue.
  void Queue(Lock& lock, grpc::ByteBuffer frame);
  /// Half-closes the call after the queued frames.
  void HalfClose(Lock& lock);
  void Cancel(Lock& lock);

  /// The next response; null if there is none.
  Response Take(Lock& lock);
  void Recycle(Lock& lock, Response response);

  /// Frames in the queue whose write has not begun.
  std::size_t backlog() const { return queue_.size(); }
  /// Responses that can be taken.
  std::size_t ready() const { return ready_.size(); }
  /// Time of the last message from the server, or of the last resumed read.
  Clock::time_point progress_at() const { return progress_at_; }
  /// No response will follow; the status may still be pending.
  bool reads_over() const { return reads_over_; }
  bool done() const { return done_; }
  const std::string& address() const { return address_; }

  // Valid when done():
  const grpc::Status& end() const { return end_; }
  /// The server's reason (proto/PROTOCOL.md); empty if the status is not from the server.
  std::string reason() const;

 private:
  void OnWriteDone(bool ok) override;
  void OnReadDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

  void WriteNext(Lock& lock);
  void ReadNext(Lock& lock);
  template <typename Operation>
  void RunOutside(Lock& lock, Operation operation);
  void ReleaseHoldWhenIdle(Lock& lock);
  void EndReadsIfCancelled(Lock& lock);

  Monitor& monitor_;
  const std::string address_;
  grpc::TemplatedGenericStub<grpc::ByteBuffer, v1::ReconstructResponse> stub_;
  grpc::ClientContext context_;

  // Guarded by the monitor:
  std::vector<Response> spare_;
  Response reading_;
  std::deque<Response> ready_;
  grpc::ByteBuffer request_;  // The request being written.
  std::deque<grpc::ByteBuffer> queue_;
  std::size_t window_ = 0;
  std::uint64_t written_ = 0, answered_ = 0;  // Numbers of frames.
  Clock::time_point progress_at_ = Clock::now();
  bool writing_ = false;
  bool half_close_wanted_ = false, half_closed_ = false;
  bool started_ = false, cancelled_ = false, reads_over_ = false, hold_ = false, done_ = false;
  int outside_operations_ = 0;
  grpc::Status end_;  // Valid when done_.
};

}  // namespace partiemc::client
