// Watches gRPC's connections and cuts floods.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "server/base/rate_limit.h"
#include "server/connections/connection_limits.h"
#include "server/connections/connection_table.h"
#include "server/connections/flood_guard.h"
#include "server/connections/sockets.h"

namespace partiemc::server {

/// Reads counts of streams from gRPC.
class StreamCounter {
 public:
  virtual ~StreamCounter() = default;
  /// Sets the streams and messages in `reading`; false if gRPC does not list the peer's connection
  /// yet. `socket`: memory of Read for this connection, 0 before the first call.
  virtual bool Read(const std::string& peer, std::int64_t& socket, ConnectionReading& reading) = 0;
};

/// Holds a duplicate of each connection's descriptor, to count its bytes and to end it. It does not
/// read the bytes itself. One thread examines the connections every 20 ms.
class ConnectionWatch {
 public:
  using Clock = std::chrono::steady_clock;
  /// Takes the descriptor of a connection, and does not block.
  using HandOver = std::function<void(Descriptor)>;

  /// Totals since the start.
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

  /// `streams` outlives the watch; null: streams are not counted. `give_back_memory` is called half
  /// a second after a connection was cut.
  void Start(StreamCounter* streams, std::function<void()> give_back_memory = nullptr);

  /// Watches an accepted connection, or refuses it. Unless it is refused, calls `hand_over` with
  /// its descriptor, at once or later from the watching thread.
  void Add(Descriptor socket, const HandOver& hand_over);
  /// Ends a connection without a call, to free its descriptors. False if all have calls.
  bool EvictIdle();
  /// Ends the remaining connections at `deadline`, so that a silent peer does not delay the drain.
  void EndAllAt(Clock::time_point deadline);

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
    // Set while a connection for health checks only waits to be handed over (kHealthOnlyDelay).
    Descriptor waiting;
    HandOver hand_over;
  };
  using Connections = std::list<Connection>;

  void Run();
  int TimeToWait(Clock::time_point now);
  void HandleEvents(int timeout_ms);
  // With the lock held:
  bool EvictIdleLocked();
  void EvictHealthOnly(const std::string& address);
  void ExamineAll(Clock::time_point now);
  bool IsTurn(std::size_t index) const;
  void Examine(Connections::iterator connection, Clock::time_point now);
  bool ExamineHealthOnly(Connection& connection, Clock::time_point now);
  bool CountStreams(Connection& connection, Clock::time_point now);
  void ExamineTogether(Clock::time_point now);
  void Cut(Connections::iterator connection, Flood flood, Clock::time_point now);
  void Remove(Connections::iterator connection);
  std::vector<ExaminedConnection> Examined() const;

  const ConnectionRules rules_;
  ConnectionTable& table_;
  StreamCounter* streams_ = nullptr;
  std::function<void()> give_back_memory_;
  Clock::time_point give_back_at_ = Clock::time_point::max();  // Used by thread_ only.
  const Descriptor events_, wake_;
  Counters counters_;
  std::atomic<std::size_t> count_ = 0;
  std::atomic<bool> stop_ = false;

  std::mutex mutex_;  // Guards all below.
  ConnectionCounts counts_;
  Connections connections_;  // In the order of arrival.
  std::unordered_map<std::uint64_t, Connections::iterator> by_key_;
  std::uint64_t next_key_ = 0;
  std::size_t turn_ = 0;         // Index of the first quiet connection to examine next.
  std::size_t counts_left_ = 0;  // How often streams may still be counted in this period.
  Clock::time_point examine_at_{}, all_at_{}, forget_at_{}, end_all_at_ = Clock::time_point::max();
  RateLimit log_limit_;
  std::thread thread_;
};

}  // namespace partiemc::server
