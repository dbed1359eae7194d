// A transport in which nothing happens by itself: a test decides when a read brings what, when a
// write has gone out and when a worker takes its next job, and sees what the machine asks for next.
// The same script gives the same run, however many threads are behind it.
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

/// A pool whose only thread takes one job at a time, when it is told to.
class SteppedPool {
 public:
  SteppedPool() { Hold(); }
  ~SteppedPool() { go_on_.release(); }

  /// Runs what was submitted so far, with what follows each job, and returns when that is done.
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

  // What the machine has asked for and not been told the end of.
  bool reading() const { return read_slot_.has_value(); }
  const std::optional<MemoryAnswer>& writing() const { return writing_; }
  bool cut() const { return cut_; }
  const std::optional<absl::Status>& finished() const { return finished_; }

  // What happens next. Require what they end to be going on.
  void BringRequest(MemoryRequest request);
  void EndReads();
  void EndWrite(bool ok);

  /// Called in the middle of opening or answering, once.
  std::function<void()> meanwhile;
  /// What each answer leaves to do.
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

/// A session's answer to `request`, as tests in memory compare it.
MemoryAnswer AnswerInMemory(const MemoryRequest& request, Session& session, Worker& worker);

}  // namespace partiemc::server
