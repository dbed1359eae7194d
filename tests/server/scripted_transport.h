// A transport controlled step by step: the test decides when a read delivers, when a write ends and
// when a worker takes a job, and observes the machine's requests. The same script gives the same
// run for any number of threads.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <semaphore>
#include <vector>

#include "absl/status/status.h"
#include "server/compute/memory_budget.h"
#include "server/memory_transport.h"
#include "server/stream/session.h"
#include "server/stream/stream_state_machine.h"

namespace partiemc::server {

/// A pool whose only thread runs jobs on request.
class SteppedPool {
 public:
  SteppedPool() { Hold(); }
  ~SteppedPool() { go_on_.release(); }

  /// Runs all submitted jobs and the work after them; returns when they have ended.
  void Step() {
    pool_.Submit([this](Worker&) { WaitHere(); });
    go_on_.release();
    held_.acquire();
  }
  ComputePool& pool() { return pool_; }

 private:
  void Hold() {
    pool_.Submit([this](Worker&) { WaitHere(); });
    held_.acquire();
  }
  void WaitHere() {
    held_.release();
    go_on_.acquire();
  }

  std::counting_semaphore<> held_{0}, go_on_{0};
  ComputePool pool_{1};
};

class ScriptedTransport final : private StreamTransport, private StreamHandler {
 public:
  ScriptedTransport(SteppedPool& pool, MemoryBudget& budget, std::size_t window,
                    const ReconstructionParameters& parameters, const FrameLimits& limits);

  // Pending operations of the machine.
  bool reading() const { return read_slot_.has_value(); }
  const std::optional<MemoryAnswer>& writing() const { return writing_; }
  bool cut() const { return cut_; }
  const std::optional<absl::Status>& finished() const { return finished_; }

  // Events. Each requires that the operation it ends is pending.
  void BringRequest(MemoryRequest request);
  void EndReads();
  void EndWrite(bool ok);

  /// Called once during opening or answering.
  std::function<void()> meanwhile;
  /// Work left after each answer.
  std::function<void()> afterwards;

  StreamStateMachine& machine() { return *machine_; }

 private:
  void StartRead(std::size_t slot) override;
  void StartWrite(Outgoing what, std::size_t slot) override;
  absl::Status Open(std::size_t slot, const StreamStateMachine& stream) override;
  Answered Answer(std::size_t slot, Worker& worker, const std::atomic<bool>& cancelled) override;
  void Cut() override;
  void Finish(const absl::Status& status) override;
  void Meanwhile();

  const ReconstructionParameters parameters_;
  const FrameLimits limits_;
  std::vector<MemoryRequest> requests_;
  std::vector<MemoryAnswer> answers_;
  std::optional<Session> session_;
  std::optional<std::size_t> read_slot_;
  std::optional<MemoryAnswer> writing_;
  bool cut_ = false;
  std::optional<absl::Status> finished_;
  std::shared_ptr<StreamStateMachine> machine_;
};

/// A session's answer to `request` in the form that in-memory tests compare.
MemoryAnswer AnswerInMemory(const MemoryRequest& request, Session& session, Worker& worker);

}  // namespace partiemc::server
