#include "server/stream/stream_registry.h"

#include <algorithm>
#include <random>
#include <thread>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "common/printable.h"
#include "partiemc/status.h"
#include "server/base/name_pattern.h"
#include "server/stream/stream_token.h"

namespace partiemc::server {
namespace {

constexpr std::size_t kMaxLabels = 16;
constexpr std::size_t kMaxLabelBytes = 128;

absl::Status Refused(absl::StatusCode code, std::string_view reason, std::string field,
                     std::string value, std::string rule) {
  return ViolationError(code,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

bool IsNameCharacter(char c) {
  return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_' || c == '-';
}

absl::Status CheckName(const std::string& name) {
  if (name.size() <= kMaxStreamNameBytes &&
      std::all_of(name.begin(), name.end(), IsNameCharacter)) {
    return absl::OkStatus();
  }
  return Refused(absl::StatusCode::kInvalidArgument, kReasonName, "open.stream_name", Quoted(name),
                 "must be at most 128 characters of [A-Za-z0-9._-]");
}

absl::Status CheckLabels(const std::map<std::string, std::string>& labels) {
  if (labels.size() > kMaxLabels) {
    return Refused(absl::StatusCode::kInvalidArgument, kReasonLabels, "open.labels",
                   absl::StrCat(labels.size(), " labels"), "must be at most 16");
  }
  for (const auto& [key, value] : labels) {
    if (key.size() > kMaxLabelBytes || value.size() > kMaxLabelBytes) {
      return Refused(absl::StatusCode::kInvalidArgument, kReasonLabels, "open.labels", Quoted(key),
                     "must have a key and a value of at most 128 bytes each");
    }
    if (!IsPrintable(key) || !IsPrintable(value)) {
      return Refused(absl::StatusCode::kInvalidArgument, kReasonLabels, "open.labels", Quoted(key),
                     "must have a key and a value of UTF-8 without control characters");
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status NoSuchStream(const std::string& name, std::string rule) {
  return Refused(absl::StatusCode::kNotFound, kReasonNoSuchStream, "open.stream_name", Quoted(name),
                 std::move(rule));
}

StreamRegistry::StreamRegistry(std::uint32_t max_streams, HistoryRoom* history,
                               std::uint32_t max_parts)
    : max_streams_(max_streams),
      max_parts_(max_parts),
      history_(history),
      id_prefix_(absl::StrCat(absl::Hex(std::random_device{}(), absl::kZeroPad8), "-")) {}

absl::Status StreamRegistry::Enter(std::shared_ptr<StreamStateMachine> machine, Caller caller) {
  const MutexLock lock(mutex_);
  if (auto status = CheckServingLocked(); !status.ok()) return status;
  Add(std::move(machine)).caller = std::move(caller);
  return absl::OkStatus();
}

absl::StatusOr<StreamSummary> StreamRegistry::Open(const StreamStateMachine& machine,
                                                   StreamDescription description,
                                                   std::string token) {
  if (auto status = CheckName(description.name); !status.ok()) return status;
  if (auto status = CheckLabels(description.labels); !status.ok()) return status;
  if (auto status = CheckStreamToken(token); !status.ok()) return status;

  Replaced replaced;
  absl::StatusOr<StreamSummary> opened;
  {
    const MutexLock lock(mutex_);
    opened = OpenLocked(machine, std::move(description), std::move(token), replaced);
  }
  // Without the lock, because TakenOver may call Leave.
  if (replaced.machine != nullptr) replaced.machine->TakenOver();
  return opened;
}

absl::StatusOr<StreamSummary> StreamRegistry::OpenLocked(const StreamStateMachine& machine,
                                                         StreamDescription description,
                                                         std::string token, Replaced& replaced) {
  if (auto status = CheckServingLocked(); !status.ok()) return status;
  Entry& entry = entries_.at(&machine);
  Entry* const former = FindOpen(token);
  if (former != nullptr && description.name.empty()) {
    description.name = former->stream->description.name;
  }
  const std::string id = absl::StrCat(id_prefix_, opened_ + 1);
  const bool is_named = !description.name.empty();
  if (!is_named) description.name = absl::StrCat("stream-", id);
  if (auto status = entry.caller.CheckMayUse(description.name); !status.ok()) return status;
  if (auto status = CheckPlace(former, is_named ? description.name : ""); !status.ok()) {
    return status;
  }
  if (auto status = TakePlace(entry, former); !status.ok()) return status;
  replaced.frames = BeginHistory(description, former);
  entry.stream.emplace();
  entry.stream->number = ++opened_;
  entry.stream->id = id;
  entry.stream->lineage = LineageOf(token);
  entry.stream->opened = std::chrono::steady_clock::now();
  entry.stream->description = std::move(description);
  entry.token = std::move(token);
  ++changes_;
  if (const auto& assembler = entry.stream->description.assembler; assembler != nullptr) {
    assembler->SetLeader(entry.machine);
    if (tell_earlier_look_) tell_earlier_look_();
  }
  StreamSummary opened = *entry.stream;
  if (former == nullptr) return opened;
  former->taken_over = true;
  replaced.machine = former->machine;
  return opened;
}

absl::Status StreamRegistry::CheckPlace(const Entry* former, const std::string& name) const {
  std::uint32_t open_streams = 0;
  for (const auto& [key, entry] : entries_) {
    if (!entry.IsOpen() || &entry == former) continue;
    ++open_streams;
    if (!name.empty() && entry.stream->description.name == name) {
      return Refused(absl::StatusCode::kAlreadyExists, kReasonNameInUse, "open.stream_name",
                     Quoted(name),
                     "must not be the name of an open stream; choose another, or none");
    }
  }
  if (open_streams < max_streams_) return absl::OkStatus();
  return Refused(absl::StatusCode::kResourceExhausted, kReasonTooManyStreams, "streams",
                 absl::StrCat(open_streams, " open"),
                 absl::StrCat("must be at most ", max_streams_,
                              "; try again when one has ended, or start the server with a larger "
                              "--max-streams"));
}

absl::Status StreamRegistry::TakePlace(Entry& entry, Entry* former) {
  CallerAccount& account = *entry.caller.account();
  if (former != nullptr && former->place.account() == &account) {
    entry.place = std::move(former->place);
    return absl::OkStatus();
  }
  auto place = account.Take(CallerAccount::Kind::kStream);
  if (place.ok()) entry.place = *std::move(place);
  return place.status();
}

// Starts the stream's history. Called before watchers can find the stream, so that no watcher
// misses a result. Returns frames to free without the lock.
std::vector<Published> StreamRegistry::BeginHistory(const StreamDescription& description,
                                                    const Entry* former) {
  if (history_ == nullptr || description.broadcaster == nullptr) return {};
  ResultBroadcaster* const before =
      former != nullptr ? former->stream->description.broadcaster.get() : nullptr;
  return description.broadcaster->BeginHistory(*history_, before, description.next_sequence);
}

StreamRegistry::Entry* StreamRegistry::FindOpen(std::string_view token) {
  for (auto& [key, entry] : entries_) {
    if (entry.IsOpen() && SameToken(entry.token, token)) return &entry;
  }
  return nullptr;
}

absl::StatusOr<JoinedPart> StreamRegistry::JoinPart(const StreamStateMachine& machine,
                                                    const PartTerms& terms) {
  std::shared_ptr<StreamStateMachine> member;
  Caller caller;
  {
    const MutexLock lock(mutex_);
    Entry& entry = entries_.at(&machine);
    member = entry.machine;
    caller = entry.caller;
  }
  const auto stream = Find(terms.stream_name, caller);
  if (!stream.ok()) return stream.status();
  {
    const MutexLock lock(mutex_);
    if (auto status = CheckPart(stream->description, terms); !status.ok()) return status;
    if (auto status = TakePart(entries_.at(&machine), terms); !status.ok()) return status;
    if (tell_earlier_look_) tell_earlier_look_();
  }
  // Without the lock, because Join may end an earlier call of this part, which then calls Leave.
  const auto& assembler = stream->description.assembler;
  const auto seat = assembler->Join(terms.part, member);
  if (!seat.ok()) return seat.status();
  return JoinedPart{assembler, *seat, stream->id, stream->description.parameters};
}

absl::Status StreamRegistry::CheckPart(const StreamDescription& stream,
                                       const PartTerms& terms) const {
  // Checks the token first, so that a caller without the token learns nothing about the stream.
  if (!SameToken(stream.parts_token, terms.token)) {
    return Refused(absl::StatusCode::kPermissionDenied, kReasonPartsToken, "open.parts_token",
                   absl::StrCat(terms.token.size(), " characters"), "must be that of part 0");
  }
  const std::uint32_t parts = stream.assembler == nullptr ? 0 : stream.assembler->parts();
  if (parts != terms.parts) {
    return Refused(absl::StatusCode::kFailedPrecondition, kReasonPartsCount, "open.parts",
                   absl::StrCat(terms.parts), absl::StrCat("must be ", parts, ", as in part 0"));
  }
  return absl::OkStatus();
}

absl::Status StreamRegistry::TakePart(Entry& entry, const PartTerms& terms) {
  std::uint32_t senders = 0;
  std::vector<Entry*> former;
  for (auto& [key, other] : entries_) {
    if (other.part_of.empty()) continue;
    const bool is_former = other.part == terms.part && other.part_of == terms.stream_name;
    is_former ? former.push_back(&other) : void(++senders);
  }
  if (senders < max_parts_) {
    for (Entry* const replaced : former) replaced->part_of.clear();
    entry.part_of = terms.stream_name;
    entry.part = terms.part;
    return absl::OkStatus();
  }
  return Refused(
      absl::StatusCode::kResourceExhausted, kReasonTooManyParts, "streams",
      absl::StrCat(senders, " connections that send parts"),
      absl::StrCat("must be at most ", max_parts_, "; start the server with a larger --max-parts"));
}

void StreamRegistry::OnEarlierLook(std::function<void()> tell) {
  const MutexLock lock(mutex_);
  tell_earlier_look_ = std::move(tell);
}

std::optional<StreamSummary> StreamRegistry::Close(const StreamStateMachine& machine) {
  std::optional<StreamSummary> summary;
  {
    const MutexLock lock(mutex_);
    const auto found = entries_.find(&machine);
    if (found != entries_.end()) {
      found->second.place = {};
      found->second.part_of.clear();
      summary.swap(found->second.stream);
      ++changes_;
    }
  }
  if (summary) summary->counts = machine.counts();
  return summary;
}

void StreamRegistry::Leave(const StreamStateMachine& machine) {
  const MutexLock lock(mutex_);
  Remove(machine);
}

absl::StatusOr<StreamSummary> StreamRegistry::Find(const std::string& name,
                                                   const Caller& caller) const {
  if (auto status = caller.CheckMayUse(name); !status.ok()) return status;
  const MutexLock lock(mutex_);
  for (const auto& [machine, entry] : entries_) {
    if (!entry.IsOpen() || entry.stream->description.name != name) continue;
    StreamSummary summary = *entry.stream;
    summary.counts = machine->counts();
    return summary;
  }
  return NoSuchStream(name);
}

std::vector<StreamSummary> StreamRegistry::List(std::uint64_t after, std::size_t count,
                                                const Caller& caller) const {
  std::vector<StreamSummary> summaries;
  const MutexLock lock(mutex_);
  for (const auto& [machine, entry] : entries_) {
    if (!entry.IsOpen() || entry.stream->number <= after) continue;
    if (!caller.MayUse(entry.stream->description.name)) continue;
    summaries.push_back(*entry.stream);
    summaries.back().counts = machine->counts();
  }
  std::sort(summaries.begin(), summaries.end(),
            [](const auto& a, const auto& b) { return a.number < b.number; });
  if (summaries.size() > count) summaries.resize(count);
  return summaries;
}

std::size_t StreamRegistry::OpenCount() const {
  const MutexLock lock(mutex_);
  return static_cast<std::size_t>(std::count_if(
      entries_.begin(), entries_.end(), [](const auto& item) { return item.second.IsOpen(); }));
}

void StreamRegistry::SetElsewhere(std::vector<std::string> addresses) {
  const MutexLock lock(mutex_);
  elsewhere_ = std::move(addresses);
}

std::vector<std::string> StreamRegistry::TakeElsewhere() {
  const MutexLock lock(mutex_);
  if (!elsewhere_.empty())
    std::rotate(elsewhere_.begin(), elsewhere_.begin() + 1, elsewhere_.end());
  return elsewhere_;
}

void StreamRegistry::SendAway(std::chrono::milliseconds within) {
  const auto begin = std::chrono::steady_clock::now();
  auto machines = All();
  for (std::size_t k = 0; k < machines.size(); ++k) {
    machines[k]->Drain();
    machines[k].reset();
    std::this_thread::sleep_until(begin + within * (k + 1) / machines.size());
  }
  std::this_thread::sleep_until(begin + within);
}

void StreamRegistry::Drain() {
  StopAdmitting();
  for (const auto& machine : All()) machine->Drain();
}

std::chrono::steady_clock::time_point StreamRegistry::EndIdle(
    const IdleLimits& limits, std::chrono::steady_clock::time_point now) {
  return EndLate([&](StreamStateMachine& machine) { return machine.EndIfIdle(limits, now); });
}

absl::Status StreamRegistry::CheckServing() {
  const MutexLock lock(mutex_);
  return CheckServingLocked();
}

absl::Status StreamRegistry::CheckServingLocked() {
  if (!draining_) return absl::OkStatus();
  ++turned_away_;
  return DrainingError();
}

std::uint64_t StreamRegistry::turned_away() const {
  const MutexLock lock(mutex_);
  return turned_away_;
}

bool StreamRegistry::draining() const {
  const MutexLock lock(mutex_);
  return draining_;
}

}  // namespace partiemc::server
