// Watches the connections that gRPC has, and ends those that flood.
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

/// Reads counts of streams, which gRPC alone knows.
class StreamCounter {
 public:
  virtual ~StreamCounter() = default;
  /// Fills in the streams and messages of the connection of `peer`; false if it is not known yet.
  /// `socket` is 0 at first; Read keeps its own number of the connection there.
  virtual bool Read(const std::string& peer, std::int64_t& socket, ConnectionReading& reading) = 0;
};

/// Keeps a duplicate of each descriptor, by which it counts the bytes of a connection and ends it.
/// No byte passes through it. One thread examines the connections every 20 ms.
class ConnectionWatch {
 public:
  using Clock = std::chrono::steady_clock;
  /// Takes the descriptor of a connection, and does not block.
  using HandOver = std::function<void(Descriptor)>;

  /// Counted since the start.
  struct Counters {
    std::atomic<std::uint64_t> accepted = 0, health_only = 0, evicted = 0;
    std::array<std::atomic<std::uint64_t>, 3> floods{};  ///< By Flood.
  };

  /// `table` lives longer.
  ConnectionWatch(const ConnectionLimits& limits, const ConnectionRules& rules,
                  ConnectionTable& table);
  /// Ends all connections.
  ~ConnectionWatch();
  ConnectionWatch(const ConnectionWatch&) = delete;
  ConnectionWatch& operator=(const ConnectionWatch&) = delete;

  /// `streams` lives longer; without it streams are not counted. `give_back_memory` is called some
  /// time after connections were cut.
  void Start(StreamCounter* streams, std::function<void()> give_back_memory = nullptr);

  /// Watches a connection that was accepted, and calls `hand_over` with its descriptor, at once or
  /// from the watching thread, unless the connection is not to be served.
  void Add(Descriptor socket, const HandOver& hand_over);
  /// Ends a connection without a call, so that its descriptors are free. False if all have calls.
  bool EvictIdle();
  /// Ends what is still connected at `deadline`, so that a peer that does not answer holds up no
  /// drain.
  void EndAllAt(Clock::time_point deadline);

  const Counters& counters() const { return counters_; }
  /// Connections now.
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
    std::uint64_t bytes_at_count = 0;  // Bytes read when streams were counted last.
    Clock::time_point counted;
    // Of a connection for health checks alone, until it has shown that it does not flood.
    Descriptor waiting;
    HandOver hand_over;
  };
  using Connections = std::list<Connection>;

  void Run();
  int TimeToWait(Clock::time_point now);
  void HandleEvents(int timeout_ms);
  // All below: with the lock held.
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
  Clock::time_point give_back_at_ = Clock::time_point::max();  // Of the thread.
  const Descriptor events_, wake_;
  Counters counters_;
  std::atomic<std::size_t> count_ = 0;
  std::atomic<bool> stop_ = false;

  std::mutex mutex_;  // Guards all below.
  ConnectionCounts counts_;
  Connections connections_;  // In the order in which they came.
  std::unordered_map<std::uint64_t, Connections::iterator> by_key_;
  std::uint64_t next_key_ = 0;
  std::size_t turn_ = 0;         // Where the next period begins among quiet connections.
  std::size_t counts_left_ = 0;  // Of this period.
  Clock::time_point examine_at_{}, all_at_{}, forget_at_{}, end_all_at_ = Clock::time_point::max();
  RateLimit log_limit_;
  std::thread thread_;
};

}  // namespace partiemc::server
