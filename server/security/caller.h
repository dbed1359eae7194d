// A caller: its permissions, and the account that counts the resources it holds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/mutex.h"
#include "server/security/caller_terms.h"

namespace partiemc::server {

/// Reasons of refused requests (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonNotPermitted = "NOT_PERMITTED";
inline constexpr std::string_view kReasonCallerCalls = "CALLER_CALLS";
inline constexpr std::string_view kReasonCallerStreams = "CALLER_STREAMS";
inline constexpr std::string_view kReasonCallerWatchers = "CALLER_WATCHERS";
inline constexpr std::string_view kReasonCallerBytes = "CALLER_BYTES";

/// Counts the resources that a caller holds. Health checks (kProbe) count apart from other calls,
/// with the same limit. A call of reflection counts as kCall and as kReflection. All calls with the
/// same token share an account. All calls without a token from the same host share one
/// (HostOfPeer). ComputePool and FairShare identify callers by the memory address of this object.
/// Thread-safe.
class CallerAccount : public std::enable_shared_from_this<CallerAccount> {
 public:
  enum class Kind { kCall, kStream, kWatcher, kProbe, kReflection };

  /// The limit of kReflection, because gRPC uses a thread for each of these calls.
  static constexpr std::uint32_t kMaxReflectionCalls = 4;

  /// One counted resource. The destructor releases it. Keeps the account alive.
  class Place {
   public:
    Place() = default;
    Place(Place&& other) noexcept = default;
    Place& operator=(Place&& other) noexcept {
      std::swap(account_, other.account_);
      std::swap(kind_, other.kind_);
      return *this;
    }
    ~Place();

    const CallerAccount* account() const { return account_.get(); }

   private:
    friend class CallerAccount;
    Place(std::shared_ptr<CallerAccount> account, Kind kind)
        : account_(std::move(account)), kind_(kind) {}

    std::shared_ptr<CallerAccount> account_;  // Null: empty.
    Kind kind_ = Kind::kCall;
  };

  explicit CallerAccount(CallerQuota quota = {}) : quota_(quota) {}

  /// Sets the quota for further resources. Resources that the caller already holds stay, even if
  /// they exceed the quota.
  void SetQuota(CallerQuota quota) ABSL_LOCKS_EXCLUDED(mutex_);
  CallerQuota quota() const ABSL_LOCKS_EXCLUDED(mutex_);

  /// Takes one resource of this kind. Requires: this object is held by shared_ptr.
  /// Errors: RESOURCE_EXHAUSTED (CALLER_CALLS, CALLER_STREAMS, CALLER_WATCHERS).
  absl::StatusOr<Place> Take(Kind kind) ABSL_LOCKS_EXCLUDED(mutex_);
  std::uint32_t held(Kind kind) const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  static constexpr std::size_t kKinds = 5;

  mutable Mutex mutex_;
  CallerQuota quota_ ABSL_GUARDED_BY(mutex_);
  std::array<std::uint32_t, kKinds> held_ ABSL_GUARDED_BY(mutex_){};
};

/// RESOURCE_EXHAUSTED (CALLER_BYTES): with `bytes` more, the caller would exceed its quota or its
/// fair share (FairShare).
absl::Status TooManyBytesOfCaller(std::uint64_t bytes);

/// An admitted caller. A call keeps the terms with which it began, even if the token file changes;
/// the account always has the current quota.
class Caller {
 public:
  /// A caller with all permissions and a new account.
  Caller();
  Caller(std::shared_ptr<const CallerTerms> terms, std::shared_ptr<CallerAccount> account)
      : terms_(std::move(terms)), account_(std::move(account)) {}

  /// For the log; empty without tokens.
  const std::string& name() const { return terms_->name; }
  const std::shared_ptr<CallerAccount>& account() const { return account_; }
  bool MayUse(std::string_view stream_name) const { return terms_->MayUse(stream_name); }

  /// Check a permission. Errors: PERMISSION_DENIED (NOT_PERMITTED), which does not reveal whether a
  /// stream exists.
  absl::Status CheckMayProduce() const;
  absl::Status CheckMayWatch() const;
  absl::Status CheckMayList() const;
  absl::Status CheckMayUse(std::string_view stream_name) const;

 private:
  std::shared_ptr<const CallerTerms> terms_;
  std::shared_ptr<CallerAccount> account_;
};

}  // namespace partiemc::server
