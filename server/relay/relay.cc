#include "server/relay/relay.h"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/base/call_errors.h"
#include "server/relay/local_streams.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kTickEvery(50);
constexpr seconds kAnnounceEvery(1);
// A replica counts as lost after this time without an announcement, so after three missing ones.
constexpr seconds kReplicaPatience(3);
// An incomplete message is dropped if none of its pieces arrives within this time. It may be kept
// for twice this time.
constexpr seconds kPiecePatience(3);
// Time for which the knowledge about other replicas is kept while the bus is disconnected.
constexpr seconds kBusPatience(30);
// A stream is exported for this time after each fetch.
constexpr seconds kExportLease(3);
// While new results of this server's streams wait to be sent, they have priority: the relay
// responds to one fetch in this interval. A response has up to 4 MiB.
constexpr milliseconds kAnswerEvery(20);
// Time for which the end of a stream is kept, so that replicas that were disconnected can fetch it.
constexpr seconds kEndKept(30);
// If a replica no longer announces a stream, it gets this time to report the stream's end.
constexpr seconds kLastWord(2);
// Time that other replicas get, after this one has connected, to connect and to announce.
constexpr milliseconds kSettle(300);
// Timeout of a search for a stream, and the interval between the requests for announcements during
// a search.
constexpr milliseconds kSearchPatience(1500), kAskEvery(100);
// Time that this replica gets for its first connection to the bus.
constexpr seconds kFirstConnection(2);
// A drain waits until the results of this server's streams are sent: at most kDrainPatience since
// the last one, and at most kSendPatience in total.
constexpr milliseconds kDrainPatience(300), kSendPatience(900);
// Maximum time for which Drain waits, even if the bus blocks.
constexpr seconds kLongestDrain(2);
// Capacities of the relay's queue in bytes: for news (which contain results), and for fetches.
constexpr std::array kQueueBytes = {std::size_t{64} << 20, std::size_t{4} << 20};
// Messages of up to this size are accepted, or larger ones if results may be larger.
constexpr std::size_t kMaxMessageBytes = std::size_t{64} << 20;

// Maximum number of imports of one stream that has not ended. Each has a history.
constexpr std::size_t kMaxImports = 2;

// The text of the error NO_SUCH_STREAM while the streams of other replicas are unknown.
constexpr char kOnlyHere[] =
    "must be the name of an open stream of this server: NATS cannot be reached, so that those of "
    "other replicas cannot be watched here; try again";

}  // namespace

Relay::Relay(std::unique_ptr<MessageBus> bus, StreamRegistry& registry, WatchDispatcher& dispatcher,
             const Limits& limits, std::string address, const TimeAndChance& surroundings)
    : clock_(*surroundings.clock),
      replica_(absl::StrCat(absl::Hex(surroundings.random->Next(), absl::kZeroPad16))),
      address_(std::move(address)),
      limits_(limits),
      registry_(registry),
      dispatcher_(dispatcher),
      bus_(std::move(bus)),
      queue_(std::make_shared<RelayQueue>(kQueueBytes, clock_)),
      joiner_(std::max(kMaxMessageBytes, limits.watcher_bytes + kPieceBytes)),
      thread_([this] { Run(); }) {
  pthread_setname_np(thread_.native_handle(), "relay");
}

Relay::~Relay() {
  Drain();
  queue_->Stop();
  thread_.join();
}

void Relay::Post(std::function<void()> action) { queue_->Post(std::move(action)); }

bool Relay::Send(const std::string& subject, relay::v1::RelayMessage& message) {
  message.set_replica(replica_);
  const bool sent =
      SendInPieces(replica_, ++sent_, message.SerializeAsString(),
                   [&](std::string_view piece) { return bus_->Publish(subject, piece); });
  if (!sent) ++unsent_;
  return sent;
}

void Relay::Run() {
  using Queue = RelayQueue;
  subscriptions_.push_back(queue_->Listen(*bus_, kReplicasSubject, Queue::kNews));
  subscriptions_.push_back(queue_->Listen(*bus_, SubjectOfAnswers(replica_), Queue::kNews));
  subscriptions_.push_back(queue_->Listen(*bus_, SubjectOfAsking(replica_), Queue::kAsked));
  const auto patience = [this] { return fetches_.empty() ? kTickEvery : milliseconds(0); };
  for (Queue::Work work; queue_->Take(patience(), work); work = {}) {
    for (const auto& action : work.actions) action();
    for (const std::string& piece : work.messages[Queue::kNews]) Take(piece);
    for (const std::string& piece : work.messages[Queue::kAsked]) OnAskedPiece(piece);
    const auto now = clock_.Now();
    if (!work.actions.empty()) acted_ = now;
    // A drain sends all results before it responds to a fetch.
    const bool is_due = !draining_since_ && now - answered_ >= kAnswerEvery;
    if (work.actions.empty() || is_due) AnswerNextFetch(now);
    if (std::exchange(was_asked_, false)) Announce(now, false, false);
    if (changed_ || now - ticked_ >= kTickEvery || draining_since_) Tick(now);
  }
  subscriptions_.clear();
  imports_.clear();
}

void Relay::Tick(TimePoint now) {
  ticked_ = now;
  CheckConnection(now);
  if (UpdateLocalStreams() || now - announced_ >= kAnnounceEvery) Announce(now, false, false);
  if (now - pieces_checked_ >= kPiecePatience) {
    pieces_checked_ = now;
    joiner_.ForgetIdle();
    asked_joiner_.ForgetIdle();
  }
  if (std::exchange(changed_, false)) EndTakenOver();
  LookAtExports(now);
  LookAtImports(now);
  LookAtSearches(now);
  if (draining_since_) GoOnDraining(now);
}

void Relay::CheckConnection(TimePoint now) {
  const bool is_connected = bus_->connected();
  if (is_connected && !connected_) {
    connected_since_ = now;
    directory_.Refresh(now);
    LogEvent(spdlog::level::info, "NATS connected", {{"replica", replica_}});
    Announce(now, true, false);
    for (Import& import : imports_) import.stream->FetchAgain(now);
    for (auto& [id, exported] : exports_) exported->WantedUntil(now + kExportLease);
  } else if (!is_connected && connected_) {
    disconnected_ = now;
    loss_logged_ = true;
    LogEvent(spdlog::level::warn,
             "NATS lost: streams of other replicas stand still for their watchers here, streams of "
             "this one for those elsewhere",
             {});
  }
  if (!is_connected && !loss_logged_ && now - began_ > kFirstConnection) {
    loss_logged_ = true;
    LogEvent(spdlog::level::warn,
             "NATS cannot be reached yet: only streams of this replica can be "
             "watched here",
             {});
  }
  connected_ = is_connected;
  if (!is_connected && now - disconnected_ < kBusPatience) directory_.Refresh(now);
  for (const std::string& replica : directory_.Expire(now - kReplicaPatience)) {
    LogEvent(spdlog::level::warn, "replica gone", {{"replica", replica}});
    Lost(replica);
  }
}

void Relay::Announce(TimePoint now, bool asks, bool leaving) {
  announced_ = now;
  if (has_drained_ || (!connected_ && !bus_->connected())) return;
  relay::v1::RelayMessage message;
  relay::v1::Announcement& announcement = *message.mutable_announcement();
  announcement.set_asks(asks);
  announcement.set_leaving(leaving);
  announcement.set_address(address_);
  announcement.set_draining(will_drain_);
  if (!leaving) local_.Announce(now, announcement);
  Send(kReplicasSubject, message);
}

bool Relay::UpdateLocalStreams() {
  if (!local_.Update()) return false;
  changed_ = true;
  return true;
}

// Handles producers that have resumed their stream at another replica. The replica of the former
// stream may not have detected yet that its producer has left. Ends the watches of the former
// stream, so that the watchers find the new one.
void Relay::EndTakenOver() {
  const WatchEnd taken_over{
      std::string(kReasonTakenOver), "another replica has the stream now", {}};
  local_.EndTakenOver(directory_, taken_over);
  for (Import& import : imports_) {
    const RemoteStream& remote = import.stream->stream();
    const auto elsewhere = directory_.FindLineage(remote.stream.lineage());
    const bool is_elsewhere = elsewhere && elsewhere->id() != remote.id() &&
                              elsewhere->stream.opened_unix_ms() > remote.stream.opened_unix_ms();
    if (is_elsewhere || local_.HasTakenOver(remote.stream)) {
      import.stream->End(taken_over);
    }
  }
}

bool Relay::WasResumedElsewhere(std::string_view lineage, TimePoint opened) const {
  const auto elsewhere = directory_.FindLineage(lineage);
  return elsewhere && elsewhere->stream.opened_unix_ms() > UnixMs(clock_, opened);
}

std::vector<relay::v1::LiveStream> Relay::List(const std::string& after, std::size_t count,
                                               const Caller& caller) const {
  std::map<std::string, std::int64_t> here;  // Opening time by lineage.
  for (const StreamSummary& stream : registry_.List(0, std::numeric_limits<std::size_t>::max())) {
    here[stream.lineage] = UnixMs(clock_, stream.opened);
  }
  return directory_.List(after, count, [&](const relay::v1::LiveStream& stream) {
    const auto found = here.find(stream.lineage());
    return caller.MayUse(stream.summary().stream_name()) &&
           (found == here.end() || found->second < stream.opened_unix_ms());
  });
}

void Relay::LookAtExports(TimePoint now) {
  for (auto it = exports_.begin(); it != exports_.end();) {
    ExportedStream& exported = *it->second;
    // Keeps all exports while the bus is disconnected, for at most kBusPatience, because replicas
    // cannot renew their requests for results.
    const bool may_be_wanted = !connected_ && now - disconnected_ < kBusPatience;
    const bool has_news = exported.ended_at() && now - *exported.ended_at() < kEndKept;
    const bool is_wanted = now < exported.wanted_until() || may_be_wanted || has_news;
    // Waits for kSettle after a reconnection: the other replicas reconnect at the same time, and
    // pending results must not be sent before they have subscribed.
    if (connected_ && connected_since_ && now - *connected_since_ > kSettle) exported.Retry();
    if (!is_wanted && exported.live()) exported.End();
    if (is_wanted || exported.live()) {
      ++it;
    } else {
      it = exports_.erase(it);
    }
  }
  exported_count_ = exports_.size();
}

void Relay::LookAtImports(TimePoint now) {
  for (Import& import : imports_) {
    const RemoteStream& remote = import.stream->stream();
    import.stream->Tick(now, connected_);
    if (directory_.Has(remote.replica, remote.id())) {
      import.missing_since.reset();
    } else if (!import.missing_since) {
      import.missing_since = now;
      import.stream->FetchAgain(now);
    } else if (now - *import.missing_since > kLastWord) {
      import.stream->Lost(
          {std::string(kReasonProducerLost), "the producer's connection is gone", {}}, now);
    }
  }
  std::erase_if(imports_, [now](const Import& import) { return import.stream->IsIdle(now); });
  imported_count_ = imports_.size();
}

void Relay::Lost(const std::string& replica) {
  changed_ = true;
  joiner_.Forget(replica);
  for (Import& import : imports_) {
    if (import.stream->stream().replica != replica) continue;
    import.stream->Lost({std::string(kReasonProducerLost), "the server of the stream was lost", {}},
                        clock_.Now());
  }
}

void Relay::Take(const std::string& piece) {
  const auto whole = joiner_.Add(piece);
  relay::v1::RelayMessage message;
  if (!whole || !message.ParseFromString(*whole) || message.replica() == replica_) return;
  const auto now = clock_.Now();
  const auto tell = [&](const std::string& id, auto action) {
    for (Import& import : imports_) {
      const RemoteStream& remote = import.stream->stream();
      if (remote.id() == id && remote.replica == message.replica()) action(*import.stream);
    }
  };
  using Message = relay::v1::RelayMessage;
  switch (message.message_case()) {
    case Message::kAnnouncement:
      return Take(message.replica(), message.announcement());
    case Message::kFetchEnd:
      return tell(message.fetch_end().stream_id(),
                  [&](ImportedStream& stream) { stream.OnMessage(message.fetch_end(), now); });
    case Message::kResult:
      return tell(message.result().stream_id(), [&](ImportedStream& stream) {
        stream.OnMessage(*message.mutable_result(), now);
      });
    case Message::kStreamEnd:
      return tell(message.stream_end().stream_id(),
                  [&](ImportedStream& stream) { stream.OnMessage(message.stream_end(), now); });
    case Message::kFetch:  // OnAskedPiece receives fetches.
    case Message::MESSAGE_NOT_SET:
      break;
  }
}

void Relay::Take(const std::string& replica, const relay::v1::Announcement& announcement) {
  if (announcement.leaving()) {
    directory_.Left(replica);
    return Lost(replica);
  }
  const auto now = clock_.Now();
  if (directory_.Announced(replica, announcement, now)) changed_ = true;
  // One announcement is the response to all pending requests for announcements. While this server
  // drains, it does not respond: its next announcement, after the ends of its streams, reports that
  // it leaves.
  if (!announcement.asks() || draining_since_) return;
  UpdateLocalStreams();
  was_asked_ = true;
}

// Receives a piece of a fetch. The fetch renews the lease of the export at once, before the relay
// responds to it.
void Relay::OnAskedPiece(const std::string& piece) {
  const auto whole = asked_joiner_.Add(piece);
  relay::v1::RelayMessage message;
  if (!whole || !message.ParseFromString(*whole) || !message.has_fetch() ||
      message.replica() == replica_) {
    return;
  }
  const auto exported = exports_.find(message.fetch().stream_id());
  if (exported != exports_.end()) exported->second->WantedUntil(clock_.Now() + kExportLease);
  fetches_.Add(message.replica(), message.fetch());
  dropped_fetches_ = fetches_.dropped();
}

void Relay::AnswerNextFetch(TimePoint now) {
  answered_ = now;
  if (const auto next = fetches_.TakeNext()) Answer(next->replica, next->fetch);
}

void Relay::Answer(const std::string& replica, const relay::v1::Fetch& fetch) {
  UpdateLocalStreams();
  auto broadcaster = local_.BroadcasterOf(fetch.stream_id());
  auto exported = exports_.find(fetch.stream_id());
  const bool is_over = exported == exports_.end() || !exported->second->live();
  if (broadcaster != nullptr && is_over && !draining_since_) {
    exported =
        exports_
            .insert_or_assign(fetch.stream_id(),
                              std::make_shared<ExportedStream>(
                                  fetch.stream_id(), std::move(broadcaster), limits_.watcher_bytes,
                                  static_cast<RelayPort&>(*this), clock_))
            .first;
    exported->second->Begin();
  }
  if (exported == exports_.end()) {
    relay::v1::RelayMessage message;
    relay::v1::FetchEnd& end = *message.mutable_fetch_end();
    end.set_stream_id(fetch.stream_id());
    end.set_fetch(fetch.fetch());
    end.set_gone(true);
    Send(SubjectOfAnswers(replica), message);
    return;
  }
  exported->second->WantedUntil(clock_.Now() + kExportLease);
  exported->second->Retry();
  exported->second->Answer(fetch, replica);
}

void Relay::Find(const std::string& name, std::optional<std::uint64_t> from_sequence,
                 FindDone done) {
  if (refuses_) return done(DrainingError());
  Post(
      [this, search = Search{
                 .name = name, .from_sequence = from_sequence, .done = std::move(done)}]() mutable {
        if (draining_since_) return search.done(DrainingError());
        const auto now = clock_.Now();
        // Waits longer if this replica has just connected: it does not know the others yet.
        const auto settled = connected_since_ ? *connected_since_ : began_ + kFirstConnection;
        search.began = now;
        search.settled = settled + kSettle;
        search.until = std::max(now, settled) + kSearchPatience;
        if (TryFind(search, now)) return;
        if (searches_.size() >= limits_.watches) {
          return search.done(NoSuchStream(
              search.name, absl::StrCat("must be one of at most ", limits_.watches,
                                        " names that are looked for at other replicas at once")));
        }
        searches_.push_back(std::move(search));
      });
}

bool Relay::TryFind(const Search& search, TimePoint now) {
  const auto remote = directory_.FindName(search.name);
  if (!remote || local_.HasTakenOver(remote->stream)) return false;
  Watch(*remote, search, now);
  return true;
}

void Relay::Watch(const RemoteStream& remote, const Search& search, TimePoint now) {
  // A second import fetches the whole history, so that it suffices for all further watchers.
  std::size_t imports = 0;
  ImportedStream* stream = nullptr;
  for (const Import& import : imports_) {
    if (import.stream->stream().id() != remote.id() || import.stream->ended()) continue;
    ++imports;
    stream = import.stream.get();
    if (stream->Covers(search.from_sequence, now)) break;
    if (imports < kMaxImports) stream = nullptr;
  }
  if (stream == nullptr) {
    // Subscribes to the results before it fetches earlier ones, so that no result in between is
    // missed.
    Import import;
    import.results = queue_->Listen(*bus_, SubjectOfResults(remote.id()), RelayQueue::kNews);
    import.stream = std::make_unique<ImportedStream>(
        remote, imports == 0 ? search.from_sequence : 0, dispatcher_,
        ImportedStream::Limits{.broadcaster = limits_.broadcaster,
                               .waiting_bytes = limits_.watcher_bytes,
                               .history = limits_.history,
                               .finished = limits_.finished},
        static_cast<RelayPort&>(*this), now);
    stream = import.stream.get();
    imports_.push_back(std::move(import));
  }
  stream->Await([done = search.done,
                 found = Found{stream->broadcaster(), remote.stream}](const absl::Status& status) {
    done(status.ok() ? absl::StatusOr<Found>(found) : status);
  });
}

void Relay::LookAtSearches(TimePoint now) {
  // Requests announcements again, because the stream may have been opened just now.
  if (!searches_.empty() && connected_ && now - asked_ > kAskEvery) {
    asked_ = now;
    Announce(now, true, false);
  }
  for (Search& search : std::exchange(searches_, {})) {
    if (TryFind(search, now)) continue;
    const bool all_have_said = now > search.settled && connected_ && asked_ >= search.began &&
                               directory_.HaveAllAnnouncedSince(asked_);
    if (now < search.until && !all_have_said) {
      searches_.push_back(std::move(search));
    } else {
      search.done(connected_ ? NoSuchStream(search.name) : NoSuchStream(search.name, kOnlyHere));
    }
  }
}

void Relay::WillDrain() {
  Post([this] {
    will_drain_ = true;
    announced_ = {};  // Announces at the next tick.
  });
}

void Relay::Drain() {
  std::call_once(drain_once_, [this] {
    refuses_ = true;
    Post([this] { draining_since_ = clock_.Now(); });
    drained_.get_future().wait_for(kLongestDrain);
  });
}

void Relay::GoOnDraining(TimePoint now) {
  if (has_drained_) return;
  for (const Search& search : std::exchange(searches_, {})) search.done(DrainingError());
  for (Import& import : imports_) import.stream->Refuse(DrainingError());
  const bool has_more = !fetches_.empty() || std::ranges::any_of(exports_, [](const auto& item) {
    return item.second->live();
  });
  const auto idle = now - std::max(*draining_since_, acted_);
  if (has_more && idle < kDrainPatience && now - *draining_since_ < kSendPatience) {
    // Streams that have not ended by now end with this server.
    if (idle > kDrainPatience / 2) {
      for (auto& [id, exported] : exports_) exported->End();
    }
    return;
  }
  for (auto& [id, exported] : exports_) exported->End();
  Announce(now, false, true);
  bus_->Flush();
  has_drained_ = true;
  drained_.set_value();
}

}  // namespace partiemc::server
