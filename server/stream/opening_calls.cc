#include "server/stream/opening_calls.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

constexpr char kMoreThanMemory[] = "more than there is memory for";

absl::Status TooManyOpening(std::string found) {
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonTooManyOpening), "calls without a request", std::move(found),
       "must send the first request at once: of the caller with most of them the oldest gives way; "
       "try again"});
}

absl::Status TooManyWatchers() {
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonTooManyOpening), "watchers", kMoreThanMemory,
       "must be fewer for now: of the caller with most of them those give way that have sent "
       "nothing for longest; try again"});
}

}  // namespace

OpeningCalls::Place::~Place() {
  if (calls_ == nullptr) return;
  GiveWay forgotten;  // Destroyed after the lock is released.
  const MutexLock lock(calls_->mutex_);
  forgotten = lines_->Remove(caller_, number_);
}

OpeningCalls::Lines::Rank OpeningCalls::Lines::RankOf(const Line& line) {
  return {line.size(), -static_cast<std::int64_t>(line.begin()->first)};
}

void OpeningCalls::Lines::Add(const CallerAccount* caller, std::uint64_t number, GiveWay give_way) {
  Line& line = lines_[caller];
  if (!line.empty()) ranks_.erase(RankOf(line));
  line.emplace(number, std::move(give_way));
  ranks_.emplace(RankOf(line), caller);
  ++count_;
}

OpeningCalls::GiveWay OpeningCalls::Lines::Remove(const CallerAccount* caller,
                                                  std::uint64_t number) {
  const auto line = lines_.find(caller);
  if (line == lines_.end()) return {};
  const auto call = line->second.find(number);
  if (call == line->second.end()) return {};
  ranks_.erase(RankOf(line->second));
  GiveWay give_way = std::move(call->second);
  line->second.erase(call);
  if (line->second.empty()) {
    lines_.erase(line);
  } else {
    ranks_.emplace(RankOf(line->second), caller);
  }
  --count_;
  return give_way;
}

OpeningCalls::GiveWay OpeningCalls::Lines::RemoveNext() {
  const CallerAccount* const most = ranks_.rbegin()->second;
  return Remove(most, lines_.at(most).begin()->first);
}

std::vector<OpeningCalls::GiveWay> OpeningCalls::Lines::RemoveHalf() {
  std::vector<GiveWay> removed;
  if (ranks_.empty()) return removed;
  const CallerAccount* const most = ranks_.rbegin()->second;
  for (std::size_t left = (lines_.at(most).size() + 1) / 2; left > 0; --left) {
    removed.push_back(Remove(most, lines_.at(most).begin()->first));
  }
  return removed;
}

void OpeningCalls::GiveWayToAll() {
  std::vector<GiveWay> evicted;
  {
    const MutexLock lock(mutex_);
    evicted = opening_.RemoveHalf();
  }
  for (const GiveWay& evict : evicted) evict(TooManyOpening(kMoreThanMemory));
}

void OpeningCalls::WatchersGiveWay() {
  std::vector<GiveWay> evicted;
  {
    const MutexLock lock(mutex_);
    evicted = watchers_.RemoveHalf();
  }
  for (const GiveWay& evict : evicted) evict(TooManyWatchers());
}

bool OpeningCalls::WaitForOne(const std::function<bool()>& also) {
  const MutexLock lock(mutex_);
  waits_for_one_ = true;
  while (!stopped_ && opening_.count() == 0 && watchers_.count() == 0 && !also()) {
    one_came_.Wait(mutex_);
  }
  waits_for_one_ = false;
  return !stopped_;
}

void OpeningCalls::LookAgain() {
  const MutexLock lock(mutex_);
  if (waits_for_one_) one_came_.NotifyOne();
}

void OpeningCalls::StopWaiting() {
  const MutexLock lock(mutex_);
  stopped_ = true;
  one_came_.NotifyOne();
}

OpeningCalls::Place OpeningCalls::Take(Lines& lines, const CallerAccount& caller,
                                       GiveWay give_way) {
  Place place;
  place.calls_ = this;
  place.lines_ = &lines;
  place.caller_ = &caller;
  place.number_ = ++came_;
  lines.Add(&caller, place.number_, std::move(give_way));
  if (waits_for_one_) one_came_.NotifyOne();
  return place;
}

OpeningCalls::Place OpeningCalls::Enter(const CallerAccount& caller, GiveWay give_way) {
  Place place;
  GiveWay other;
  {
    const MutexLock lock(mutex_);
    // Evicts before it adds the new call, so that the new call does not count against its own
    // caller.
    if (opening_.count() >= std::max<std::size_t>(places_, 1)) other = opening_.RemoveNext();
    place = Take(opening_, caller, std::move(give_way));
  }
  if (other) other(TooManyOpening(absl::StrCat("more than ", places_)));
  return place;
}

OpeningCalls::Place OpeningCalls::EnterWatcher(const CallerAccount& caller, GiveWay give_way) {
  const MutexLock lock(mutex_);
  return Take(watchers_, caller, std::move(give_way));
}

std::size_t OpeningCalls::count() const {
  const MutexLock lock(mutex_);
  return opening_.count();
}

}  // namespace partiemc::server
