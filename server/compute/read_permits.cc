#include "server/compute/read_permits.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "server/compute/memory_budget.h"

namespace partiemc::server {
namespace {

// A connection is idle if it receives fewer bytes than kMovingBytes within kQuiet. Even a slow
// connection reaches more than 16 kB/s, and a busy client needs less than one second to begin a
// message. If the system does not report received bytes, a read is idle after kQuietUnknown.
constexpr std::uint64_t kMovingBytes = 16 << 10;
constexpr std::chrono::milliseconds kQuiet(1000), kQuietUnknown(2000);

// Bytes that a connection may receive in addition to the expected message: HTTP/2 frames, pings,
// other calls.
constexpr std::uint64_t kBeside = 1 << 20;

absl::Status OutOfMemoryForReads() {
  return absl::UnavailableError(
      "the server has no memory for the frames that are on their way: connect again; the next "
      "frame is read when there is room");
}

}  // namespace

ReadPermits::ReadPermits(MemoryBudget& budget, const ReadTerms& terms)
    : budget_(budget),
      terms_{.streams_beyond = std::max(terms.streams_beyond, 1u),
             .message_bytes = std::max<std::uint64_t>(terms.message_bytes, 1)} {}

std::uint64_t ReadPermits::PlannedBytes(std::uint64_t expected_bytes) const {
  if (expected_bytes == 0) return terms_.message_bytes;
  return std::min(expected_bytes, terms_.message_bytes);
}

ReadPermits::Permit& ReadPermits::Renew(const std::shared_ptr<Reader>& reader, Read read) {
  auto& item = *permits_.try_emplace(reader.get()).first;
  Finish(item);
  item.second = {.reader = reader, .read = std::move(read), .number = ++numbers_};
  ++waiting_;  // Before TryPlan, so that a thread that frees memory after TryPlan serves this read.
  return item.second;
}

bool ReadPermits::Begin(const std::shared_ptr<Reader>& reader, Read read) {
  bool begins = false;
  {
    const MutexLock lock(mutex_);
    Renew(reader, std::move(read));
    begins = TryPermit(*permits_.find(reader.get()), /*may_open_slot=*/waiting_ == 1);
  }
  if (!begins || NeedsLook()) TellWaiting();
  return begins;
}

bool ReadPermits::MayReadAhead(const Reader& reader) {
  const MutexLock lock(mutex_);
  const auto found = permits_.find(&reader);
  if (found == permits_.end()) return true;
  FreeSlotIfFits(found->first, found->second);
  return !found->second.has_slot;
}

void ReadPermits::BeginNow(const std::shared_ptr<Reader>& reader, Read read) {
  const MutexLock lock(mutex_);
  Permit& permit = Renew(reader, std::move(read));
  permit.state = State::kReading;
  permit.planned = PlannedBytes(permit.read.expected_bytes);
  budget_.Plan(permit.planned, permit.read.caller);
  --waiting_;
  ++reading_;
}

absl::Status ReadPermits::Came(const Reader& reader, std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  const auto found = permits_.find(&reader);
  if (found == permits_.end() || found->second.state != State::kReading) return absl::OkStatus();
  Permit& permit = found->second;
  permit.state = State::kHolding;
  --reading_;
  Unplan(permit);
  if (std::exchange(permit.has_lapsed, false)) {
    --lapsed_;
    return budget_.CheckHeld(bytes, permit.read.caller);
  }
  if (!permit.has_slot) return absl::OkStatus();
  Slot& slot = slots_.at(permit.read.stream);
  slot.reading = false;
  slot.bytes += bytes;
  SetBeyond(permit, std::min(bytes, terms_.message_bytes));
  return absl::OkStatus();
}

void ReadPermits::End(const Reader& reader) {
  const MutexLock lock(mutex_);
  const auto found = permits_.find(&reader);
  if (found == permits_.end()) return;
  Finish(*found);
  permits_.erase(found);
}

void ReadPermits::Unplan(Permit& permit) {
  budget_.Unplan(std::exchange(permit.planned, 0), permit.read.caller);
  changed_ = true;
}

void ReadPermits::SetBeyond(Permit& permit, std::uint64_t bytes) {
  budget_.ChangeBeyond(std::exchange(permit.beyond, bytes), bytes);
}

// Releases the planned bytes and the slot of a permit. Called when its reader requests another
// permit, or ends.
void ReadPermits::Finish(Permits::value_type& item) {
  Permit& permit = item.second;
  if (permit.number == 0) return;  // The permit was just created.
  changed_ = true;
  if (permit.state == State::kWaiting) --waiting_;
  if (permit.state == State::kReading) --reading_;
  if (permit.planned > 0) Unplan(permit);
  if (std::exchange(permit.has_lapsed, false)) --lapsed_;
  LeaveSlot(item.first, permit);
}

bool ReadPermits::TryPermit(Permits::value_type& item, bool may_open_slot) {
  Permit& permit = item.second;
  const std::uint64_t expected = PlannedBytes(permit.read.expected_bytes);
  if (!budget_.TryPlan(expected, permit.read.caller)) {
    Slot* const slot = FindSlot(item, may_open_slot);
    if (slot == nullptr) return false;
    slot->reading = permit.has_slot = true;
    slot->used.insert(item.first);
    slot->open.insert(item.first);
    SetBeyond(permit, expected);
    budget_.Plan(expected, permit.read.caller);
  }
  permit.planned = expected;
  permit.state = State::kReading;
  --waiting_;
  ++reading_;
  return true;
}

// Returns the slot with which this connection may read beyond the budget; null if there is none.
ReadPermits::Slot* ReadPermits::FindSlot(const Permits::value_type& item, bool may_open_slot) {
  const auto found = slots_.find(item.second.read.stream);
  if (found != slots_.end()) {
    Slot& slot = found->second;
    const bool may_read =
        !slot.reading && slot.bytes < terms_.message_bytes && !slot.used.contains(item.first);
    return may_read ? &slot : nullptr;
  }
  if (!may_open_slot || slots_.size() >= terms_.streams_beyond) return nullptr;
  return &slots_[item.second.read.stream];
}

// Frees the slot if its bytes now fit into the budget and into the share of their caller.
void ReadPermits::FreeSlotIfFits(const Reader* reader, Permit& permit) {
  if (permit.has_slot && budget_.FitsWithout(permit.beyond, permit.read.caller)) {
    LeaveSlot(reader, permit);
  }
}

void ReadPermits::FreeSlots() {
  for (auto& [reader, permit] : permits_) FreeSlotIfFits(reader, permit);
}

void ReadPermits::LeaveSlot(const Reader* reader, Permit& permit) {
  if (!std::exchange(permit.has_slot, false)) return;
  changed_ = true;
  SetBeyond(permit, 0);
  const auto slot = slots_.find(permit.read.stream);
  if (permit.state == State::kReading) slot->second.reading = false;
  slot->second.open.erase(reader);
  if (slot->second.open.empty()) slots_.erase(slot);
}

// Permits the first waiting read that fits (rule 4). Returns null if no read fits.
std::shared_ptr<ReadPermits::Reader> ReadPermits::PermitNext() {
  std::map<const CallerAccount*, std::size_t> slots_of;
  for (const auto& [reader, permit] : permits_) {
    if (permit.has_slot) ++slots_of[permit.read.caller];
  }
  // Computes the ranks before the sort: other threads may change a caller's bytes during the sort.
  using Rank = std::tuple<bool, std::size_t, std::uint64_t, std::uint64_t>;
  std::vector<std::pair<Rank, Permits::value_type*>> waiting;
  for (auto& item : permits_) {
    const Permit& permit = item.second;
    if (permit.state != State::kWaiting) continue;
    const CallerAccount* const caller = permit.read.caller;
    // Streams that have a slot come first, because their reads complete frames.
    waiting.push_back({{!slots_.contains(permit.read.stream), slots_of[caller],
                        budget_.PlannedBy(caller), permit.number},
                       &item});
  }
  std::ranges::sort(waiting);
  for (auto& [rank, item] : waiting) {
    auto reader = item->second.reader.lock();
    if (reader != nullptr && TryPermit(*item, true)) return reader;
  }
  return nullptr;
}

void ReadPermits::Serve() {
  if (!changed_.exchange(false)) return;
  budget_.Grant();
  ServeWaiting();
}

void ReadPermits::ServeWaiting() {
  if (waiting_ == 0) return;
  std::vector<std::shared_ptr<Reader>> permitted;
  {
    const MutexLock lock(mutex_);
    FreeSlots();
    while (waiting_ > 0) {
      auto reader = PermitNext();
      if (reader == nullptr) break;
      permitted.push_back(std::move(reader));
    }
  }
  for (const auto& reader : permitted) reader->ReadPermitted();
}

bool ReadPermits::NeedsLook() const {
  if (NeedsBytes()) return true;
  const std::uint64_t most = budget_.bytes() + terms_.streams_beyond * terms_.message_bytes;
  const std::uint64_t planned = budget_.planned();
  return planned > most || (most - planned) / terms_.message_bytes < reading_;
}

void ReadPermits::OnWaiting(std::function<void()> tell) {
  const MutexLock lock(tell_mutex_);
  tell_waiting_ = std::move(tell);
}

void ReadPermits::TellWaiting() const {
  const MutexLock lock(tell_mutex_);
  if (tell_waiting_) tell_waiting_();
}

void ReadPermits::Measure(Permit& permit, Clock::time_point now, const ReceivedBytes& received) {
  const auto bytes = received(permit.read.peer);
  permit.grown = 0;
  if (bytes && permit.received) {
    permit.grown = *bytes - std::min(*bytes, *permit.received);
    permit.came += permit.grown;
  }
  if (!permit.moved || permit.grown >= kMovingBytes) permit.moved = now;
  if (bytes && (!permit.received || permit.grown >= kMovingBytes)) {
    permit.received = bytes;
  } else {
    permit.came -= permit.grown;  // Too few bytes so far. The next Look counts them again.
  }
}

void ReadPermits::LapseOrCover(Permits::value_type& item, Clock::time_point now) {
  Permit& permit = item.second;
  const auto quiet = permit.received ? kQuiet : kQuietUnknown;
  if (now - *permit.moved >= quiet) {
    if (waiting_ == 0 || permit.has_lapsed) return;
    Unplan(permit);
    permit.has_lapsed = true;
    ++lapsed_;
    LeaveSlot(item.first, permit);
    return;
  }
  if (permit.came <= permit.planned + kBeside || permit.planned >= terms_.message_bytes) return;
  const std::uint64_t most =
      permit.has_lapsed ? PlannedBytes(permit.read.expected_bytes) : terms_.message_bytes;
  const std::uint64_t more = most - std::min(most, permit.planned);
  if (more == 0 || !budget_.TryPlan(more, permit.read.caller)) return;
  permit.planned += more;
  if (std::exchange(permit.has_lapsed, false)) --lapsed_;
}

void ReadPermits::Look(Clock::time_point now, const ReceivedBytes& received) {
  {
    const MutexLock lock(mutex_);
    for (auto& item : permits_) {
      if (item.second.state != State::kReading) continue;
      Measure(item.second, now, received);
      LapseOrCover(item, now);
    }
  }
  Serve();
}

bool ReadPermits::IsAtRisk(const Permit& permit) const {
  if (permit.state != State::kReading || permit.planned >= terms_.message_bytes) return false;
  return permit.received ? permit.grown >= kMovingBytes || permit.came > permit.planned + kBeside
                         : permit.has_lapsed;
}

std::size_t ReadPermits::Revoke(std::uint64_t free_bytes) {
  std::vector<std::shared_ptr<Reader>> revoked;
  {
    const MutexLock lock(mutex_);
    // Sorts each caller's reads by received bytes, most first. Then takes the first read of every
    // caller, the second read of every caller, and so on. The first reads of this order continue;
    // the other reads are ended.
    std::map<const CallerAccount*, std::vector<const Permit*>> of_caller;
    for (const auto& [reader, permit] : permits_) {
      if (IsAtRisk(permit)) of_caller[permit.read.caller].push_back(&permit);
    }
    std::vector<std::pair<std::size_t, const Permit*>> in_turn;
    for (auto& [caller, reads] : of_caller) {
      std::ranges::sort(reads, std::ranges::greater(), &Permit::came);
      for (std::size_t k = 0; k < reads.size(); ++k) in_turn.emplace_back(k, reads[k]);
    }
    std::ranges::stable_sort(in_turn, {}, &std::pair<std::size_t, const Permit*>::first);
    for (std::size_t k = free_bytes / terms_.message_bytes; k < in_turn.size(); ++k) {
      if (auto reader = in_turn[k].second->reader.lock()) revoked.push_back(std::move(reader));
    }
  }
  for (const auto& reader : revoked) reader->ReadRevoked(OutOfMemoryForReads());
  return revoked.size();
}

std::size_t ReadPermits::streams_beyond() const {
  const MutexLock lock(mutex_);
  return slots_.size();
}

}  // namespace partiemc::server
