// Limits the threads that Reconstruct uses.
#pragma once

#include "absl/functional/function_ref.h"

namespace partiemc {

class TaskArena;

/// A oneTBB task arena. Everything that runs in it shares its threads. Outside any arena,
/// Reconstruct uses one thread per processor.
class Arena {
 public:
  /// `threads` = 0: one per processor.
  explicit Arena(unsigned threads);
  /// Requires: no Execute call is running.
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  /// Runs `body` in the arena and waits for it; rethrows its exception. If no slot is free for the
  /// calling thread, `body` runs on another thread. Thread-safe.
  void Execute(absl::FunctionRef<void()> body);

 private:
  TaskArena* const arena_;
};

}  // namespace partiemc
