#include "server/stream_model.h"

#include <utility>

namespace partiemc::server {
namespace {

const StreamEnd kBrokenProtocol{absl::StatusCode::kInvalidArgument, "PROTOCOL"};
const StreamEnd kClientGone{absl::StatusCode::kCancelled, ""};
const StreamEnd kDraining{absl::StatusCode::kUnavailable, "DRAINING"};
const StreamEnd kTakenOver{absl::StatusCode::kAborted, "TAKEN_OVER"};
const StreamEnd kIdle{absl::StatusCode::kDeadlineExceeded, "IDLE"};

}  // namespace

StreamModel::StreamModel(std::size_t window, bool may_open, const std::vector<Digests>& results)
    : window_(window), may_open_(may_open), digests_(results) {
  GoOn();
}

void StreamModel::RequestCame(const MemoryRequest& request, const std::string& fault) {
  reading_ = false;
  if (phase_ == Phase::kOpening && request.kind == RequestKind::kOpen) {
    opening_ = true;
  } else if (phase_ == Phase::kStreaming && request.kind == RequestKind::kFrame) {
    answers_.push_back(AnswerTo(request, fault));
    sequences_.push_back(next_sequence_ - 1);
  } else {
    End(kBrokenProtocol);
  }
  GoOn();
}

MemoryAnswer StreamModel::AnswerTo(const MemoryRequest& request, const std::string& fault) {
  MemoryAnswer answer{Outgoing::kAnswer, request.sequence, {}, {}};
  if (request.sequence > next_sequence_) {
    answer.reason = "SEQUENCE_GAP";
  } else if (request.sequence < next_sequence_) {
    answer.reason = "SEQUENCE_DUPLICATE";
  } else {
    ++next_sequence_;
    answer.reason = fault;
    if (fault.empty()) answer.digests = digests_.at(good_frames_++);
  }
  return answer;
}

void StreamModel::OpeningDone() {
  opening_ = false;
  if (!may_open_) {
    End({absl::StatusCode::kInvalidArgument, "OUT_OF_RANGE"});
  } else if (phase_ == Phase::kOpening) {
    phase_ = Phase::kStreaming;
    owes_opened_ = true;
  }
  GoOn();
}

void StreamModel::ReadsEnded() {
  reading_ = false;
  End(phase_ == Phase::kOpening ? kBrokenProtocol : StreamEnd{});
  GoOn();
}

void StreamModel::WriteDone(bool ok) {
  if (writing_->what == Outgoing::kAnswer) ++written_;
  writing_.reset();
  if (!ok) Abandon(kClientGone);
  GoOn();
}

void StreamModel::Cancelled() {
  Abandon(kClientGone);
  GoOn();
}

void StreamModel::Drained() {
  if (phase_ == Phase::kStreaming) owes_notice_ = true;
  End(kDraining);
  GoOn();
}

// A stream that waits for the server is not idle.
void StreamModel::WaitedTooLong() {
  if (phase_ == Phase::kAbandoned || phase_ == Phase::kFinished || opening_ || computing_) return;
  if (writing_) {
    Abandon(kIdle);
    cut_ = true;
  } else {
    End(kIdle);
  }
  GoOn();
}

void StreamModel::TakenOver() {
  if (phase_ == Phase::kAbandoned || phase_ == Phase::kFinished) return;
  Abandon(kTakenOver);
  cut_ = writing_.has_value();
  GoOn();
}

bool StreamModel::TakeUp() { return phase_ != Phase::kAbandoned; }

void StreamModel::Computed(bool answered) {
  computing_ = false;
  if (answered) {
    ++(answers_[computed_].reason.empty() ? results_ : errors_);
    last_sequence_ = sequences_[computed_];
  }
  ++computed_;
  GoOn();
}

void StreamModel::End(StreamEnd end) {
  if (phase_ != Phase::kOpening && phase_ != Phase::kStreaming) return;
  phase_ = Phase::kEnding;
  end_ = std::move(end);
}

void StreamModel::Abandon(StreamEnd end) {
  if (phase_ == Phase::kAbandoned || phase_ == Phase::kFinished) return;
  phase_ = Phase::kAbandoned;
  end_ = std::move(end);
}

// Begins every operation that can begin.
void StreamModel::GoOn() {
  const std::size_t inside = answers_.size() - written_;
  const bool reads = phase_ == Phase::kOpening || (phase_ == Phase::kStreaming && inside < window_);
  if (reads && !opening_) reading_ = true;
  if (phase_ == Phase::kStreaming || phase_ == Phase::kEnding) {
    if (computed_ < answers_.size()) computing_ = true;
    if (!writing_ && std::exchange(owes_opened_, false)) {
      writing_ = MemoryAnswer{Outgoing::kOpened, 0, {}, {}};
    } else if (!writing_ && std::exchange(owes_notice_, false)) {
      writing_ = MemoryAnswer{Outgoing::kDraining, 0, {}, {}};
    } else if (!writing_ && written_ < computed_) {
      writing_ = answers_[written_];
    }
  }
  const bool said =
      phase_ == Phase::kAbandoned || (phase_ == Phase::kEnding && inside == 0 && !owes_notice_);
  if (said && !opening_ && !computing_ && !writing_) {
    phase_ = Phase::kFinished;
    finished_ = end_;
  }
}

}  // namespace partiemc::server
