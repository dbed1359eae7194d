// Limits the work of a computation whose cost depends on the geometry, not only on its size.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/cancellation.h"

namespace partiemc {

/// Thrown when the work exceeds the limit.
struct TooMuchWork {};

/// A limit of the work of a computation, in units of about two nanoseconds. Thread-safe. The work
/// is counted, not timed, so the number of threads does not decide whether it exceeds the limit.
class WorkLimit {
 public:
  explicit WorkLimit(std::uint64_t most) : left_(static_cast<std::int64_t>(most)) {}

  /// Throws TooMuchWork if the work since the construction exceeds the limit, and Cancelled as
  /// ThrowIfCancelled.
  void Take(std::uint64_t work) {
    ThrowIfCancelled();
    if (left_.fetch_sub(static_cast<std::int64_t>(work), std::memory_order_relaxed) <
        static_cast<std::int64_t>(work)) {
      throw TooMuchWork();
    }
  }

 private:
  std::atomic<std::int64_t> left_;
};

/// Takes work from a WorkLimit in portions, so that inner loops need no atomic operation. One for
/// each thread. With a null limit, nothing is counted.
class WorkCounter {
 public:
  explicit WorkCounter(WorkLimit* limit) : limit_(limit) {}

  void Add(std::uint64_t work) {
    if (limit_ == nullptr || (taken_ += work) < kPortion) return;
    limit_->Take(taken_);
    taken_ = 0;
  }
  /// Takes the rest of the work. Call it at the end.
  void Finish() {
    if (limit_ != nullptr) limit_->Take(taken_);
    taken_ = 0;
  }

 private:
  static constexpr std::uint64_t kPortion = 1 << 16;

  WorkLimit* const limit_;
  std::uint64_t taken_ = 0;
};

}  // namespace partiemc
