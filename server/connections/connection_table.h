// Finds the connection of a call, so that the call reports what it has received.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "server/connections/connection_ledger.h"
#include "server/connections/connection_limits.h"

namespace partiemc::server {

/// A connection as its calls see it. Safe from any thread.
struct TrackedConnection {
  TrackedConnection(const ConnectionRules& rules, Admission as,
                    ConnectionLedger::Clock::time_point now)
      : ledger(rules, now), admission(as) {}

  ConnectionLedger ledger;
  const Admission admission;
  /// A call that is no health check has come over a connection that is for health checks alone.
  std::atomic<bool> misused = false;
};

enum class CallKind { kHealthCheck, kOther };

/// One call's reports to the ledger of its connection. Not thread-safe. Without a connection it
/// counts nothing: a call in process, or over a Unix socket, where all peers have one name.
class CallTally {
 public:
  CallTally() = default;
  explicit CallTally(std::shared_ptr<TrackedConnection> connection);
  ~CallTally();
  CallTally(const CallTally&) = delete;
  CallTally& operator=(const CallTally&) = delete;

  void OnReadBegun();
  /// The read has brought a message of `bytes`. A read that fails stays open until the call ends.
  void OnReadDone(std::uint64_t bytes);

 private:
  const std::shared_ptr<TrackedConnection> connection_;
  std::atomic<bool> reading_ = false;
};

/// The open connections by their peers. Safe from any thread.
class ConnectionTable {
 public:
  /// False if the peer has a connection already: a client may use one port for connections to two
  /// addresses of the server, and their calls could not be told apart.
  bool Add(const std::string& peer, std::shared_ptr<TrackedConnection> connection);
  void Remove(const std::string& peer);

  /// The connection of a call; null if it is not known. `peer` is as gRPC writes it.
  std::shared_ptr<TrackedConnection> BeginCall(std::string_view peer, CallKind kind) const;

  std::size_t size() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<TrackedConnection>, std::less<>> connections_;  // Guarded.
};

/// One spelling for each peer: "ipv6:%5Bfe80::1%25eth0%5D:50051" is "ipv6:[fe80::1]:50051".
std::string NormalPeer(std::string_view peer);

}  // namespace partiemc::server
