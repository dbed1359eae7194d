// Finds the connection of a call, so that the call can report its messages to the connection's
// ledger.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "common/mutex.h"
#include "server/connections/connection_ledger.h"
#include "server/connections/connection_limits.h"

namespace partiemc::server {

/// The data of a connection that its calls use. Thread-safe.
struct TrackedConnection {
  TrackedConnection(const ConnectionRules& rules, Admission as,
                    ConnectionLedger::Clock::time_point now)
      : ledger(rules, now), admission(as) {}

  ConnectionLedger ledger;
  const Admission admission;
  /// Whether the connection has made another call although it may only make health checks.
  std::atomic<bool> misused = false;
};

enum class CallKind { kHealthCheck, kOther };

/// Reports one call to the ledger of its connection: its begin, its reads and its end (destructor).
/// A null connection is unknown, and nothing is reported. This is the case for calls within the
/// process, and for Unix sockets, where all peers have the same name. Not thread-safe.
class CallTally {
 public:
  CallTally() = default;
  explicit CallTally(std::shared_ptr<TrackedConnection> connection);
  ~CallTally();
  CallTally(const CallTally&) = delete;
  CallTally& operator=(const CallTally&) = delete;

  /// Whether the connection may only make health checks.
  bool is_health_only() const {
    return connection_ != nullptr && connection_->admission == Admission::kHealthOnly;
  }
  void OnReadBegun();
  /// The read has completed with a message of `bytes`. A failed read is not reported, and counts as
  /// pending until the call ends.
  void OnReadDone(std::uint64_t bytes);

 private:
  const std::shared_ptr<TrackedConnection> connection_;
  std::atomic<bool> reading_ = false;
};

/// The open connections, by peer. Thread-safe.
class ConnectionTable {
 public:
  /// Adds a connection. Returns false, and adds nothing, if the peer (address and port) has a
  /// connection already: a client may use one port for connections to two addresses of the server.
  /// The calls of these connections could not be distinguished.
  bool Add(const std::string& peer, std::shared_ptr<TrackedConnection> connection)
      ABSL_LOCKS_EXCLUDED(mutex_);
  void Remove(const std::string& peer) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Returns the connection of a new call, or null if it is unknown. If the connection may not make
  /// this kind of call, marks it as misused. `peer` has gRPC's format.
  std::shared_ptr<TrackedConnection> BeginCall(std::string_view peer, CallKind kind) const
      ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  mutable Mutex mutex_;
  std::map<std::string, std::shared_ptr<TrackedConnection>, std::less<>> connections_
      ABSL_GUARDED_BY(mutex_);
};

/// Converts a peer from gRPC's format: "ipv6:%5Bfe80::1%25eth0%5D:50051" becomes
/// "ipv6:[fe80::1]:50051". Other peers stay as they are.
std::string NormalPeer(std::string_view peer);

}  // namespace partiemc::server
