// The threads that Reconstruct may compute with.
#pragma once

#include "absl/functional/function_ref.h"

namespace partiemc {

class TaskArena;

/// Places for threads that compute, oneTBB's task arena: what runs in it, with its parallel parts,
/// has these places together. Reconstruct outside of any has one for each processor.
class Arena {
 public:
  /// 0 `threads`: one for each processor.
  explicit Arena(unsigned threads);
  /// Requires: no call of Execute is under way.
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  /// Runs `body`, and returns when it is done or throws what it throws. It may run in another
  /// thread, where the arena has no place for this one. Safe to call from several threads at once.
  void Execute(absl::FunctionRef<void()> body);

 private:
  TaskArena* const arena_;
};

}  // namespace partiemc
