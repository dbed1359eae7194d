// How a frame is stopped on its way: whoever works on it looks at the caller's flag now and then
// and leaves by an exception, which Reconstruct catches.
#pragma once

#include <atomic>

namespace partiemc {

/// Thrown where a frame has been cancelled. Comes out of Reconstruct as CANCELLED.
struct Cancelled {};

/// What this thread works for may be cancelled by this flag, as long as the scope lives; by none
/// where it is null. Tasks have the flag of the thread that made them (parallel.h).
class CancellationScope {
 public:
  explicit CancellationScope(const std::atomic<bool>* flag) : outer_(current_) { current_ = flag; }
  ~CancellationScope() { current_ = outer_; }
  CancellationScope(const CancellationScope&) = delete;
  CancellationScope& operator=(const CancellationScope&) = delete;

  /// That of the calling thread, or null.
  static const std::atomic<bool>* Current() { return current_; }

 private:
  static inline constinit thread_local const std::atomic<bool>* current_ = nullptr;
  const std::atomic<bool>* const outer_;
};

/// The flag carries nothing but itself, and is never taken back: whoever sees it late, stops late.
inline void ThrowIfCancelled(const std::atomic<bool>* flag) {
  if (flag != nullptr && flag->load(std::memory_order_relaxed)) [[unlikely]] {
    throw Cancelled();
  }
}

/// For loops that no task divides, where a million steps may come in a row.
inline void ThrowIfCancelled() { ThrowIfCancelled(CancellationScope::Current()); }

}  // namespace partiemc
