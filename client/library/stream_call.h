// One Reconstruct call: a reactor between gRPC's threads and those of a ResumingStream.
//
//   any thread            Queue: frame -> `queue_`
//   gRPC's threads        the next frame of `queue_` is written when the server's window has room
//                         OnReadDone: answer -> `ready_`, next read into a spare message
//   receiver's thread     Take: `ready_` -> caller; Recycle: the message is spare again
//
// gRPC's threads never do more than pass a pointer on. A hold keeps the call alive while an
// operation may be started from outside of gRPC's threads; it is given back once nothing more can
// be read.
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

/// One lock for a stream and its calls, and what is told of every change under it.
struct Monitor {
  std::mutex mutex;
  std::condition_variable changed;
};

/// How long a call may take to end after its last message; then it counts as broken.
inline constexpr std::chrono::seconds kEndTimeout(1);

/// A member with a `lock` expects the monitor's to be held, and may let it go meanwhile.
class StreamCall final
    : private grpc::ClientBidiReactor<grpc::ByteBuffer, v1::ReconstructResponse> {
 public:
  using Clock = std::chrono::steady_clock;
  using Lock = std::unique_lock<std::mutex>;
  using Response = std::unique_ptr<v1::ReconstructResponse>;

  /// `monitor` outlives the call.
  StreamCall(Monitor& monitor, std::shared_ptr<grpc::Channel> channel, std::string address);
  /// Cancels, and waits until gRPC is done with it. Without the lock.
  ~StreamCall() override;

  /// Sends `open`. To be called first, once, without the lock.
  void Start(const v1::OpenStream& open);
  /// Allows so many frames to be written ahead of their answers, and reads on. To be called once,
  /// with the first answer: until then none but it is read.
  void SetWindow(Lock& lock, std::size_t frames);

  /// `frame` is written in its turn.
  void Queue(Lock& lock, grpc::ByteBuffer frame);
  /// No frame comes after those that are queued.
  void HalfClose(Lock& lock);
  void Cancel(Lock& lock);

  /// The next answer; null where none is there.
  Response Take(Lock& lock);
  void Recycle(Lock& lock, Response response);

  /// Frames that are queued and not yet being written.
  std::size_t backlog() const { return queue_.size(); }
  /// Answers that wait to be taken.
  std::size_t ready() const { return ready_.size(); }
  /// When the server was last heard of, or could go on again.
  Clock::time_point progress_at() const { return progress_at_; }
  /// No answer will come any more; the status may be on its way.
  bool reads_over() const { return reads_over_; }
  bool done() const { return done_; }
  const std::string& address() const { return address_; }

  // Once done():
  const grpc::Status& end() const { return end_; }
  /// The reason that the server gave (proto/PROTOCOL.md); empty where it has not spoken itself.
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
  grpc::ByteBuffer request_;  // While it is being written.
  std::deque<grpc::ByteBuffer> queue_;
  std::size_t window_ = 0;
  std::uint64_t written_ = 0, answered_ = 0;  // Frames.
  Clock::time_point progress_at_ = Clock::now();
  bool writing_ = false;
  bool half_close_wanted_ = false, half_closed_ = false;
  bool started_ = false, cancelled_ = false, reads_over_ = false, hold_ = false, done_ = false;
  int outside_operations_ = 0;
  grpc::Status end_;  // Valid once done_.
};

}  // namespace partiemc::client
