// The server's end of a call, over any channel. Every method is served as a stream of bytes, unary
// ones included: the server knows the caller before it reads a request, and the size of a message
// before it parses it.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/calls/admission.h"
#include "server/calls/call_channel.h"
#include "server/calls/call_meters.h"
#include "server/stream/opening_calls.h"

namespace partiemc::server {

/// Channel and meters outlive the call.
struct ArrivedCall {
  CallChannel& channel;
  const MethodMeters* meters = nullptr;  ///< Null: the call is not counted.
  absl::StatusOr<AdmittedCall> admission;
};

/// Translates between a CallChannel and a state machine (StreamStateMachine, WatchStateMachine,
/// UnaryStateMachine), which keeps the channel's rules. Never blocks.
class ByteCall {
 public:
  explicit ByteCall(ArrivedCall call);
  virtual ~ByteCall() = default;
  ByteCall(const ByteCall&) = delete;
  ByteCall& operator=(const ByteCall&) = delete;

  // Called by the channel:

  /// The read has returned a message, or none will come.
  void OnReadDone(bool ok);
  /// The write has ended, and its message may be freed.
  void OnWriteDone(bool ok);
  /// The client has disconnected. At any time until OnDone.
  virtual void OnCancel() = 0;
  /// The last call; this may be deleted.
  virtual void OnDone() = 0;

 protected:
  virtual void ReadDone(bool ok) = 0;
  virtual void WriteDone(bool ok) = 0;

  CallChannel& channel() { return channel_; }
  const CallChannel& channel() const { return channel_; }
  /// Ends the call. A second end is a bug of a state machine: it is logged and has no effect.
  void End(const absl::Status& status);

  /// Whether the caller was admitted.
  const absl::Status& admission() const { return admission_; }
  /// Anonymous if the caller was not admitted.
  const Caller& caller() const { return call_.caller; }

  /// Until RequestCame the server may evict the call by `machine->GiveWay`. Called before the
  /// machine starts.
  template <typename Machine>
  void MayGiveWay(OpeningCalls& opening, const std::shared_ptr<Machine>& machine) {
    opening_ = opening.Enter(*caller().account(), Ending<Machine>(machine, &Machine::GiveWay));
  }
  /// Until RequestCame the server may evict this watcher by `machine->GiveUp`.
  template <typename Machine>
  void MayGiveUp(OpeningCalls& opening, const std::shared_ptr<Machine>& machine) {
    opening_ =
        opening.EnterWatcher(*caller().account(), Ending<Machine>(machine, &Machine::GiveUp));
  }
  void RequestCame() { opening_ = {}; }

 private:
  template <typename Machine>
  static OpeningCalls::GiveWay Ending(std::weak_ptr<Machine> machine,
                                      void (Machine::*end)(const absl::Status&)) {
    return [machine = std::move(machine), end](const absl::Status& status) {
      if (const auto alive = machine.lock()) (*alive.*end)(status);
    };
  }

  CallChannel& channel_;
  const MethodMeters* const meters_;
  const std::chrono::steady_clock::time_point came_ = std::chrono::steady_clock::now();
  const absl::Status admission_;
  AdmittedCall call_;
  OpeningCalls::Place opening_;  // Goes before the account.
  std::atomic<bool> ended_ = false;
};

}  // namespace partiemc::server
