// A producer's stream: translates between its channel and a StreamStateMachine. Messages pass as
// bytes: a frame is parsed where it is computed, into memory that is warm.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/calls/byte_call.h"
#include "server/calls/stream_messages.h"
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/stream/limits.h"
#include "server/stream/stream_registry.h"
#include "server/stream/stream_state_machine.h"

namespace partiemc::server {

class ReconstructCall final : public ByteCall, private StreamTransport {
 public:
  /// What is passed by reference outlives the call.
  ReconstructCall(CallChannel& channel, const MethodMeters* meters,
                  absl::StatusOr<AdmittedCall> admission, const ServerLimits& limits,
                  OpeningCalls& opening, StreamRegistry& registry, MemoryBudget& budget,
                  ComputePool& pool, WatchDispatcher& dispatcher,
                  const CurrentCheckpointKeys& checkpoint_keys);

  void OnCancel() override;
  void OnDone() override;

 private:
  void ReadDone(bool ok) override;
  void WriteDone(bool ok) override;
  void StartRead(std::size_t slot) override;
  void StartWrite(Outgoing what, std::size_t slot) override;
  void Cut() override;
  void Finish(const absl::Status& status) override;
  std::string peer() const override { return channel().peer(); }

  StreamRegistry& registry_;
  StreamMessages messages_;
  std::size_t read_slot_ = 0;  // Of the read that is going on.
  // The write that is going on.
  Outgoing written_ = Outgoing::kAnswer;
  std::size_t written_slot_ = 0;
  std::shared_ptr<StreamStateMachine> machine_;
};

}  // namespace partiemc::server
