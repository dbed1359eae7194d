// A transport that is never opened, for a registry that only compares machines.
#pragma once

#include <atomic>
#include <cstddef>
#include <optional>

#include "absl/status/status.h"
#include "server/stream/stream_state_machine.h"

namespace partiemc::server {

class ClosedTransport : public StreamTransport, public StreamHandler {
 public:
  void StartRead(std::size_t) override {}
  void StartWrite(Outgoing, std::size_t) override {}
  absl::Status Open(std::size_t, const StreamStateMachine&) override { return absl::OkStatus(); }
  Answered Answer(std::size_t, Worker&, const std::atomic<bool>&) override { return {}; }
  void Cut() override {}
  void Finish(const absl::Status& status) override { finished = status; }

  std::optional<absl::Status> finished;
};

}  // namespace partiemc::server
