// A mutex with the annotations of Clang's thread-safety analysis.
//
// The standard library of GCC does not annotate std::mutex. ThreadSanitizer reports false races for
// absl::Mutex, because Debian's abseil is compiled without it. These classes wrap the standard
// ones.
//
//   Mutex mutex_;
//   CondVar changed_;
//   int count_ ABSL_GUARDED_BY(mutex_) = 0;
//   ...
//   const MutexLock lock(mutex_);
//   while (count_ == 0) changed_.Wait(mutex_);
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "absl/base/thread_annotations.h"

namespace partiemc {

class ABSL_LOCKABLE Mutex {
 public:
  Mutex() = default;
  Mutex(const Mutex&) = delete;
  Mutex& operator=(const Mutex&) = delete;

  void Lock() ABSL_EXCLUSIVE_LOCK_FUNCTION() { mutex_.lock(); }
  void Unlock() ABSL_UNLOCK_FUNCTION() { mutex_.unlock(); }
  bool TryLock() ABSL_EXCLUSIVE_TRYLOCK_FUNCTION(true) { return mutex_.try_lock(); }
  /// States to the analysis that this thread holds the mutex. For lambdas; checks nothing.
  void AssertHeld() const ABSL_ASSERT_EXCLUSIVE_LOCK() {}

 private:
  friend class CondVar;
  std::mutex mutex_;
};

/// Holds a mutex for a scope.
class ABSL_SCOPED_LOCKABLE MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) ABSL_EXCLUSIVE_LOCK_FUNCTION(mutex) : mutex_(mutex) {
    mutex_.Lock();
  }
  /// For a mutex that the caller has locked, by TryLock for example.
  MutexLock(Mutex& mutex, std::adopt_lock_t) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) : mutex_(mutex) {}
  ~MutexLock() ABSL_UNLOCK_FUNCTION() { mutex_.Unlock(); }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

 private:
  Mutex& mutex_;
};

// For the constructor of a scoped class that releases `mutex`. With this attribute, unlike
// ABSL_UNLOCK_FUNCTION, Clang's analysis knows that the destructor locks the mutex again.
#ifdef __clang__
#define PARTIEMC_RELEASE(mutex) __attribute__((release_capability(mutex)))
#else
#define PARTIEMC_RELEASE(mutex)
#endif

/// Releases a mutex for a scope, and locks it again at its end.
class ABSL_SCOPED_LOCKABLE MutexUnlock {
 public:
  explicit MutexUnlock(Mutex& mutex) PARTIEMC_RELEASE(mutex) : mutex_(mutex) { mutex_.Unlock(); }
  // The analysis reverses the constructor here.
  ~MutexUnlock() ABSL_UNLOCK_FUNCTION() { mutex_.Lock(); }
  MutexUnlock(const MutexUnlock&) = delete;
  MutexUnlock& operator=(const MutexUnlock&) = delete;

 private:
  Mutex& mutex_;
};

#undef PARTIEMC_RELEASE

/// A wait may end without a notification, so callers wait in a loop.
class CondVar {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// Releases `mutex` while it waits and holds it again when it returns.
  void Wait(Mutex& mutex) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    std::unique_lock lock(mutex.mutex_, std::adopt_lock);
    changed_.wait(lock);
    lock.release();
  }
  /// As Wait, at most until `until`. Returns false if `until` has passed.
  bool WaitUntil(Mutex& mutex, TimePoint until) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    std::unique_lock lock(mutex.mutex_, std::adopt_lock);
    const bool in_time = changed_.wait_until(lock, until) == std::cv_status::no_timeout;
    lock.release();
    return in_time;
  }
  void NotifyOne() { changed_.notify_one(); }
  void NotifyAll() { changed_.notify_all(); }

 private:
  std::condition_variable changed_;
};

}  // namespace partiemc
