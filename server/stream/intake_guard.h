// Bounds what comes in before anybody has been told of it.
#pragma once

#include <cstdint>
#include <functional>
#include <thread>

#include "server/stream/opening_calls.h"

namespace partiemc::server {

/// gRPC puts a message together before it says how large it is, even one larger than it may
/// receive, so nobody can count what calls without a request hold, nor what watchers send. This
/// looks at the memory of the whole process instead, every few milliseconds and only while there
/// are such calls: as long as it is too much, half of the calls of the caller that has most of them
/// give way, the oldest first; whose request comes at once is next to never among them. Watchers
/// give way only where giving free memory back has not been enough.
///
/// Frames of open streams that are on their way stay, one a stream, whatever their size.
class IntakeGuard {
 public:
  /// What the process is asked for; another for tests.
  struct Process {
    std::function<std::uint64_t()> resident_bytes;
    /// What it may hold now, and what it may hold beside that; asked for where that is too little.
    std::function<std::uint64_t()> most_bytes, more_bytes;
    std::function<void()> give_back_freed;
  };

  /// `opening` lives longer.
  IntakeGuard(OpeningCalls& opening, Process process);
  ~IntakeGuard();
  IntakeGuard(const IntakeGuard&) = delete;
  IntakeGuard& operator=(const IntakeGuard&) = delete;

 private:
  void Run();
  bool IsTooMuch() const;

  OpeningCalls& opening_;
  const Process process_;
  std::thread thread_;
};

}  // namespace partiemc::server
