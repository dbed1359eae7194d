// One Reconstruct call: the reactor behind Stream.
//
//   sender's thread        Send: encode -> StartWrite          OnWriteDone: the next write may
//   start gRPC's threads         OnReadDone: answer -> `ready_`, next read into a spare message
//   receiver's thread      Receive: `ready_` -> decode -> caller's Event, message is spare again
//
// Answers are decoded on the receiver's thread, so that gRPC's threads never do more than pass a
// pointer on. A hold keeps the call alive while Send or Receive may start an operation from outside
// of gRPC's threads; it is given back once nothing more can be read.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/stream.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "wire/codec.h"

namespace partiemc::client {

class Stream::Call final
    : private grpc::ClientBidiReactor<grpc::ByteBuffer, v1::ReconstructResponse> {
 public:
  Call(std::shared_ptr<grpc::Channel> channel, std::string address,
       std::chrono::milliseconds deadline);
  ~Call() override;

  /// Sends OpenStream and waits for StreamOpened. To be called first, once.
  absl::Status Open(const StreamOptions& options);

  const StreamInfo& info() const { return info_; }
  absl::StatusOr<std::uint64_t> Send(const Frame& frame, double time);
  absl::Status FinishSending();
  absl::StatusOr<Received> Receive(Event& event, std::optional<std::chrono::milliseconds> wait);
  std::size_t InFlight() const;
  void Cancel();

 private:
  using Clock = std::chrono::steady_clock;
  using Lock = std::unique_lock<std::mutex>;

  void OnWriteDone(bool ok) override;
  void OnReadDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

  // The following expect `lock` to be held; those that start an operation let it go meanwhile.
  void Write(Lock& lock, grpc::ByteBuffer request);
  void ReadNext(Lock& lock);
  void EndOutsideOperation(Lock& lock);
  void ReleaseHoldWhenIdle(Lock& lock);
  absl::Status Fail(absl::Status failure);
  absl::Status WaitToSend(Lock& lock, bool for_window);
  std::optional<Clock::time_point> AnswerDue() const;
  absl::StatusOr<Received> EndOfAnswers(Lock& lock);

  // Of the receiver's thread, without the lock.
  absl::Status Decode(v1::ReconstructResponse& response, Event& event);
  absl::Status CheckOrder(std::uint64_t sequence) const;
  absl::Status CheckFits(const Frame& frame) const;

  const std::string address_;
  const std::chrono::milliseconds deadline_;
  StreamInfo info_;
  grpc::TemplatedGenericStub<grpc::ByteBuffer, v1::ReconstructResponse> stub_;
  grpc::ClientContext context_;
  wire::ReconstructedFrame decoded_;  // Of the receiver's thread alone.

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::unique_ptr<v1::ReconstructResponse>> spare_;
  std::unique_ptr<v1::ReconstructResponse> reading_;
  grpc::ByteBuffer request_;  // While it is being written.
  std::deque<std::unique_ptr<v1::ReconstructResponse>> ready_;
  std::uint64_t next_sequence_ = 1;  // Of the next frame to be sent.
  std::uint64_t next_answer_ = 1;    // Of the next answer to be received.
  Clock::time_point progress_at_;    // When the server was last due to begin or was heard of.
  bool writing_ = false;
  bool half_closed_ = false;  // FinishSending was called.
  bool started_ = false, reads_over_ = false, hold_ = false, done_ = false;
  int outside_operations_ = 0;
  grpc::Status end_;      // Valid once done_.
  absl::Status failure_;  // What this side ended the stream for; the first one counts.
};

}  // namespace partiemc::client
