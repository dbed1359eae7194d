// The server's end of a call, whatever carries its messages. Every method is served as a stream of
// bytes, those of one request and one answer too: the caller is known before anything of a request
// is read, and nothing is parsed before its size is known and counted.
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

/// Translates between a CallChannel and a state machine (StreamStateMachine, WatchStateMachine,
/// UnaryStateMachine), which keeps the channel's rules, whatever the client does. No function of it
/// blocks.
class ByteCall {
 public:
  /// The channel and the meters live longer. `admission`: the caller and its place, or why it is
  /// not let in. Without meters the call is not counted.
  ByteCall(CallChannel& channel, const MethodMeters* meters,
           absl::StatusOr<AdmittedCall> admission);
  virtual ~ByteCall() = default;
  ByteCall(const ByteCall&) = delete;
  ByteCall& operator=(const ByteCall&) = delete;

  /// Of the channel: the read has brought a message, or none will come any more.
  void OnReadDone(bool ok);
  /// Of the channel: the write is over, and what it wrote may be freed.
  void OnWriteDone(bool ok);
  /// Of the channel: nobody is there any more. At any time until OnDone.
  virtual void OnCancel() = 0;
  /// Of the channel: it calls nothing else after this, and the call may be deleted.
  virtual void OnDone() = 0;

 protected:
  virtual void ReadDone(bool ok) = 0;
  virtual void WriteDone(bool ok) = 0;

  CallChannel& channel() { return channel_; }
  const CallChannel& channel() const { return channel_; }
  /// Ends the call; the only place that does. A second end is a bug of a state machine: it is
  /// logged and changes nothing.
  void End(const absl::Status& status);

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
