// What makes every replica able to show the streams of all of them: each announces those that it
// has, and publishes the results of a stream while somebody watches it elsewhere.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/relay/exported_stream.h"
#include "server/relay/fetch_queue.h"
#include "server/relay/imported_stream.h"
#include "server/relay/message_bus.h"
#include "server/relay/pieces.h"
#include "server/relay/relay_port.h"
#include "server/relay/relay_queue.h"
#include "server/relay/stream_directory.h"
#include "server/stream/stream_registry.h"

namespace partiemc::server {

/// The public part is safe from any thread; all else is done by the relay's own. Messages of other
/// replicas beyond what its queues hold are lost, and fetched again. The work of this server comes
/// first, then messages, then one fetch at a time: a peer that floods delays neither results nor a
/// drain for long.
class Relay final : private RelayPort {
 public:
  using Clock = std::chrono::steady_clock;

  struct Limits {
    ResultBroadcaster::Limits broadcaster;  ///< Of streams of other replicas.
    std::size_t watcher_bytes = std::size_t{16} << 20;
    HistoryRoom* history = nullptr;  ///< Null: streams of others have none here.
    std::size_t watches = 64;        ///< That look for their streams at the same time.
  };

  /// All that is passed lives longer. `address`: under which clients find this server, told to the
  /// other replicas; empty: they send nobody here.
  Relay(std::unique_ptr<MessageBus> bus, StreamRegistry& registry, WatchDispatcher& dispatcher,
        const Limits& limits, std::string address = {});
  ~Relay() override;
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  /// A stream of another replica that can be watched here.
  struct Found {
    std::shared_ptr<ResultBroadcaster> broadcaster;
    relay::v1::LiveStream stream;
  };
  using FindDone = std::function<void(const absl::StatusOr<Found>& found)>;

  /// Looks for the stream that another replica has by this name, to be watched from
  /// `from_sequence` on, and calls `done` once, from within or from another thread.
  /// Errors: NOT_FOUND (NO_SUCH_STREAM), within some seconds; UNAVAILABLE (DRAINING).
  void Find(const std::string& name, std::optional<std::uint64_t> from_sequence, FindDone done);
  /// Whether another replica has opened the stream with this lineage later than `opened`.
  bool WasResumedElsewhere(std::string_view lineage, Clock::time_point opened) const;
  /// Streams of other replicas, each once, but for those that were resumed here since: of those
  /// whose names `caller` may use at most `count`, in the order of their ids, after `after`.
  std::vector<relay::v1::LiveStream> List(const std::string& after, std::size_t count,
                                          const Caller& caller) const;
  std::size_t replicas() const { return directory_.replicas(); }
  std::size_t remote_streams() const { return directory_.streams(); }

  /// Addresses of other replicas that take streams, as far as they are told: some of them.
  std::vector<std::string> Addresses() const { return directory_.Addresses(kMaxAddresses); }

  /// From now on the others send no stream here. Drain comes next.
  void WillDrain();
  /// Refuses searches for streams, and sends the last results and ends. Takes at most some 300 ms
  /// beside what the bus takes, and two seconds with it.
  void Drain();

  bool connected() const { return connected_; }
  std::size_t exported_streams() const { return exported_count_; }
  std::size_t imported_streams() const { return imported_count_; }
  /// Of other replicas, that came faster than they were handled, or could not be sent.
  std::uint64_t lost_messages() const {
    return unsent_ + dropped_fetches_ + queue_->lost_messages();
  }

 private:
  static constexpr std::size_t kMaxAddresses = 16;

  struct LocalStream {
    std::shared_ptr<ResultBroadcaster> broadcaster;
    std::string lineage;
    std::int64_t opened_unix_ms = 0;
    bool was_told = false;  // That it was resumed elsewhere.
  };
  struct Import {
    std::unique_ptr<ImportedStream> stream;
    std::unique_ptr<MessageBus::Subscription> results;
    std::optional<Clock::time_point> missing_since;  // In what its replica announces.
  };
  struct Search {
    std::string name;
    std::optional<std::uint64_t> from_sequence;
    FindDone done;
    Clock::time_point began = {}, settled = {}, until = {};
  };

  void Post(std::function<void()> action) override;
  bool Send(const std::string& subject, relay::v1::RelayMessage& message) override;

  void Run();
  void Tick(Clock::time_point now);
  void CheckConnection(Clock::time_point now);
  void Announce(Clock::time_point now, bool asks, bool leaving);
  void LookAtLocalStreams();
  void LookAtExports(Clock::time_point now);
  void LookAtImports(Clock::time_point now);
  void EndTakenOver();
  void Lost(const std::string& replica);
  void Take(const std::string& piece);
  void Take(const std::string& replica, const relay::v1::Announcement& announcement);
  void TakeAsked(const std::string& piece);
  void AnswerNextFetch(Clock::time_point now);
  void Answer(const std::string& replica, const relay::v1::Fetch& fetch);
  bool TryFind(const Search& search, Clock::time_point now);
  void Watch(const RemoteStream& remote, const Search& search, Clock::time_point now);
  void LookAtSearches(Clock::time_point now);
  void GoOnDraining(Clock::time_point now);

  const std::string replica_;  // Tells this run of this server from all others.
  const std::string address_;
  const Limits limits_;
  StreamRegistry& registry_;
  WatchDispatcher& dispatcher_;
  StreamDirectory directory_;
  const std::unique_ptr<MessageBus> bus_;
  const std::shared_ptr<RelayQueue> queue_;
  std::atomic<bool> connected_ = false, refuses_ = false;
  std::atomic<std::size_t> exported_count_ = 0, imported_count_ = 0;
  std::atomic<std::uint64_t> unsent_ = 0, dropped_fetches_ = 0;

  // Of the relay's thread:
  PieceJoiner joiner_, asked_joiner_{FetchQueue::kFetchBytes};
  FetchQueue fetches_;
  std::uint64_t sent_ = 0;
  std::vector<std::unique_ptr<MessageBus::Subscription>> subscriptions_;
  std::map<std::string, LocalStream> local_;
  std::map<std::string, std::shared_ptr<ExportedStream>> exports_;
  std::vector<Import> imports_;
  std::vector<Search> searches_;
  std::uint64_t local_changes_ = 0;
  bool told_away_ = false;  // That the bus is not connected.
  bool changed_ = false;    // Streams came or went, here or elsewhere.
  bool was_asked_ = false;  // To announce the streams.
  bool will_drain_ = false;
  const Clock::time_point began_ = Clock::now();
  Clock::time_point announced_, asked_, ticked_, answered_, disconnected_ = began_;
  std::optional<Clock::time_point> connected_since_, draining_since_;
  std::promise<void> drained_;
  bool has_drained_ = false;
  std::once_flag drain_once_;
  std::thread thread_;
};

}  // namespace partiemc::server
