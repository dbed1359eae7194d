// Limits the number of connections, in total and per address, and the rate of new connections per
// address.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace partiemc::server {

/// An address is a host (Peer::address). 0: no limit.
struct ConnectionLimits {
  std::uint32_t connections = 2'048;  ///< Connections of all addresses.
  std::uint32_t of_address = 1'024;   ///< Connections of one address.
  /// New connections of one address per second; a burst may be double. 0 also disables OnFlood.
  std::uint32_t new_of_address = 500;
};

/// The decision about an accepted connection.
enum class Admission {
  kKept,
  /// A limit is exceeded or the address has flooded, so the connection may only make health checks.
  /// It is not refused, because a probe from this address must not report the server as dead.
  kHealthOnly,
  /// Closed at once.
  kRefused,
};

/// Counts connections of each address. Not thread-safe.
class ConnectionCounts {
 public:
  using Clock = std::chrono::steady_clock;

  explicit ConnectionCounts(const ConnectionLimits& limits) : limits_(limits) {}

  /// Decides how a connection of `address` is admitted, and counts it. Unless it is refused, the
  /// caller must call Remove with the same admission when the connection has ended.
  Admission Add(const std::string& address, Clock::time_point now);
  void Remove(const std::string& address, Admission admission);

  /// Called when a connection of `address`, admitted as `admission`, was cut because of a flood.
  /// For ten seconds, new connections of this address may only make health checks. If the cut
  /// connection was kHealthOnly, all are refused for the first of these seconds, because over TLS a
  /// flood is detected only after an expensive handshake. No effect if bans() is false. Of the
  /// address's open connections, ConnectionWatch cuts the suspects.
  void OnFlood(const std::string& address, Admission admission, Clock::time_point now);

  /// Whether OnFlood has an effect: not if the rate of new connections is unlimited, because an
  /// address may then belong to many clients.
  bool bans() const { return limits_.new_of_address > 0; }

  /// Numbers of connections that were admitted as kKept: of all addresses, of `address`.
  std::size_t count() const { return kept_; }
  std::size_t CountOf(const std::string& address) const;
  /// Whether the limit of all addresses is reached, so no connection can be admitted as kKept.
  bool IsFull() const { return limits_.connections > 0 && kept_ >= limits_.connections; }

  /// Removes addresses that have no connection, ten seconds after the last one was opened and after
  /// the end of a ban. By then their token bucket is full.
  void Forget(Clock::time_point now);
  std::size_t addresses() const { return addresses_.size(); }

 private:
  struct Address {
    std::size_t kept = 0, health_only = 0;
    double tokens = 0;  // Number of connections that it may open now (token bucket).
    Clock::time_point filled;
    Clock::time_point banned_until, refused_until;
  };

  const ConnectionLimits limits_;
  std::map<std::string, Address> addresses_;
  std::size_t kept_ = 0;
};

}  // namespace partiemc::server
