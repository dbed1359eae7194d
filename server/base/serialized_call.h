// Runs the events of a call one at a time, and the actions that the events cause in order.
#pragma once

#include <memory>
#include <vector>

#include "absl/functional/any_invocable.h"
#include "common/mutex.h"
#include "server/base/call_state.h"

namespace partiemc::server {

/// Base class of the state machines of calls. An event changes the state while it holds the mutex.
/// Then `Decide` adds the actions that follow from the new state, such as a call to the transport.
/// Actions run without the mutex, in the order in which they were added, and never two at once. If
/// an action is running on another thread, that thread also runs the new actions. So no event waits
/// for an action. An action may cause an event; the actions of this event run later.
///
/// Requires: the object is held by shared_ptr only; actions do not throw. Thread-safe.
class SerializedCall : public std::enable_shared_from_this<SerializedCall> {
 public:
  using Action = absl::AnyInvocable<void()>;

  virtual ~SerializedCall() = default;
  SerializedCall(const SerializedCall&) = delete;
  SerializedCall& operator=(const SerializedCall&) = delete;

  CallState state() const;

 protected:
  explicit SerializedCall(MachineKind kind) : state_{.kind = kind} {}

  /// The scope of an event: holds the mutex. The destructor calls Decide, releases the mutex and
  /// runs the actions, unless another thread runs actions of this call. Keeps the call alive.
  class ABSL_SCOPED_LOCKABLE Event {
   public:
    explicit Event(SerializedCall& call) ABSL_EXCLUSIVE_LOCK_FUNCTION(call.mutex_);
    ~Event() ABSL_UNLOCK_FUNCTION();
    Event(const Event&) = delete;
    Event& operator=(const Event&) = delete;

   private:
    const std::shared_ptr<SerializedCall> call_;
  };

  /// Adds the actions that follow from the state, by Do. Called at the end of each event.
  virtual void Decide() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) = 0;

  void Do(Action action) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    actions_.push_back(std::move(action));
  }

  mutable Mutex mutex_;
  CallState state_ ABSL_GUARDED_BY(mutex_);

 private:
  void RunActions() ABSL_LOCKS_EXCLUDED(mutex_);
  bool TakeActions(std::vector<Action>& actions) ABSL_LOCKS_EXCLUDED(mutex_);

  std::vector<Action> actions_ ABSL_GUARDED_BY(mutex_);
  bool running_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace partiemc::server
