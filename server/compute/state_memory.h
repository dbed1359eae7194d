// Limits the memory that the states of all streams hold between their frames.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "common/mutex.h"
#include "server/compute/fair_share.h"
#include "server/security/caller.h"

namespace partiemc::server {

/// Counts the states of streams against a capacity that no frame can use. Callers share it
/// (FairShare) within their quotas; one caller has at most half. The first `free_bytes` of each
/// state are not counted. Thread-safe.
class StateMemory {
 public:
  /// Counts the state of one stream. The destructor gives the counted bytes back.
  class Account {
   public:
    /// Counts nothing, and every state fits.
    Account() = default;
    /// `memory` outlives the account.
    Account(StateMemory& memory, std::shared_ptr<const CallerAccount> caller)
        : memory_(&memory), caller_(std::move(caller)) {}
    ~Account() { Shrink(0); }
    Account(Account&& other) noexcept { Swap(other); }
    Account& operator=(Account&& other) noexcept {
      Swap(other);
      return *this;
    }

    /// Raises the size of the largest allowed state to `bytes`; no effect if it is that large.
    /// Errors: RESOURCE_EXHAUSTED (MEMORY_BUDGET, CALLER_BYTES); the account is then unchanged.
    absl::Status Grow(std::uint64_t bytes);
    /// Lowers the size of the largest allowed state to `bytes`; no effect if it is that small.
    void Shrink(std::uint64_t bytes);
    /// Size of the largest state that is allowed now.
    std::uint64_t bytes() const { return bytes_; }

   private:
    void Swap(Account& other) {
      std::swap(memory_, other.memory_);
      std::swap(caller_, other.caller_);
      std::swap(bytes_, other.bytes_);
    }

    StateMemory* memory_ = nullptr;
    std::shared_ptr<const CallerAccount> caller_;
    std::uint64_t bytes_ = 0;
  };

  StateMemory(std::uint64_t bytes, std::uint64_t free_bytes)
      : free_bytes_(free_bytes), share_(bytes) {}
  StateMemory(const StateMemory&) = delete;
  StateMemory& operator=(const StateMemory&) = delete;

  /// Counted bytes of all streams.
  std::uint64_t held() const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  std::uint64_t CountedOf(std::uint64_t bytes) const {
    return bytes > free_bytes_ ? bytes - free_bytes_ : 0;
  }

  const std::uint64_t free_bytes_;
  mutable Mutex mutex_;
  FairShare share_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
