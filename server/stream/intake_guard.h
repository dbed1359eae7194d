// Bounds the memory that incomplete messages occupy.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <thread>

#include "server/compute/read_permits.h"
#include "server/stream/opening_calls.h"

namespace partiemc::server {

/// gRPC collects a whole message before it reports the size, even if the message exceeds the limit.
/// So the server cannot count the bytes that arrive for opening calls (calls without a first
/// request) and for watchers. While there are such calls (OpeningCalls) or large reads
/// (ReadPermits::NeedsLook), a thread checks the memory of the whole process every 10 ms. If the
/// process exceeds its limit, the thread returns freed memory to the system. If that does not
/// suffice, it evicts opening calls: the older half of the calls of the caller that has the most. A
/// call that sends its request at once is hardly ever evicted. Watchers are evicted last.
///
/// Bytes that arrive for open streams are planned in advance (ReadPermits), so open streams
/// continue. A stream is ended only if memory is exhausted and its read may bring more bytes than
/// planned (ReadPermits::Revoke).
class IntakeGuard {
 public:
  /// Access to the memory of the process. Tests replace it.
  struct Process {
    std::function<std::uint64_t()> resident_bytes;
    /// The process may now have at most `most_bytes` + `more_bytes` resident. `more_bytes` is more
    /// expensive, so it is only called if the memory exceeds `most_bytes`.
    std::function<std::uint64_t()> most_bytes, more_bytes;
    std::function<void()> give_back_freed;
    /// The largest value that `most_bytes` can return.
    std::uint64_t limit_bytes = 0;
    /// Bytes that each connection has received, by peer address (ReceivedBytesOfConnections).
    std::function<std::map<std::string, std::uint64_t>()> received_bytes = {};
  };

  /// `opening` and `reads` outlive the guard. If `reads` is null, the guard ends no streams.
  IntakeGuard(OpeningCalls& opening, Process process, ReadPermits* reads = nullptr);
  ~IntakeGuard();
  IntakeGuard(const IntakeGuard&) = delete;
  IntakeGuard& operator=(const IntakeGuard&) = delete;

 private:
  void Run();
  bool IsTooMuch() const;
  void FreeMemory(std::chrono::steady_clock::time_point now);
  void RevokeReads();
  void LookAtReads(std::chrono::steady_clock::time_point now);

  OpeningCalls& opening_;
  ReadPermits* const reads_;
  const Process process_;
  std::chrono::steady_clock::time_point gave_back_ = {}, looked_ = {};
  std::uint64_t resident_before_ = 0;
  std::thread thread_;
};

}  // namespace partiemc::server
