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
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "common/clock.h"
#include "common/mutex.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"

namespace partiemc::client {

/// Shared by a stream and its calls: a mutex, the condition that signals changes, and the clock.
struct Monitor {
  using TimePoint = Clock::TimePoint;

  explicit Monitor(const TimeAndChance& given) : surroundings(given) {}
  TimePoint Now() const { return surroundings.clock->Now(); }
  bool WaitUntil(TimePoint until) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    return surroundings.clock->WaitUntil(changed, mutex, until);
  }

  Mutex mutex;
  CondVar changed;
  const TimeAndChance surroundings;
};

/// Time limit for the status of a call after the end of its reads. A call that takes longer is
/// treated as broken.
inline constexpr std::chrono::seconds kEndTimeout(1);

/// Methods that require the monitor's mutex may release it while they run.
class StreamCall final
    : private grpc::ClientBidiReactor<grpc::ByteBuffer, v1::ReconstructResponse> {
 public:
  using TimePoint = Clock::TimePoint;
  using Response = std::unique_ptr<v1::ReconstructResponse>;

  /// `monitor` must outlive the call.
  StreamCall(Monitor& monitor, std::shared_ptr<grpc::Channel> channel, std::string address);
  /// Cancels and waits until gRPC has finished with the call. Requires: the mutex is not held.
  ~StreamCall() override;

  Mutex& mutex() const ABSL_LOCK_RETURNED(monitor_.mutex) { return monitor_.mutex; }
  /// For Clang's thread-safety analysis: this thread holds the monitor's mutex. Does nothing.
  void AssertLocked() const ABSL_ASSERT_EXCLUSIVE_LOCK(monitor_.mutex) {}

  /// Sends `open`. Call first and once.
  void Start(const v1::OpenStream& open) ABSL_LOCKS_EXCLUDED(monitor_.mutex);
  /// Sets the number of frames that may be written ahead of their answers, and starts reading. Call
  /// once, after the first response. Before this call, only the first response is read.
  void SetWindow(std::size_t frames) ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);

  /// Appends `frame` to the queue.
  void Queue(grpc::ByteBuffer frame) ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  /// Half-closes the call after the queued frames.
  void HalfClose() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  void Cancel() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);

  /// The next response; null if there is none.
  Response Take() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  void Recycle(Response response) ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);

  /// Frames in the queue whose write has not begun.
  std::size_t backlog() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex) {
    return queue_.size();
  }
  /// Responses that can be taken.
  std::size_t ready() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex) { return ready_.size(); }
  /// Whether an answer can be taken.
  bool HasAnswer() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  /// Time of the latest of these: an answer or StreamOpened arrived, the reads ended, or Recycle of
  /// an answer restarted the reads, which had paused because no message was spare. Notices do not
  /// count.
  TimePoint progress_at() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex) {
    return progress_at_;
  }
  /// No response will follow; the status may still be pending.
  bool reads_over() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex) { return reads_over_; }
  bool done() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex) { return done_; }
  const std::string& address() const { return address_; }

  // Valid when done():
  const grpc::Status& end() const { return end_; }
  /// The server's reason (proto/PROTOCOL.md); empty without one, as after a lost connection.
  std::string reason() const;

 private:
  void OnWriteDone(bool ok) override ABSL_LOCKS_EXCLUDED(monitor_.mutex);
  void OnReadDone(bool ok) override ABSL_LOCKS_EXCLUDED(monitor_.mutex);
  void OnDone(const grpc::Status& status) override ABSL_LOCKS_EXCLUDED(monitor_.mutex);

  void WriteNext() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  void ReadNext() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  template <typename Operation>
  void RunOutside(Operation operation) ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  void ReleaseHoldWhenIdle() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);
  void EndReadsIfCancelled() ABSL_EXCLUSIVE_LOCKS_REQUIRED(monitor_.mutex);

  Monitor& monitor_;
  const std::string address_;
  grpc::TemplatedGenericStub<grpc::ByteBuffer, v1::ReconstructResponse> stub_;
  grpc::ClientContext context_;

  std::vector<Response> spare_ ABSL_GUARDED_BY(monitor_.mutex);
  Response reading_ ABSL_GUARDED_BY(monitor_.mutex);
  std::deque<Response> ready_ ABSL_GUARDED_BY(monitor_.mutex);
  grpc::ByteBuffer request_ ABSL_GUARDED_BY(monitor_.mutex);  // The request being written.
  std::deque<grpc::ByteBuffer> queue_ ABSL_GUARDED_BY(monitor_.mutex);
  std::size_t window_ ABSL_GUARDED_BY(monitor_.mutex) = 0;
  // Counts of frames.
  std::uint64_t written_ ABSL_GUARDED_BY(monitor_.mutex) = 0;
  std::uint64_t answered_ ABSL_GUARDED_BY(monitor_.mutex) = 0;
  TimePoint progress_at_ ABSL_GUARDED_BY(monitor_.mutex) = monitor_.Now();
  bool writing_ ABSL_GUARDED_BY(monitor_.mutex) = false;
  bool half_close_wanted_ ABSL_GUARDED_BY(monitor_.mutex) = false;
  bool half_closed_ ABSL_GUARDED_BY(monitor_.mutex) = false;
  bool started_ ABSL_GUARDED_BY(monitor_.mutex) = false;
  bool cancelled_ ABSL_GUARDED_BY(monitor_.mutex) = false;
  bool reads_over_ ABSL_GUARDED_BY(monitor_.mutex) = false;
  bool hold_ ABSL_GUARDED_BY(monitor_.mutex) = false;
  bool done_ ABSL_GUARDED_BY(monitor_.mutex) = false;
  int outside_operations_ ABSL_GUARDED_BY(monitor_.mutex) = 0;
  grpc::Status end_;  // Constant once done_ is set.
};

}  // namespace partiemc::client
