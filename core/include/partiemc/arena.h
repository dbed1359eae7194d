// Limits the threads that Reconstruct uses.
#pragma once

#include "absl/functional/function_ref.h"

namespace partiemc {

class TaskArena;

/// A oneTBB task arena: a set of threads, shared by everything that runs in the arena. Outside any
/// arena, Reconstruct uses one thread per processor.
class Arena {
 public:
  /// Creates an arena of `threads` threads; 0 means one thread per processor.
  explicit Arena(unsigned threads);
  /// Requires: no Execute call is running.
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  /// Runs `body` in the arena and waits until it ends; rethrows its exception. If the arena has no
  /// free slot for the calling thread, `body` runs on another thread. Thread-safe.
  void Execute(absl::FunctionRef<void()> body);

 private:
  TaskArena* const arena_;
};

}  // namespace partiemc
