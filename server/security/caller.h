// Who calls: what it may, and the account of what it holds of the server.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/security/caller_terms.h"

namespace partiemc::server {

/// The reasons for which a caller does not get what it asks for (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonNotPermitted = "NOT_PERMITTED";
inline constexpr std::string_view kReasonCallerCalls = "CALLER_CALLS";
inline constexpr std::string_view kReasonCallerStreams = "CALLER_STREAMS";
inline constexpr std::string_view kReasonCallerWatchers = "CALLER_WATCHERS";
inline constexpr std::string_view kReasonCallerBytes = "CALLER_BYTES";

/// What one caller holds of the server: one for each token, shared by all calls with it; without
/// tokens one for each peer (PeerAccounts). Its address tells callers from each other wherever they
/// take turns or share (ComputePool, FairShare). Safe from any thread.
class CallerAccount : public std::enable_shared_from_this<CallerAccount> {
 public:
  enum class Kind { kCall, kStream, kWatcher };

  /// One of what is counted, until it goes. It keeps the account alive.
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

    std::shared_ptr<CallerAccount> account_;  // None: no place.
    Kind kind_ = Kind::kCall;
  };

  explicit CallerAccount(CallerQuota quota = {}) : quota_(quota) {}

  /// Counts for what is taken from now on; what is held stays, even if it is more.
  void SetQuota(CallerQuota quota);
  CallerQuota quota() const;

  /// Held by shared_ptr only.
  /// Errors: RESOURCE_EXHAUSTED (CALLER_CALLS, CALLER_STREAMS, CALLER_WATCHERS).
  absl::StatusOr<Place> Take(Kind kind);
  std::uint32_t held(Kind kind) const;

 private:
  static constexpr std::size_t kKinds = 3;

  mutable std::mutex mutex_;  // Guards everything below.
  CallerQuota quota_;
  std::array<std::uint32_t, kKinds> held_{};
};

/// RESOURCE_EXHAUSTED (CALLER_BYTES) for a caller that wants so many more than its share.
absl::Status TooManyBytesOfCaller(std::uint64_t bytes);

/// A caller as it was let in. What a call does it does with one of these, from its beginning on:
/// the terms stay those of that moment, the account is the one in force.
class Caller {
 public:
  /// May everything, with an account of its own.
  Caller();
  Caller(std::shared_ptr<const CallerTerms> terms, std::shared_ptr<CallerAccount> account)
      : terms_(std::move(terms)), account_(std::move(account)) {}

  /// For the log; empty where no token is wanted.
  const std::string& name() const { return terms_->name; }
  const std::shared_ptr<CallerAccount>& account() const { return account_; }
  bool MayUse(std::string_view stream_name) const { return terms_->MayUse(stream_name); }

  /// Errors of each: PERMISSION_DENIED (NOT_PERMITTED), which tells nothing of what there is.
  absl::Status CheckMayProduce() const;
  absl::Status CheckMayWatch() const;
  absl::Status CheckMayList() const;
  absl::Status CheckMayUse(std::string_view stream_name) const;

 private:
  std::shared_ptr<const CallerTerms> terms_;
  std::shared_ptr<CallerAccount> account_;
};

}  // namespace partiemc::server
