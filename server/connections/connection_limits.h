// Limits the connections: in total, per address, and new ones per second.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace partiemc::server {

/// 0: no limit.
struct ConnectionLimits {
  std::uint32_t connections = 2'048;   ///< Connections of all addresses.
  std::uint32_t of_address = 1'024;    ///< Connections of one address.
  std::uint32_t new_of_address = 500;  ///< New connections of one address per second; burst: twice.
};

/// The decision about an accepted connection.
enum class Admission {
  kKept,
  /// A limit is exceeded. The connection may only make health checks, so that a probe from a
  /// flooding address does not report the server as dead.
  kHealthOnly,
  /// Closed at once.
  kRefused,
};

/// Counts connections of each address. Not thread-safe.
class ConnectionCounts {
 public:
  using Clock = std::chrono::steady_clock;

  explicit ConnectionCounts(const ConnectionLimits& limits) : limits_(limits) {}

  /// Counts a connection of `address` (HostOfPeer). Unless it is refused, Remove must follow with
  /// the same admission when it has ended.
  Admission Add(const std::string& address, Clock::time_point now);
  void Remove(const std::string& address, Admission admission);

  /// A connection of `address` was cut because of a flood. For ten seconds, new connections of the
  /// address may only make health checks. If one of these floods too, new connections are refused
  /// for a second, because over TLS the server must pay for a handshake before it can detect a
  /// flood. Open connections of the address continue.
  void OnFlood(const std::string& address, Admission admission, Clock::time_point now);

  /// Kept connections of all addresses.
  std::size_t count() const { return kept_; }
  /// Kept connections of `address`.
  std::size_t CountOf(const std::string& address) const;
  /// Whether a connection must end before another one can be kept.
  bool IsFull() const { return limits_.connections > 0 && kept_ >= limits_.connections; }

  /// Forgets addresses that have no connection and whose rate has recovered.
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
