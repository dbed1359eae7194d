#include "server/base/serialized_call.h"

#include <cassert>

namespace partiemc::server {

CallState SerializedCall::state() const {
  const MutexLock lock(mutex_);
  return state_;
}

SerializedCall::Event::Event(SerializedCall& call) : call_(call.shared_from_this()) {
  call_->mutex_.Lock();
}

SerializedCall::Event::~Event() {
  call_->mutex_.AssertHeld();
  call_->Decide();
  assert(IsLegal(call_->state_));
  const bool runs = !call_->running_ && !call_->actions_.empty();
  if (runs) call_->running_ = true;
  call_->mutex_.Unlock();
  if (runs) call_->RunActions();
}

void SerializedCall::RunActions() {
  std::vector<Action> actions;
  while (TakeActions(actions)) {
    for (Action& action : actions) action();
    actions.clear();
  }
}

bool SerializedCall::TakeActions(std::vector<Action>& actions) {
  const MutexLock lock(mutex_);
  actions.swap(actions_);
  running_ = !actions.empty();
  return running_;
}

}  // namespace partiemc::server
