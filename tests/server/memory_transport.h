// A transport in memory: the client's and the server's end of one stream, without gRPC. Requests
// and answers travel on threads of their own, as they do in gRPC.
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
  std::string reason;  // Of a frame error; empty for a result.
  std::pair<std::uint64_t, std::uint64_t> digests;

  friend bool operator==(const MemoryAnswer&, const MemoryAnswer&) = default;
};

class MemoryTransport final : private StreamTransport, private StreamHandler {
 public:
  MemoryTransport(ComputePool& pool, std::size_t window, const ReconstructionParameters& parameters,
                  const FrameLimits& limits);
  /// With the others of `budget`. A request counts 16 bytes a particle, an answer nothing.
  MemoryTransport(ComputePool& pool, MemoryBudget& budget, std::size_t window,
                  const ReconstructionParameters& parameters, const FrameLimits& limits);
  /// Cancels what goes on and waits for the end.
  ~MemoryTransport() override;

  // The client's end. Sending never blocks; what the server does not read waits here.
  void Open();
  void Send(std::uint64_t sequence, std::vector<double> positions);
  void SendRequest(MemoryRequest request);
  void HalfClose();
  void Cancel();
  /// The next answer, which the server then knows to be taken, or nothing once the stream has
  /// finished.
  std::optional<MemoryAnswer> Receive();
  /// Once finished; waits for it.
  absl::Status status();

  /// Called by the worker before it answers a frame. To be set before the first one is sent.
  std::function<void()> when_answering = [] {};

  StreamStateMachine& machine() { return *machine_; }
  /// The most frames that were inside the server at once: read, and their answer not received.
  std::size_t most_inside() const;
  /// Waits until as many frames have been read.
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
      requests_;                       // By slot; handed over by StreamStateMachine's rules alone.
  std::vector<MemoryAnswer> answers_;  // Likewise.
  std::optional<Session> session_;
  std::shared_ptr<StreamStateMachine> machine_;

  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable changed_;
  std::deque<MemoryRequest> sent_;
  bool half_closed_ = false, cancelled_ = false;
  std::optional<std::size_t> read_slot_;
  std::optional<MemoryAnswer> being_written_;
  std::optional<MemoryAnswer> to_receive_;
  bool telling_ = false;  // The machine that a write is done.
  std::optional<absl::Status> finished_;
  std::size_t frames_read_ = 0, frames_received_ = 0, most_inside_ = 0;

  std::thread reader_, writer_;
};

}  // namespace partiemc::server
