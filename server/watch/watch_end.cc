#include "server/watch/watch_end.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::server {

WatchEnd WatchEnd::With(absl::Status status) {
  const auto violation = FindViolation(status);
  return {.reason = violation ? violation->reason : absl::StatusCodeToString(status.code()),
          .message = std::string(status.message()),
          .status = std::move(status)};
}

WatchEnd WatchEnd::FellBehind(std::size_t frames, std::size_t bytes, std::size_t max_bytes) {
  return With(ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonFellBehind), "watcher",
       absl::StrCat(frames, " frames of ", bytes, " bytes behind"),
       absl::StrCat("must be at most ", max_bytes,
                    " bytes behind in mode `every`; give credit sooner, or watch in mode "
                    "`latest`")}));
}

WatchEnd WatchEnd::TooLarge(std::size_t bytes, std::size_t max_bytes) {
  return With(ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonWatchedBytes), "frame", absl::StrCat(bytes, " bytes"),
       absl::StrCat("must be at most ", max_bytes,
                    " to be watched; have the producer ask for less, or start the server with a "
                    "larger --max-watcher-bytes")}));
}

WatchEnd WatchEnd::NoLongerHeld(std::uint64_t frames) {
  return With(ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonFellBehind), "watcher", absl::StrCat(frames, " frames behind"),
       "must not be so far behind in mode `every` that frames are no longer held; give credit "
       "sooner, watch in mode `latest`, or start the server with larger --history-bytes"}));
}

WatchEnd WatchEnd::ResultsLost(std::uint64_t results) {
  return {.reason = std::string(kReasonProducerLost),
          .message = absl::StrCat(results, " results were lost on their way between servers"),
          .status = {}};
}

WatchEnd WatchEnd::OfStream(const absl::Status& status) {
  if (status.ok()) return {std::string(kReasonFinished), "the producer has finished", {}};
  if (absl::IsCancelled(status)) {
    return {std::string(kReasonProducerLost), "the producer's connection is gone", {}};
  }
  WatchEnd end = With(status);
  // If the producer broke a rule, the calls of its watchers end with OK. They end with UNAVAILABLE
  // only if the server could not continue the stream.
  if (!absl::IsUnavailable(status)) end.status = absl::OkStatus();
  return end;
}

}  // namespace partiemc::server
