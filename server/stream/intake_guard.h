// Bounds what comes in before anybody has been told of it.
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

/// gRPC puts a message together before it says how large it is, even one larger than it may
/// receive, so nobody can count what calls without a request hold, nor what watchers send. This
/// looks at the memory of the whole process instead, every few milliseconds and only while there
/// are such calls: as long as it is too much, half of the calls of the caller that has most of them
/// give way, the oldest first; whose request comes at once is next to never among them. Watchers
/// give way only where giving free memory back has not been enough.
///
/// Frames of open streams that are on their way count as planned (ReadPermits), and stay. Only
/// where such a stream brings more than was planned, and that is too much, it is ended.
class IntakeGuard {
 public:
  /// What the process is asked for; another for tests.
  struct Process {
    std::function<std::uint64_t()> resident_bytes;
    /// What it may hold now, and what it may hold beside that; asked for where that is too little.
    std::function<std::uint64_t()> most_bytes, more_bytes;
    std::function<void()> give_back_freed;
    /// The most that it may ever hold; asked for with `received_bytes`.
    std::uint64_t limit_bytes = 0;
    /// What each connection has received so far, by peer (ReceivedBytesOfConnections).
    std::function<std::map<std::string, std::uint64_t>()> received_bytes = {};
  };

  /// `opening` and `reads` live longer. Without `reads` streams are not watched.
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
