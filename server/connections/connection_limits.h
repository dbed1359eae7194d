// How many connections there may be: of all addresses, of one, and new ones in a second.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace partiemc::server {

/// 0: not limited.
struct ConnectionLimits {
  std::uint32_t connections = 2'048;   ///< Of all addresses.
  std::uint32_t of_address = 1'024;    ///< Of one address.
  std::uint32_t new_of_address = 500;  ///< Of one address in a second, twice as many at once.
};

/// Whether a connection that was accepted is kept.
enum class Admission {
  kKept,
  /// Beyond a limit. It is kept for health checks alone, so that a server that is flooded is not
  /// taken for dead by a probe from the same address.
  kHealthOnly,
  /// Closed at once.
  kRefused,
};

/// Counts connections of each address. Not thread-safe.
class ConnectionCounts {
 public:
  using Clock = std::chrono::steady_clock;

  explicit ConnectionCounts(const ConnectionLimits& limits) : limits_(limits) {}

  /// Counts one more connection of `address`, as HostOfPeer writes it. Remove follows when it has
  /// ended, with the same admission, unless it was refused.
  Admission Add(const std::string& address, Clock::time_point now);
  void Remove(const std::string& address, Admission admission);

  /// A connection of `address` was cut for a flood. For ten seconds the address opens connections
  /// for health checks alone. If it floods in one of these, its connections are refused for a
  /// second: over TLS a peer shows only after the handshake that it floods. The open connections of
  /// the address go on.
  void OnFlood(const std::string& address, Admission admission, Clock::time_point now);

  /// Kept connections of all addresses.
  std::size_t count() const { return kept_; }
  /// Kept connections of `address`.
  std::size_t CountOf(const std::string& address) const;
  /// Whether a connection of `limits.connections` must end before another one is kept.
  bool IsFull() const { return limits_.connections > 0 && kept_ >= limits_.connections; }

  /// Forgets addresses that have no connection and whose rate has recovered.
  void Forget(Clock::time_point now);
  std::size_t addresses() const { return addresses_.size(); }

 private:
  struct Address {
    std::size_t kept = 0, health_only = 0;
    double tokens = 0;  // New connections that it may open now.
    Clock::time_point filled;
    Clock::time_point banned_until, refused_until;
  };

  const ConnectionLimits limits_;
  std::map<std::string, Address> addresses_;
  std::size_t kept_ = 0;
};

}  // namespace partiemc::server
