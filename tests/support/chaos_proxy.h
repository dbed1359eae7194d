// A TCP proxy that does to connections what networks do: cuts, resets, delays, slows, forgets and
// falsifies them.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace partiemc::support {

/// Listens on a port of loopback and passes every connection on to `target` (HOST:PORT of
/// loopback). Each function acts on the connections that are there, unless it says otherwise; new
/// ones are undisturbed. Safe from any thread; one thread of its own does the work.
class ChaosProxy {
 public:
  explicit ChaosProxy(const std::string& target);
  /// Closes everything.
  ~ChaosProxy();
  ChaosProxy(const ChaosProxy&) = delete;
  ChaosProxy& operator=(const ChaosProxy&) = delete;

  /// HOST:PORT to connect to.
  std::string address() const;

  /// Closes both ends in the orderly way, at whatever byte they are.
  void Cut();
  /// Closes both ends with a TCP reset; what was under way is lost.
  void Reset();
  /// Passes nothing more on and closes nothing: neither end is told that the other has gone.
  void HalfOpen();
  /// Flips one bit in each of the next `count` pieces that come from the server, or the client, on
  /// whatever connection.
  void Flip(std::size_t count, bool from_server);

  // For all connections, those to come too:
  /// What comes is passed on so much later.
  void Delay(std::chrono::milliseconds delay);
  /// In each direction of each connection; 0: no limit.
  void Limit(std::uint64_t bytes_per_second);

  std::size_t accepted() const;
  std::uint64_t flipped() const;

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace partiemc::support
