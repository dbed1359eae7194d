#include "server/stream/frame_assembler.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/base/call_errors.h"

namespace partiemc::server {
namespace {

absl::Status RefusedPart(std::string_view reason, std::string field, std::string value,
                         std::string rule) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

absl::Status LeaderGone() {
  return ViolationError(absl::StatusCode::kUnavailable,
                        {std::string(kReasonLeaderGone), "stream", "part 0 has left",
                         "must have a part 0; try again when it has resumed the stream"});
}

absl::Status PartTakenOver() {
  return ViolationError(absl::StatusCode::kAborted,
                        {std::string(kReasonTakenOver), "open.part", "sent by another call now",
                         "must be sent by one call of the stream"});
}

// Lists the missing parts, for an error text: "3, 7, 8 and 5 more". `parts` starts with part 1.
// `has_leader`: part 0 has arrived.
template <typename Parts>
std::string NamesOfMissing(const Parts& parts, bool has_leader) {
  constexpr std::uint32_t kNamed = 8;
  std::string text;
  std::uint32_t missing = 0;
  const auto name = [&](std::size_t part) {
    if (++missing > kNamed) return;
    absl::StrAppend(&text, missing > 1 ? ", " : "", part);
  };
  if (!has_leader) name(0);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (parts[k] == nullptr) name(k + 1);
  }
  if (missing > kNamed) absl::StrAppend(&text, " and ", missing - kNamed, " more");
  return text;
}

}  // namespace

FrameAssembler::FrameAssembler(const Terms& terms)
    : terms_(terms),
      members_(other_parts()),
      next_(terms.next_sequence),
      wanted_(terms.next_sequence),
      resume_(terms.next_sequence) {}

void FrameAssembler::SetLeader(std::weak_ptr<AssemblyMember> leader) {
  const MutexLock lock(mutex_);
  leader_ = std::move(leader);
}

void FrameAssembler::LeaderSent(std::uint64_t sequence) {
  const MutexLock lock(mutex_);
  if (sequence < next_ || sequence - next_ >= terms_.window) return;  // Will be refused.
  last_of_leader_ = std::max(last_of_leader_, sequence);
  while (!checkpoints_.empty() && sequence >= terms_.window &&
         checkpoints_.front() <= sequence - terms_.window) {
    resume_ = checkpoints_.front() + 1;
    checkpoints_.pop_front();
  }
}

bool FrameAssembler::IsReady(std::uint64_t sequence, Clock::time_point since,
                             Clock::time_point now) const {
  const MutexLock lock(mutex_);
  if (sequence != next_ || now - since >= terms_.timeout) return true;
  const auto found = frames_.find(sequence);
  if (found == frames_.end()) return other_parts() == 0;
  const Gathered& frame = found->second;
  return frame.is_over || frame.count == other_parts() || now - frame.since >= terms_.timeout;
}

std::uint64_t FrameAssembler::BytesOfNext() const {
  const MutexLock lock(mutex_);
  const auto found = frames_.find(next_);
  return found == frames_.end() ? 0 : found->second.all_bytes;
}

absl::StatusOr<std::vector<std::shared_ptr<const PartBytes>>> FrameAssembler::Take() {
  Gathered frame;
  {
    const MutexLock lock(mutex_);
    wanted_ = next_ + 1;
    if (auto node = frames_.extract(next_)) frame = std::move(node.mapped());
  }
  frame.parts.resize(other_parts());
  if (frame.count == other_parts()) return std::move(frame.parts);
  return Missing(frame, !frame.is_over);
}

absl::Status FrameAssembler::Missing(const Gathered& frame, bool has_leader) const {
  return ViolationError(
      absl::StatusCode::kDeadlineExceeded,
      {std::string(kReasonPartsMissing), "parts", NamesOfMissing(frame.parts, has_leader),
       absl::StrCat("must come within ", terms_.timeout.count(),
                    " ms of the first part of their frame")});
}

void FrameAssembler::Answered(std::uint64_t next_sequence, bool with_checkpoint) {
  Frames over;  // Freed after the lock is released.
  const MutexLock lock(mutex_);
  next_ = next_sequence;
  wanted_ = std::max(wanted_, next_);
  while (!frames_.empty() && frames_.begin()->first < next_) {
    over.insert(frames_.extract(frames_.begin()));
  }
  if (!terms_.has_checkpoints) {
    resume_ = next_;
  } else if (with_checkpoint) {
    checkpoints_.push_back(next_ - 1);
  }
}

std::vector<std::weak_ptr<AssemblyMember>> FrameAssembler::Calls() const {
  std::vector<std::weak_ptr<AssemblyMember>> calls;
  calls.reserve(members_.size());
  for (const Member& member : members_) {
    if (member.holder != 0) calls.push_back(member.call);
  }
  return calls;
}

void FrameAssembler::TellMembers() {
  std::vector<std::weak_ptr<AssemblyMember>> calls;
  {
    const MutexLock lock(mutex_);
    calls = Calls();
  }
  for (const auto& weak : calls) {
    if (const auto call = weak.lock()) call->LookAgain();
  }
}

void FrameAssembler::End(const absl::Status& status) {
  std::vector<std::weak_ptr<AssemblyMember>> calls;
  Frames frames;
  {
    const MutexLock lock(mutex_);
    if (std::exchange(ended_, true)) return;
    calls = Calls();
    frames.swap(frames_);
  }
  for (const auto& weak : calls) {
    if (const auto call = weak.lock()) call->LeftOut(status.ok() ? status : LeaderGone());
  }
}

absl::StatusOr<FrameAssembler::Seat> FrameAssembler::Join(std::uint32_t part,
                                                          std::weak_ptr<AssemblyMember> member) {
  Seat seat{.part = part};
  std::weak_ptr<AssemblyMember> former;
  {
    const MutexLock lock(mutex_);
    if (ended_) return LeaderGone();
    DropAll(part);
    Member& place = members_[part - 1];
    former = std::exchange(place.call, std::move(member));
    seat.holder = place.holder = ++holders_;
  }
  if (const auto call = former.lock()) call->LeftOut(PartTakenOver());
  return seat;
}

void FrameAssembler::Leave(const Seat& seat) {
  const MutexLock lock(mutex_);
  if (seat.holder == 0 || members_[seat.part - 1].holder != seat.holder) return;
  members_[seat.part - 1] = {};
  DropAll(seat.part);
}

// Removes a part. Called with the lock held, but this frees little memory, because the part's call
// still holds the bytes.
void FrameAssembler::Drop(Gathered& frame, std::uint32_t part) {
  if (frame.parts[part - 1] == nullptr) return;
  frame.parts[part - 1] = nullptr;
  frame.all_bytes -= std::exchange(frame.bytes[part - 1], 0);
  --frame.count;
}

FrameAssembler::Frames::iterator FrameAssembler::Withdraw(Frames::iterator found,
                                                          std::uint32_t part) {
  Gathered& frame = found->second;
  Drop(frame, part);
  if (frame.is_over) return std::next(found);
  if (frame.count == 0) return frames_.erase(found);
  // The timeout starts with the first part that is held.
  frame.since = Clock::time_point::max();
  for (std::size_t k = 0; k < frame.parts.size(); ++k) {
    if (frame.parts[k] != nullptr) frame.since = std::min(frame.since, frame.arrivals[k]);
  }
  return std::next(found);
}

void FrameAssembler::DropAll(std::uint32_t part) {
  for (auto frame = frames_.begin(); frame != frames_.end();) frame = Withdraw(frame, part);
}

void FrameAssembler::Withdraw(const Seat& seat, std::uint64_t sequence) {
  const MutexLock lock(mutex_);
  if (members_[seat.part - 1].holder != seat.holder) return;
  if (const auto found = frames_.find(sequence); found != frames_.end()) {
    Withdraw(found, seat.part);
  }
}

absl::Status FrameAssembler::CheckOffer(std::uint32_t part, std::uint64_t sequence,
                                        std::uint64_t bytes) const {
  if (sequence < wanted_) {
    return RefusedPart(kReasonPartLate, "sequence", absl::StrCat(sequence),
                       absl::StrCat("must be at least ", wanted_, "; this frame is over"));
  }
  if (sequence - next_ >= terms_.window) {
    return RefusedPart(
        kReasonPartAhead, "sequence", absl::StrCat(sequence),
        absl::StrCat("must be below ", next_ + terms_.window, "; frames before it are unanswered"));
  }
  const auto found = frames_.find(sequence);
  const bool begun = found != frames_.end();
  if (begun && found->second.is_over) {
    return RefusedPart(kReasonPartLate, "sequence", absl::StrCat(sequence),
                       "must be that of another frame; part 0 has not come in time for this one");
  }
  if (begun && found->second.parts[part - 1] != nullptr) {
    return RefusedPart(kReasonPartDuplicate, "sequence", absl::StrCat(sequence),
                       absl::StrCat("must be sent once by part ", part, "; the first one counts"));
  }
  const std::uint64_t held = begun ? found->second.all_bytes : 0;
  if (bytes > terms_.max_frame_bytes - held) {
    return RefusedPart(kReasonFrameBytes, "frame", absl::StrCat(bytes, " bytes"),
                       absl::StrCat("must be at most ", terms_.max_frame_bytes - held,
                                    " bytes beside the parts that have come"));
  }
  return absl::OkStatus();
}

absl::Status FrameAssembler::Offer(const Seat& seat, std::uint64_t sequence, std::uint64_t bytes,
                                   std::shared_ptr<const PartBytes> part, Clock::time_point now) {
  std::shared_ptr<AssemblyMember> leader;
  {
    const MutexLock lock(mutex_);
    if (members_[seat.part - 1].holder != seat.holder) {
      return absl::CancelledError("the call sends no part any more");
    }
    if (ended_) {
      return RefusedPart(kReasonPartLate, "sequence", absl::StrCat(sequence),
                         "must be sent before part 0 ends the stream");
    }
    if (auto status = CheckOffer(seat.part, sequence, bytes); !status.ok()) return status;
    Gathered& frame = frames_.try_emplace(sequence, Gathered{.since = now}).first->second;
    frame.parts.resize(other_parts());
    frame.bytes.resize(other_parts());
    frame.arrivals.resize(other_parts());
    frame.parts[seat.part - 1] = std::move(part);
    frame.bytes[seat.part - 1] = bytes;
    frame.arrivals[seat.part - 1] = now;
    frame.all_bytes += bytes;
    if (++frame.count == other_parts()) leader = leader_.lock();
  }
  if (leader != nullptr) leader->LookAgain();
  return absl::OkStatus();
}

bool FrameAssembler::IsOver(std::uint64_t sequence, Clock::time_point now) {
  const MutexLock lock(mutex_);
  if (ended_ || sequence < next_) return true;
  const auto found = frames_.find(sequence);
  if (found == frames_.end()) return false;  // The frame is being computed.
  Gathered& frame = found->second;
  const bool has_leader = sequence <= last_of_leader_;
  if (!frame.is_over && !has_leader && now - frame.since >= terms_.timeout) {
    for (std::uint32_t part = 1; part <= other_parts(); ++part) Drop(frame, part);
    frame.is_over = true;
  }
  return frame.is_over;
}

absl::Status FrameAssembler::OutcomeOf(std::uint64_t sequence) const {
  const MutexLock lock(mutex_);
  if (sequence < next_) return absl::OkStatus();
  if (const auto found = frames_.find(sequence); found != frames_.end() && found->second.is_over) {
    return Missing(found->second, false);
  }
  return RefusedPart(kReasonPartLate, "sequence", absl::StrCat(sequence),
                     absl::StrCat("must be below ", next_, "; part 0 has ended the stream"));
}

std::uint64_t FrameAssembler::next_wanted() const {
  const MutexLock lock(mutex_);
  return wanted_;
}

std::uint64_t FrameAssembler::resume_sequence() const {
  const MutexLock lock(mutex_);
  return resume_;
}

}  // namespace partiemc::server
