// Watches gRPC's connections and cuts floods.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "common/mutex.h"
#include "server/base/rate_limit.h"
#include "server/connections/connection_ledger.h"
#include "server/connections/connection_limits.h"
#include "server/connections/connection_table.h"
#include "server/connections/flood_guard.h"
#include "server/connections/sockets.h"

namespace partiemc::server {

/// Reads counts of streams from gRPC.
class StreamCounter {
 public:
  virtual ~StreamCounter() = default;
  /// Sets the numbers of streams and messages in `reading`. Returns false if gRPC does not list the
  /// peer's connection yet. `socket`: a value that Read stores for this connection; 0 before the
  /// first call.
  virtual bool Read(const std::string& peer, std::int64_t& socket, ConnectionReading& reading) = 0;
};

/// Watches connections and cuts floods. Holds a duplicate of each connection's descriptor, to read
/// its byte counts and to end it; does not read its bytes. One thread examines the connections. It
/// examines new connections, and connections with an excess or pending headers, every 5 or 20 ms;
/// it examines some of the other connections every 20 ms, in turn.
class ConnectionWatch {
 public:
  using Clock = std::chrono::steady_clock;
  /// Function that takes over the descriptor of a connection. It is called with a lock held, so it
  /// must not block and not call the watch.
  using HandOver = std::function<void(Descriptor)>;

  /// Numbers of connections since the start; `accepted` includes `health_only`.
  struct Counters {
    std::atomic<std::uint64_t> accepted = 0, health_only = 0, evicted = 0;
    std::array<std::atomic<std::uint64_t>, 3> floods{};  ///< By Flood.
  };

  /// `table` outlives the watch.
  ConnectionWatch(const ConnectionLimits& limits, const ConnectionRules& rules,
                  ConnectionTable& table);
  /// Ends all connections.
  ~ConnectionWatch();
  ConnectionWatch(const ConnectionWatch&) = delete;
  ConnectionWatch& operator=(const ConnectionWatch&) = delete;

  /// Starts the thread. `streams` outlives the watch; if it is null, streams are not counted.
  void Start(StreamCounter* streams);

  /// Watches an accepted connection and calls `hand_over` with its descriptor, or closes it.
  /// `hand_over` is called at once. For a connection that may only make health checks, the watching
  /// thread calls it later, unless the connection ends before.
  void Add(Descriptor socket, const HandOver& hand_over) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Ends a connection that has no call, to free its descriptors. Returns false if there is none.
  /// Does not end connections that may only make health checks.
  bool EvictIdle() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Ends the connections that wait for their hand-over. No function that Add has received is
  /// called afterwards.
  void EndWaiting() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Sets the time from which all connections end, so that a silent peer does not delay the drain.
  void EndAllAt(Clock::time_point deadline) ABSL_LOCKS_EXCLUDED(mutex_);

  const Counters& counters() const { return counters_; }
  /// Number of open connections.
  std::size_t count() const { return count_; }

 private:
  struct Connection {
    std::uint64_t key = 0;
    Descriptor socket;
    Peer peer;
    std::shared_ptr<TrackedConnection> tracked;
    Clock::time_point came;
    ConnectionReading reading;
    bool counts_bytes = false;
    std::int64_t grpc_socket = 0;
    std::uint64_t bytes_at_count = 0;  // `bytes_read` when the streams were last counted.
    Clock::time_point counted;
    // Set while a connection that may only make health checks waits to be passed to gRPC
    // (kHealthOnlyDelay).
    Descriptor waiting;
    HandOver hand_over;
    std::optional<Clock::time_point> misused;  // When the watch saw TrackedConnection::misused.
  };
  using Connections = std::list<Connection>;

  void Run() ABSL_LOCKS_EXCLUDED(mutex_);
  int TimeToWait(Clock::time_point now) ABSL_LOCKS_EXCLUDED(mutex_);
  void HandleEvents(int timeout_ms) ABSL_LOCKS_EXCLUDED(mutex_);
  bool EvictIdleLocked() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void EvictHealthOnly(const std::string& address) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ExamineAll(Clock::time_point now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool IsTurn(std::size_t index) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Examine(Connections::iterator connection, Clock::time_point now)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool ExamineHealthOnly(Connection& connection, Clock::time_point now)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool CountStreams(Connection& connection, Clock::time_point now)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ExamineTogether(Clock::time_point now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void CutSuspects(Clock::time_point now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Cut(Connections::iterator connection, Flood flood, Clock::time_point now)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Remove(Connections::iterator connection) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::vector<ExaminedConnection> Examined() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const ConnectionRules rules_;
  ConnectionTable& table_;
  StreamCounter* streams_ = nullptr;
  const Descriptor events_, wake_;
  Counters counters_;
  std::atomic<std::size_t> count_ = 0;
  std::atomic<bool> stop_ = false;

  Mutex mutex_;
  ConnectionCounts counts_ ABSL_GUARDED_BY(mutex_);
  Connections connections_ ABSL_GUARDED_BY(mutex_);  // In the order of arrival.
  std::unordered_map<std::uint64_t, Connections::iterator> by_key_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t next_key_ ABSL_GUARDED_BY(mutex_) = 0;
  // From this index on, the next period also examines quiet connections (kQuietInPeriod).
  std::size_t turn_ ABSL_GUARDED_BY(mutex_) = 0;
  // Number of connections whose streams may still be counted in this period.
  std::size_t counts_left_ ABSL_GUARDED_BY(mutex_) = 0;
  // Addresses of connections that were cut in this period, and the kind of their flood.
  std::map<std::string, Flood> flooding_ ABSL_GUARDED_BY(mutex_);
  Clock::time_point examine_at_ ABSL_GUARDED_BY(mutex_){};
  Clock::time_point all_at_ ABSL_GUARDED_BY(mutex_){};
  Clock::time_point forget_at_ ABSL_GUARDED_BY(mutex_){};
  Clock::time_point end_all_at_ ABSL_GUARDED_BY(mutex_) = Clock::time_point::max();
  RateLimit log_limit_ ABSL_GUARDED_BY(mutex_);              // Of cut connections.
  RateLimit health_only_log_limit_ ABSL_GUARDED_BY(mutex_);  // Of new health-only connections.
  std::thread thread_;
};

}  // namespace partiemc::server
