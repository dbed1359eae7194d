// How watches end, and in which words their watchers are told.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc::server {

/// The reasons for which a watch ends, beside those of StreamStateMachine (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonFellBehind = "FELL_BEHIND";
inline constexpr std::string_view kReasonWatchedBytes = "WATCHED_BYTES";
inline constexpr std::string_view kReasonFinished = "FINISHED";
inline constexpr std::string_view kReasonProducerLost = "PRODUCER_LOST";
inline constexpr std::string_view kReasonCreditUsed = "CREDIT_USED";

/// Why a watch ends, told to its watcher.
struct WatchEnd {
  std::string reason;
  std::string message;  ///< For a person.
  absl::Status status;  ///< Of the call.
  /// The number of the stream's last result, where watchers may not have been offered it.
  std::uint64_t last_number = 0;

  /// For the watchers of a stream that ended with `status`.
  static WatchEnd OfStream(const absl::Status& status);
  /// Says the same as the error that ends the call.
  static WatchEnd With(absl::Status status);
  /// Of one in mode `every` that does not take what waits for it, frames of so many bytes.
  static WatchEnd FellBehind(std::size_t frames, std::size_t bytes, std::size_t max_bytes);
  /// Likewise where they are not in the stream's history any more.
  static WatchEnd NoLongerHeld(std::uint64_t frames);
  /// Of a frame that no watcher may hold.
  static WatchEnd TooLarge(std::size_t bytes, std::size_t max_bytes);
};

}  // namespace partiemc::server
