// A TCP proxy that disturbs connections: cuts, resets, delays, slows, silently drops and corrupts
// them.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace partiemc::support {

/// Listens on a loopback port and forwards every connection to `target` (HOST:PORT of loopback).
/// Each function acts on the current connections unless stated otherwise; new ones are undisturbed.
/// Thread-safe; an internal thread does the work.
class ChaosProxy {
 public:
  explicit ChaosProxy(const std::string& target);
  /// Closes all connections.
  ~ChaosProxy();
  ChaosProxy(const ChaosProxy&) = delete;
  ChaosProxy& operator=(const ChaosProxy&) = delete;

  /// HOST:PORT to connect to.
  std::string address() const;

  /// Closes both ends cleanly, at any byte.
  void Cut();
  /// Closes both ends with a TCP reset; bytes on the way are lost.
  void Reset();
  /// Stops forwarding without closing: neither end detects that the other is lost.
  void HalfOpen();
  /// Flips one bit in each of the next `count` pieces from the server or the client, on any
  /// connection.
  void Flip(std::size_t count, bool from_server);

  // For all connections, including new ones:
  /// Delays forwarded bytes.
  void Delay(std::chrono::milliseconds delay);
  /// Per direction and connection; 0: no limit.
  void Limit(std::uint64_t bytes_per_second);

  std::size_t accepted() const;
  std::uint64_t flipped() const;

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace partiemc::support
