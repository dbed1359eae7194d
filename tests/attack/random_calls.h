// Random callers: calls of every method that are begun and cancelled, reset, half-closed, timed out
// or abandoned at random moments, with valid and invalid messages.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "support/random.h"

namespace partiemc::attack {

/// Number of calls to make, and counts.
struct CallCounts {
  std::atomic<std::int64_t> left = 0;  ///< Calls still to begin.
  std::atomic<bool> stop = false;
  std::atomic<std::uint64_t> raw = 0,
                             client = 0;  ///< Begun over raw HTTP/2 frames, and by gRPC's client.
  std::atomic<std::uint64_t> connections = 0;  ///< Connections of raw callers.
};

/// Messages of callers, made once.
struct CallMessages {
  CallMessages();
  std::vector<std::string> opens, frames, watches, credits, unary;
};

/// Begins raw calls until none are left or the server has died.
void CallRaw(const std::string& address, const CallMessages& messages, std::uint64_t seed,
             CallCounts& counts);
/// Address and credentials for gRPC's client.
struct Access {
  std::string address;
  std::string authority = {};  ///< PEM, for TLS; empty: no TLS.
  std::string token = {};      ///< Empty: none.
};

/// Same as CallRaw with gRPC's client, over one channel.
void CallByClient(const Access& access, const CallMessages& messages, std::uint64_t seed,
                  CallCounts& counts);

/// Callers of both kinds at once, with one connection each.
class Storm {
 public:
  Storm(std::string address, std::int64_t calls, std::uint64_t seed);
  ~Storm();
  /// Returns when all calls have begun.
  void Wait();
  /// Stops immediately.
  void Stop();
  const CallCounts& counts() const { return counts_; }

 private:
  const std::string address_;
  CallMessages messages_;
  CallCounts counts_;
  std::vector<std::thread> callers_;
};

}  // namespace partiemc::attack
