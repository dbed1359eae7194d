// Lets every replica serve watchers of all streams. Each replica announces its streams to the
// others. It publishes the results of a stream while another replica watches the stream.
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
#include "common/clock.h"
#include "server/relay/exported_stream.h"
#include "server/relay/fetch_queue.h"
#include "server/relay/imported_stream.h"
#include "server/relay/local_streams.h"
#include "server/relay/message_bus.h"
#include "server/relay/pieces.h"
#include "server/relay/relay_port.h"
#include "server/relay/relay_queue.h"
#include "server/relay/stream_directory.h"
#include "server/stream/stream_registry.h"

namespace partiemc::server {

/// The public functions are thread-safe; the relay thread does everything else. Messages that
/// exceed the capacity of its queues are lost; lost results are fetched again. In each step the
/// thread runs the actions that this server has posted, then handles some messages, then responds
/// to one fetch. So a flooding peer can delay neither results nor a drain for long.
class Relay final : private RelayPort {
 public:
  using TimePoint = Clock::TimePoint;

  struct Limits {
    ResultBroadcaster::Limits broadcaster;              ///< For streams of other replicas.
    std::size_t watcher_bytes = std::size_t{16} << 20;  ///< Limit of a stream's waiting results.
    HistoryRoom* history = nullptr;       ///< Null: no history for streams of other replicas.
    FinishedStreams* finished = nullptr;  ///< Receives the finished streams of other replicas.
    std::size_t watches = 64;             ///< Maximum number of concurrent searches (Find).
  };

  /// Requires: all references outlive this object. The relay announces `address` to the other
  /// replicas as the address of this server for clients; empty: no address.
  Relay(std::unique_ptr<MessageBus> bus, StreamRegistry& registry, WatchDispatcher& dispatcher,
        const Limits& limits, std::string address = {}, const TimeAndChance& surroundings = {});
  ~Relay() override;
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  /// A stream of another replica that can be watched here.
  struct Found {
    std::shared_ptr<ResultBroadcaster> broadcaster;
    relay::v1::LiveStream stream;
  };
  using FindDone = std::function<void(const absl::StatusOr<Found>& found)>;

  /// Searches the other replicas for the stream of this name, to watch it from the sequence number
  /// `from_sequence`. Calls `done` once, during this call or later from the relay thread. Errors:
  /// NOT_FOUND (NO_SUCH_STREAM), within some seconds; UNAVAILABLE (DRAINING).
  void Find(const std::string& name, std::optional<std::uint64_t> from_sequence, FindDone done);
  /// Whether a producer has resumed the stream with this lineage (LineageOf the stream token) at
  /// another replica, later than `opened`.
  bool WasResumedElsewhere(std::string_view lineage, TimePoint opened) const;
  /// Returns at most `count` streams of other replicas that `caller` may use, with ids above
  /// `after`, sorted by id. Omits streams that were resumed at this server.
  std::vector<relay::v1::LiveStream> List(const std::string& after, std::size_t count,
                                          const Caller& caller) const;
  std::size_t replicas() const { return directory_.replicas(); }
  std::size_t remote_streams() const { return directory_.streams(); }

  /// Returns the addresses of other replicas that accept streams, at most 16.
  std::vector<std::string> Addresses() const { return directory_.Addresses(kMaxAddresses); }

  /// Announces that this replica accepts no further streams. The caller calls Drain later.
  void WillDrain();
  /// Ends pending searches with an error, sends the last results and the ends of streams, and
  /// announces that this replica leaves. Blocks for at most two seconds.
  void Drain();

  bool connected() const { return connected_; }
  std::size_t exported_streams() const { return exported_count_; }
  std::size_t imported_streams() const { return imported_count_; }
  /// Number of messages that were lost because a queue was full or a send failed.
  std::uint64_t lost_messages() const {
    return unsent_ + dropped_fetches_ + queue_->lost_messages();
  }

 private:
  static constexpr std::size_t kMaxAddresses = 16;

  struct Import {
    std::unique_ptr<ImportedStream> stream;
    std::unique_ptr<MessageBus::Subscription> results;
    std::optional<TimePoint> missing_since;  // When the owner stopped announcing the stream.
  };
  struct Search {
    std::string name;
    std::optional<std::uint64_t> from_sequence;
    FindDone done;
    TimePoint began = {}, settled = {}, until = {};
  };

  void Post(std::function<void()> action) override;
  bool Send(const std::string& subject, relay::v1::RelayMessage& message) override;

  void Run();
  void Tick(TimePoint now);
  void CheckConnection(TimePoint now);
  void Announce(TimePoint now, bool asks, bool leaving);
  bool UpdateLocalStreams();
  void LookAtExports(TimePoint now);
  void LookAtImports(TimePoint now);
  void EndTakenOver();
  void Lost(const std::string& replica);
  void Take(const std::string& piece);
  void Take(const std::string& replica, const relay::v1::Announcement& announcement);
  void OnAskedPiece(const std::string& piece);
  void AnswerNextFetch(TimePoint now);
  void Answer(const std::string& replica, const relay::v1::Fetch& fetch);
  bool TryFind(const Search& search, TimePoint now);
  // Lets watchers join an import of the stream, or begins one. A watcher that starts earlier than
  // both imports can provide starts with their oldest result.
  void Watch(const RemoteStream& remote, const Search& search, TimePoint now);
  void LookAtSearches(TimePoint now);
  void GoOnDraining(TimePoint now);

  const Clock& clock_;
  const std::string replica_;  // Unique for this process.
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

  // Used by the relay thread only:
  PieceJoiner joiner_, asked_joiner_{FetchQueue::kFetchBytes};
  FetchQueue fetches_;
  std::uint64_t sent_ = 0;
  std::vector<std::unique_ptr<MessageBus::Subscription>> subscriptions_;
  LocalStreams local_{registry_, clock_};
  std::map<std::string, std::shared_ptr<ExportedStream>> exports_;
  std::vector<Import> imports_;
  std::vector<Search> searches_;
  bool loss_logged_ = false;  // A log line has reported that NATS was lost or not reached.
  bool changed_ = false;      // The set of streams has changed, here or at another replica.
  bool was_asked_ = false;    // Another replica has requested an announcement.
  bool will_drain_ = false;
  const TimePoint began_ = clock_.Now();
  TimePoint announced_, asked_, ticked_, answered_, acted_, pieces_checked_, disconnected_ = began_;
  std::optional<TimePoint> connected_since_, draining_since_;
  std::promise<void> drained_;
  bool has_drained_ = false;
  std::once_flag drain_once_;
  std::thread thread_;
};

}  // namespace partiemc::server
