// Cancels a frame: its tasks check the caller's flag and throw Cancelled. Reconstruct catches it.
#pragma once

#include <atomic>
#include <cstdint>

namespace partiemc {

/// Thrown by the tasks of a cancelled frame. Reconstruct returns CANCELLED.
struct Cancelled {};

/// Sets the cancellation flag of this thread; null: no flag. The end of the scope restores the
/// previous flag. Tasks inherit the flag of the thread that created them (parallel.h).
class CancellationScope {
 public:
  explicit CancellationScope(const std::atomic<bool>* flag) : outer_(current_) { current_ = flag; }
  ~CancellationScope() { current_ = outer_; }
  CancellationScope(const CancellationScope&) = delete;
  CancellationScope& operator=(const CancellationScope&) = delete;

  /// The flag of the calling thread, or null.
  static const std::atomic<bool>* Current() { return current_; }

 private:
  static inline constinit thread_local const std::atomic<bool>* current_ = nullptr;
  const std::atomic<bool>* const outer_;
};

/// Throws Cancelled if the flag is set. The relaxed order is enough: the flag guards no other data
/// and is never reset, so a late read only delays the end.
inline void ThrowIfCancelled(const std::atomic<bool>* flag) {
  if (flag != nullptr && flag->load(std::memory_order_relaxed)) [[unlikely]] {
    throw Cancelled();
  }
}

/// Checks the flag of the calling thread. Sequential code calls it about once per million steps;
/// parallel.h checks the flag by itself.
inline void ThrowIfCancelled() { ThrowIfCancelled(CancellationScope::Current()); }

/// Loops with more work per step, such as one particle or cell, check the flag after this many.
inline constexpr std::uint32_t kItemsPerCheck = 1 << 16;

}  // namespace partiemc
