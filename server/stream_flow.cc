#include "server/stream_flow.h"

#include <algorithm>
#include <string>
#include <utility>

#include "partiemc/status.h"

namespace partiemc::server {
namespace {

std::string Name(RequestKind kind) {
  switch (kind) {
    case RequestKind::kMalformed:
      return "malformed";
    case RequestKind::kEmpty:
      return "empty";
    case RequestKind::kOpen:
      return "open";
    case RequestKind::kFrame:
      return "frame";
  }
  return "";
}

absl::Status BrokenProtocol(std::string found, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonProtocol), "request", std::move(found), std::move(rule)});
}

}  // namespace

absl::Status DrainingError() {
  return ViolationError(absl::StatusCode::kUnavailable,
                        {std::string(kReasonDraining), "server", "draining",
                         "connect to another one, or again later"});
}

StreamFlow::StreamFlow(StreamDoor& door, ComputePool& pool, std::size_t window)
    : door_(door), pool_(pool), window_(std::max<std::size_t>(window, 1)) {}

// Lets something happen to the state and does what follows from it.
template <typename Event>
void StreamFlow::On(Event event) {
  Actions actions;
  {
    const std::lock_guard lock(mutex_);
    event();
    actions = Decide();
  }
  Perform(std::move(actions));
}

void StreamFlow::Start() {
  On([] {});
}

void StreamFlow::ReadDone(RequestKind kind) {
  bool open = false;
  On([&] {
    reading_ = false;
    counts_.last_activity = std::chrono::steady_clock::now();
    TakeRequest(kind);
    open = opening_;
  });
  if (open) Open();
}

void StreamFlow::TakeRequest(RequestKind kind) {
  if (phase_ == Phase::kOpening) {
    opening_ = kind == RequestKind::kOpen;
    if (opening_) return;
    End(BrokenProtocol(Name(kind), "the first must be `open`"));
  } else if (phase_ == Phase::kStreaming) {
    switch (kind) {
      case RequestKind::kFrame:
        ++read_;
        break;
      case RequestKind::kOpen:
        End(BrokenProtocol(Name(kind), "comes once; after it every request must be `frame`"));
        break;
      case RequestKind::kMalformed:
      case RequestKind::kEmpty:
        End(BrokenProtocol(Name(kind), "must be `frame`"));
        break;
    }
  }
}

void StreamFlow::Open() {
  absl::Status status = door_.Open(0);
  On([&] {
    opening_ = false;
    if (!status.ok()) {
      End(std::move(status));
    } else if (phase_ == Phase::kOpening) {
      phase_ = Phase::kStreaming;
      owes_opened_ = true;
    }
  });
}

void StreamFlow::ReadEnded() {
  On([&] {
    reading_ = false;
    End(phase_ == Phase::kOpening ? BrokenProtocol("none", "the first must be `open`")
                                  : absl::OkStatus());
  });
}

void StreamFlow::WriteDone(bool ok) {
  On([&] {
    writing_ = false;
    if (in_flight_ == Outgoing::kAnswer) ++written_;
    counts_.last_activity = std::chrono::steady_clock::now();
    if (!ok) Abandon();
  });
}

void StreamFlow::Cancelled() {
  On([&] { Abandon(); });
}

void StreamFlow::Drain() {
  On([&] {
    if (phase_ == Phase::kStreaming) owes_notice_ = true;
    End(DrainingError());
  });
}

StreamCounts StreamFlow::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void StreamFlow::Compute(std::size_t slot, Worker& worker) {
  {
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::kAbandoned) return;
  }
  answered_ = door_.Answer(slot, worker);
}

void StreamFlow::Computed() {
  On([&] {
    computing_ = false;
    ++computed_;
    const std::optional<Answered> answered = std::exchange(answered_, std::nullopt);
    if (!answered) return;
    ++(answered->is_result ? counts_.frames : counts_.frame_errors);
    counts_.last_sequence = answered->last_sequence;
  });
}

void StreamFlow::End(absl::Status status) {
  if (phase_ != Phase::kOpening && phase_ != Phase::kStreaming) return;
  phase_ = Phase::kEnding;
  status_ = std::move(status);
}

void StreamFlow::Abandon() {
  if (phase_ == Phase::kFinished) return;
  phase_ = Phase::kAbandoned;
  status_ = absl::CancelledError("the client went away");
}

StreamFlow::Actions StreamFlow::Decide() {
  Actions actions;
  const bool wants_read =
      phase_ == Phase::kOpening || (phase_ == Phase::kStreaming && read_ - written_ < window_);
  if (wants_read && !opening_ && !reading_ && !starting_read_) {
    reading_ = starting_read_ = true;
    actions.read = read_ % window_;
  }
  const bool answers = phase_ == Phase::kStreaming || phase_ == Phase::kEnding;
  if (answers && !computing_ && computed_ < read_) {
    computing_ = true;
    actions.compute = computed_ % window_;
  }
  if (answers && !writing_) DecideWrite(actions);
  const bool all_said = phase_ == Phase::kAbandoned ||
                        (phase_ == Phase::kEnding && written_ == read_ && !owes_notice_);
  if (all_said && !opening_ && !computing_ && !writing_ && !starting_read_) {
    phase_ = Phase::kFinished;
    actions.finish = status_;
  }
  return actions;
}

void StreamFlow::DecideWrite(Actions& actions) {
  if (owes_opened_) {
    owes_opened_ = false;
    actions.write = Outgoing::kOpened;
  } else if (owes_notice_) {
    owes_notice_ = false;
    actions.write = Outgoing::kDraining;
  } else if (written_ < computed_) {
    actions.write = Outgoing::kAnswer;
    actions.write_slot = written_ % window_;
  } else {
    return;
  }
  writing_ = true;
  in_flight_ = *actions.write;
}

void StreamFlow::Perform(Actions actions) {
  const auto self = shared_from_this();
  for (;;) {
    if (actions.compute) {
      pool_.Submit([self, slot = *actions.compute](Worker& worker) { self->Compute(slot, worker); },
                   [self] { self->Computed(); });
    }
    if (actions.write) door_.StartWrite(*actions.write, actions.write_slot);
    if (actions.finish) door_.Finish(*actions.finish);
    if (!actions.read) return;
    door_.StartRead(*actions.read);
    const std::lock_guard lock(mutex_);
    starting_read_ = false;
    actions = Decide();
  }
}

}  // namespace partiemc::server
