// The server's end of a call of gRPC. Every method is served as a stream of bytes, those of one
// request and one answer too: the caller is known before anything of a request is read, and nothing
// is parsed before its size is known and counted.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/rpc/call_guard.h"
#include "server/stream/opening_calls.h"

namespace partiemc::server {

/// Reads, writes and ends one call. At most one read and one write go on at once, and End comes
/// once, after the last write: the state machines (StreamStateMachine, WatchStateMachine,
/// UnaryStateMachine) see to that, whatever the client does. Deletes itself when gRPC is done with
/// it. No callback of it blocks.
class ByteCall : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  /// `admission`: the caller and its place, or why it is not let in.
  ByteCall(grpc::CallbackServerContext& context, absl::StatusOr<AdmittedCall> admission)
      : context_(context), admission_(admission.status()) {
    if (admission.ok()) call_ = *std::move(admission);
  }

  void OnDone() final {
    Left();
    delete this;
  }

 protected:
  /// Has the read and the write that are going on fail soon.
  void CancelCall() { context_.TryCancel(); }
  /// Ends the call; the only place that does. A second end is a bug of a state machine: it is
  /// logged and changes nothing.
  void End(const absl::Status& status);
  /// Nothing of the call is left.
  virtual void Left() = 0;

  /// Whether the caller was let in.
  const absl::Status& admission() const { return admission_; }
  /// Of one who was not let in: nobody in particular.
  const Caller& caller() const { return call_.caller; }

  /// From here until RequestCame the call gives way to others if need be: `machine->GiveWay` ends
  /// it. To be called before the machine begins.
  template <typename Machine>
  void MayGiveWay(OpeningCalls& opening, const std::shared_ptr<Machine>& machine) {
    opening_ = opening.Enter(*caller().account(), Ending<Machine>(machine, &Machine::GiveWay));
  }
  /// The same of a watcher that is about to read another request: `machine->GiveUp` ends it.
  template <typename Machine>
  void MayGiveUp(OpeningCalls& opening, const std::shared_ptr<Machine>& machine) {
    opening_ =
        opening.EnterWatcher(*caller().account(), Ending<Machine>(machine, &Machine::GiveUp));
  }
  void RequestCame() { opening_ = {}; }

  /// A read that failed did so because nobody is there any more, and not for a half-close.
  bool IsCancelled() const { return context_.IsCancelled(); }
  std::string peer() const { return context_.peer(); }

 private:
  template <typename Machine>
  static OpeningCalls::GiveWay Ending(std::weak_ptr<Machine> machine,
                                      void (Machine::*end)(const absl::Status&)) {
    return [machine = std::move(machine), end](const absl::Status& status) {
      if (const auto alive = machine.lock()) (*alive.*end)(status);
    };
  }
  using grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>::Finish;

  grpc::CallbackServerContext& context_;
  const absl::Status admission_;
  AdmittedCall call_;
  OpeningCalls::Place opening_;  // Goes before the account.
  std::atomic<bool> ended_ = false;
};

}  // namespace partiemc::server
