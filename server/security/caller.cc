#include "server/security/caller.h"

#include <limits>
#include <optional>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/base/name_pattern.h"

namespace partiemc::server {
namespace {

struct Words {
  std::string_view reason, field;
};

Words WordsOf(CallerAccount::Kind kind) {
  switch (kind) {
    case CallerAccount::Kind::kCall:
    case CallerAccount::Kind::kProbe:
    case CallerAccount::Kind::kReflection:
      return {kReasonCallerCalls, "caller.calls"};
    case CallerAccount::Kind::kStream:
      return {kReasonCallerStreams, "caller.streams"};
    case CallerAccount::Kind::kWatcher:
      return {kReasonCallerWatchers, "caller.watchers"};
  }
  return {};
}

std::uint32_t LimitOf(const CallerQuota& quota, CallerAccount::Kind kind) {
  constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
  switch (kind) {
    case CallerAccount::Kind::kCall:
    case CallerAccount::Kind::kProbe:
      return quota.calls.value_or(kNone);
    case CallerAccount::Kind::kStream:
      return quota.streams.value_or(kNone);
    case CallerAccount::Kind::kWatcher:
      return quota.watchers.value_or(kNone);
    case CallerAccount::Kind::kReflection:
      return CallerAccount::kMaxReflectionCalls;
  }
  return kNone;
}

// End of the error text for an exceeded quota: states the owner of the quota and when to retry.
constexpr char kOfOneCaller[] =
    " of one caller, which is a token or, without tokens, an address; try again when a call of it "
    "has ended";

absl::Status TooMuch(std::string_view reason, std::string_view field, std::string value,
                     const std::string& rule) {
  return ViolationError(absl::StatusCode::kResourceExhausted,
                        {std::string(reason), std::string(field), std::move(value),
                         absl::StrCat(rule, kOfOneCaller)});
}

absl::Status NotPermitted(std::string_view field, std::string value, std::string_view rule) {
  return ViolationError(
      absl::StatusCode::kPermissionDenied,
      {std::string(kReasonNotPermitted), std::string(field), std::move(value), std::string(rule)});
}

absl::Status CheckMay(bool may, const std::string& action) {
  if (may) return absl::OkStatus();
  return NotPermitted(
      "authorization", absl::StrCat("a token that may not ", action),
      absl::StrCat("must be one that may ", action, " (`may=` in the server's --token-file)"));
}

}  // namespace

CallerAccount::Place::~Place() {
  if (account_ == nullptr) return;
  const MutexLock lock(account_->mutex_);
  --account_->held_[static_cast<std::size_t>(kind_)];
}

void CallerAccount::SetQuota(CallerQuota quota) {
  const MutexLock lock(mutex_);
  quota_ = quota;
}

CallerQuota CallerAccount::quota() const {
  const MutexLock lock(mutex_);
  return quota_;
}

absl::StatusOr<CallerAccount::Place> CallerAccount::Take(Kind kind) {
  const MutexLock lock(mutex_);
  std::uint32_t& held = held_[static_cast<std::size_t>(kind)];
  const std::uint32_t most = LimitOf(quota_, kind);
  if (held >= most) {
    const Words words = WordsOf(kind);
    return TooMuch(words.reason, words.field, absl::StrCat(held, " going on"),
                   absl::StrCat("must be at most ", most));
  }
  ++held;
  return Place(shared_from_this(), kind);
}

std::uint32_t CallerAccount::held(Kind kind) const {
  const MutexLock lock(mutex_);
  return held_[static_cast<std::size_t>(kind)];
}

absl::Status TooManyBytesOfCaller(std::uint64_t bytes) {
  return TooMuch(kReasonCallerBytes, "caller.bytes", absl::StrCat(bytes, " more"),
                 "must not make it more than is free, nor more than the `bytes=`");
}

Caller::Caller()
    : terms_(std::make_shared<const CallerTerms>()), account_(std::make_shared<CallerAccount>()) {}

absl::Status Caller::CheckMayProduce() const { return CheckMay(terms_->may_produce, "produce"); }
absl::Status Caller::CheckMayWatch() const { return CheckMay(terms_->may_watch, "watch"); }
absl::Status Caller::CheckMayList() const { return CheckMay(terms_->may_list, "list"); }

absl::Status Caller::CheckMayUse(std::string_view stream_name) const {
  if (MayUse(stream_name)) return absl::OkStatus();
  return NotPermitted("open.stream_name", Quoted(stream_name),
                      "must be a name that this token may use (`names=` in the server's "
                      "--token-file)");
}

}  // namespace partiemc::server
