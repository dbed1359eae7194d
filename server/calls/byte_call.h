// The server's side of a call, over any channel. Every method is served as a stream of bytes,
// including unary methods. So the server authenticates the caller before it reads a request, and it
// checks the size of a message before it parses the message.
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
#include "server/calls/server_context.h"
#include "server/stream/opening_calls.h"

namespace partiemc::server {

/// A new call, and the result of Admit. The channel and the meters outlive the ByteCall.
struct ArrivedCall {
  CallChannel& channel;
  const MethodMeters* meters;  ///< Null: the call is not counted.
  absl::StatusOr<AdmittedCall> admission;
  std::string client;  ///< Name of the caller for the log, also of a refused one; may be empty.
};

/// Connects a CallChannel to a state machine (StreamStateMachine, WatchStateMachine,
/// UnaryStateMachine). The state machine keeps the rules of the channel (call_channel.h). Never
/// blocks. Any thread may call.
class ByteCall {
 public:
  ByteCall(ArrivedCall call, const ServerContext& context);
  virtual ~ByteCall() = default;
  ByteCall(const ByteCall&) = delete;
  ByteCall& operator=(const ByteCall&) = delete;

  // Called by the channel:

  /// A read has ended. `ok`: a message has arrived; otherwise no further message will arrive.
  void OnReadDone(bool ok);
  /// A write has ended, so its message may be freed.
  void OnWriteDone(bool ok);
  /// The client has disconnected. May be called at any time before OnDone, and repeatedly.
  virtual void OnCancel() = 0;
  /// The last call of the channel; this object may be deleted afterwards.
  virtual void OnDone() = 0;

 protected:
  virtual void OnRequest() = 0;
  virtual void OnRequestsEnded() = 0;
  virtual void OnResponseWritten(bool ok) = 0;

  CallChannel& channel() { return channel_; }
  const CallChannel& channel() const { return channel_; }
  const ServerContext& context() const { return context_; }
  /// Ends the call. A second End, a bug of the state machine, is logged and has no effect.
  void End(const absl::Status& status);

  /// OK, or the error with which the caller was refused.
  const absl::Status& admission() const { return admission_; }
  /// The caller; an anonymous one if the caller was refused.
  const Caller& caller() const { return call_.caller; }
  /// ArrivedCall::client.
  const std::string& client() const { return client_; }

  /// Lets the server evict this call by `machine->GiveWay` until the first request has arrived
  /// (OpeningCalls). Called before the machine starts.
  template <typename Machine>
  void AllowEviction(const std::shared_ptr<Machine>& machine) {
    opening_ =
        context_.opening.Enter(*caller().account(), Evict<Machine>(machine, &Machine::GiveWay));
  }
  /// Lets the server evict this watcher by `machine->GiveUp` until the next request has arrived
  /// (OpeningCalls).
  template <typename Machine>
  void AllowWatcherEviction(const std::shared_ptr<Machine>& machine) {
    opening_ = context_.opening.EnterWatcher(*caller().account(),
                                             Evict<Machine>(machine, &Machine::GiveUp));
  }

 private:
  template <typename Machine>
  static OpeningCalls::GiveWay Evict(std::weak_ptr<Machine> machine,
                                     void (Machine::*end)(const absl::Status&)) {
    return [machine = std::move(machine), end](const absl::Status& status) {
      if (const auto alive = machine.lock()) (*alive.*end)(status);
    };
  }

  CallChannel& channel_;
  const MethodMeters* const meters_;
  const ServerContext& context_;
  const std::chrono::steady_clock::time_point came_ = std::chrono::steady_clock::now();
  const absl::Status admission_;
  const std::string client_;
  AdmittedCall call_;
  OpeningCalls::Place opening_;  // Destroyed before the account.
  std::atomic<bool> ended_ = false;
};

}  // namespace partiemc::server
