// An in-memory transport: both ends of one stream, without gRPC. As in gRPC, requests and responses
// travel on their own threads.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "server/stream/session.h"
#include "server/stream/stream_state_machine.h"

namespace partiemc::server {

struct MemoryRequest {
  RequestKind kind = RequestKind::kFrame;
  std::uint64_t sequence = 0;
  std::vector<double> positions;
};

struct MemoryAnswer {
  Outgoing what = Outgoing::kAnswer;
  std::uint64_t sequence = 0;
  std::string reason;  // Reason of a frame error; empty for a result.
  std::pair<std::uint64_t, std::uint64_t> digests;

  friend bool operator==(const MemoryAnswer&, const MemoryAnswer&) = default;
};

class MemoryTransport final : private StreamTransport, private StreamHandler {
 public:
  MemoryTransport(ComputePool& pool, std::size_t window, const ReconstructionParameters& parameters,
                  const FrameLimits& limits);
  /// Shares `budget`. A request counts 16 bytes per particle, a response nothing.
  MemoryTransport(ComputePool& pool, MemoryBudget& budget, std::size_t window,
                  const ReconstructionParameters& parameters, const FrameLimits& limits);
  /// Cancels pending work and waits for the end.
  ~MemoryTransport() override;

  // The client's end. Sending never blocks; requests wait here until the server reads them.
  void Open();
  void Send(std::uint64_t sequence, std::vector<double> positions);
  void SendRequest(MemoryRequest request);
  void HalfClose();
  void Cancel();
  /// The next answer, which then counts as received; empty when the stream has finished.
  std::optional<MemoryAnswer> Receive();
  /// Waits until the stream has finished.
  absl::Status status();

  /// Called by the worker before it answers a frame. Set it before the first frame.
  std::function<void()> when_answering = [] {};

  StreamStateMachine& machine() { return *machine_; }
  /// Maximum number of frames in the server at once: read, but their answers not received.
  std::size_t most_inside() const;
  /// Waits until `frames` frames have been read.
  void WaitUntilRead(std::size_t frames);

 private:
  void StartRead(std::size_t slot) override;
  void StartWrite(Outgoing what, std::size_t slot) override;
  absl::Status Open(std::size_t slot, const StreamStateMachine& stream) override;
  Answered Answer(std::size_t slot, Worker& worker, const std::atomic<bool>& cancelled) override;
  void Cut() override;
  void Finish(const absl::Status& status) override;

  void ReadLoop();
  void WriteLoop();

  const ReconstructionParameters parameters_;
  const FrameLimits limits_;
  std::vector<MemoryRequest>
      requests_;                       // By slot; guarded only by the rules of StreamStateMachine.
  std::vector<MemoryAnswer> answers_;  // As above.
  std::optional<Session> session_;
  std::shared_ptr<StreamStateMachine> machine_;

  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable changed_;
  std::deque<MemoryRequest> sent_;
  bool half_closed_ = false, cancelled_ = false;
  std::optional<std::size_t> read_slot_;
  std::optional<MemoryAnswer> being_written_;
  std::optional<MemoryAnswer> to_receive_;
  bool telling_ = false;  // A thread is in OnWriteDone.
  std::optional<absl::Status> finished_;
  std::size_t frames_read_ = 0, frames_received_ = 0, most_inside_ = 0;

  std::thread reader_, writer_;
};

}  // namespace partiemc::server
