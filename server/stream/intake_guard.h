// Bounds the memory of messages that have not arrived completely.
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

/// gRPC collects a message before it reports its size, even if the message exceeds the limit. So
/// the server cannot count the bytes of opening calls and of watchers' requests. While there are
/// such calls (OpeningCalls), a thread checks the memory of the whole process every 10 ms. If it
/// exceeds the limit, the thread returns freed memory to the system and evicts the older half of
/// the opening calls of the caller with the most. A call that sends its request at once is hardly
/// ever among them. Watchers are evicted only if returning freed memory did not suffice.
///
/// Frames that are arriving at open streams are planned (ReadPermits), and these streams continue.
/// Such a stream ends only if memory is exhausted and it has received more than was planned.
class IntakeGuard {
 public:
  /// The process's memory; tests replace it.
  struct Process {
    std::function<std::uint64_t()> resident_bytes;
    /// The process may have `most_bytes` + `more_bytes` resident now. `more_bytes` costs more to
    /// compute and is only called if `most_bytes` alone is exceeded.
    std::function<std::uint64_t()> most_bytes, more_bytes;
    std::function<void()> give_back_freed;
    /// Upper limit of resident memory at any time.
    std::uint64_t limit_bytes = 0;
    /// Bytes that each connection has received, by peer (ReceivedBytesOfConnections).
    std::function<std::map<std::string, std::uint64_t>()> received_bytes = {};
  };

  /// `opening` and `reads` outlive the guard. If `reads` is null, no streams are ended.
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
