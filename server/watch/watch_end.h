// The reasons and messages with which watches end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc::server {

/// Reasons for which a watch ends, in addition to the reasons for which a stream ends
/// (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonFellBehind = "FELL_BEHIND";
inline constexpr std::string_view kReasonWatchedBytes = "WATCHED_BYTES";
inline constexpr std::string_view kReasonFinished = "FINISHED";
inline constexpr std::string_view kReasonProducerLost = "PRODUCER_LOST";
inline constexpr std::string_view kReasonCreditUsed = "CREDIT_USED";

/// Why a watch ends, for its watcher.
struct WatchEnd {
  std::string reason;
  std::string message;  ///< For people.
  absl::Status status;  ///< Status of the call.
  /// Result number of the stream's last result, which may not have been offered to watchers.
  std::uint64_t last_number = 0;

  /// The end of a watch whose stream has ended with `status`.
  static WatchEnd OfStream(const absl::Status& status);
  /// The end of a watch with the reason and the message of `status`.
  static WatchEnd With(absl::Status status);
  /// The end of a watch in mode `every` that is too slow: its pending frames exceed `max_bytes`.
  static WatchEnd FellBehind(std::size_t frames, std::size_t bytes, std::size_t max_bytes);
  /// The end of a watch that is too slow: the history has dropped its next `frames` frames.
  static WatchEnd NoLongerHeld(std::uint64_t frames);
  /// The end of a watch in mode `every`: `results` results before its next one were lost between
  /// servers. The watcher may watch again, as after the loss of the producer.
  static WatchEnd ResultsLost(std::uint64_t results);
  /// The end of a watch whose next frame exceeds `max_bytes`.
  static WatchEnd TooLarge(std::size_t bytes, std::size_t max_bytes);
};

}  // namespace partiemc::server
