// Callers that do what no plan foresees: calls of every method, begun and cancelled, reset,
// half-closed, timed out or left alone at random moments, with messages good and bad.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "support/random.h"

namespace partiemc::attack {

/// How much there is to do, and what has been done.
struct CallCounts {
  std::atomic<std::int64_t> left = 0;  ///< Calls to begin.
  std::atomic<bool> stop = false;
  std::atomic<std::uint64_t> raw = 0, client = 0;  ///< Begun over HTTP/2 frames, by gRPC's client.
  std::atomic<std::uint64_t> connections = 0;      ///< Of raw callers.
};

/// What callers send, made once.
struct CallMessages {
  CallMessages();
  std::vector<std::string> opens, frames, watches, credits, unary;
};

/// Begins raw calls until none are left or the server has gone.
void CallRaw(const std::string& address, const CallMessages& messages, std::uint64_t seed,
             CallCounts& counts);
/// Where gRPC's client calls, and what it brings along.
struct Access {
  std::string address;
  std::string authority = {};  ///< PEM, for TLS; empty: in the clear.
  std::string token = {};      ///< Empty: none.
};

/// The same with gRPC's client, over one channel.
void CallByClient(const Access& access, const CallMessages& messages, std::uint64_t seed,
                  CallCounts& counts);

/// Callers of both kinds at once, each with a connection of its own.
class Storm {
 public:
  Storm(std::string address, std::int64_t calls, std::uint64_t seed);
  ~Storm();
  /// Until all calls are begun.
  void Wait();
  /// Now.
  void Stop();
  const CallCounts& counts() const { return counts_; }

 private:
  const std::string address_;
  CallMessages messages_;
  CallCounts counts_;
  std::vector<std::thread> callers_;
};

}  // namespace partiemc::attack
