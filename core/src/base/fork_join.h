// Annotates tasks for ThreadSanitizer, which cannot see how oneTBB hands work from thread to
// thread, because Debian's oneTBB is not instrumented. Compiles to nothing without the sanitizer.
#pragma once

#if defined(__SANITIZE_THREAD__)
#define PARTIEMC_THREAD_SANITIZER
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define PARTIEMC_THREAD_SANITIZER
#endif
#endif
#ifdef PARTIEMC_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>
#endif

namespace partiemc {

/// A fork into tasks at its construction, and their join at its destruction.
///
///        thread:  construction -----------------------------> destruction
///                     |   \                                     ^   ^
///        task:        |    `--> Task(), work, ~Task() ---------'    |
///        task:        `-------> Task(), work, ~Task() --------------'
///
/// The annotations declare the order that the arrows show, and no other order. No arrow leads from
/// task to task, so the sanitizer still reports races between tasks.
class ForkJoin {
 public:
  ForkJoin() { Release(&fork_); }
  ~ForkJoin() { Acquire(&join_); }
  ForkJoin(const ForkJoin&) = delete;
  ForkJoin& operator=(const ForkJoin&) = delete;

  /// The scope of one task, on the thread that runs it.
  class Task {
   public:
    explicit Task(ForkJoin& fork_join) : fork_join_(fork_join) { Acquire(&fork_join_.fork_); }
    ~Task() { Release(&fork_join_.join_); }
    Task(const Task&) = delete;
    Task& operator=(const Task&) = delete;

   private:
    ForkJoin& fork_join_;
  };

 private:
#ifdef PARTIEMC_THREAD_SANITIZER
  static void Acquire(char* order) { __tsan_acquire(order); }
  static void Release(char* order) { __tsan_release(order); }
#else
  static void Acquire(char*) {}
  static void Release(char*) {}
#endif

  char fork_, join_;  // Only their addresses matter.
};

}  // namespace partiemc
