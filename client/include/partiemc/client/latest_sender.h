// Sends frames of a simulator that must never wait. While the stream is busy, only the newest frame
// is kept; older ones are skipped.
//
//   partiemc::client::LatestSender sender(**stream);
//   while (simulation.Step()) {
//     sender.Offer({.positions = std::span<const float>(simulation.xy())}, simulation.time());
//   }
//   sender.Finish();
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "absl/status/status.h"
#include "partiemc/client/frame_stream.h"

namespace partiemc::client {

/// Counts of offered frames by outcome. A frame in none of the counts is waiting, or the stream
/// ended before it was sent.
struct OfferCounts {
  std::uint64_t sent = 0;     ///< Sent or being sent.
  std::uint64_t skipped = 0;  ///< Replaced by a newer frame before the stream accepted them.
  std::uint64_t refused = 0;  ///< Refused by a check that the stream makes before it sends.
};

/// Callbacks for the outcome of each offered frame, called one at a time: `skipped` on the thread
/// that offers, the others on the sending thread. They delay the next offer, so they must be quick.
/// They must not call the sender. Frames are numbered from 1 as they are offered.
struct OfferHooks {
  /// Called before the frame is sent with the next sequence number of the stream.
  std::function<void(std::uint64_t offer)> sending = [](std::uint64_t) {};
  std::function<void(std::uint64_t offer)> skipped = [](std::uint64_t) {};
  /// Called after `sending` if the stream refused the frame; its sequence number is reused.
  std::function<void(std::uint64_t offer, const absl::Status&)> refused =
      [](std::uint64_t, const absl::Status&) {};
};

/// One thread offers; an internal thread sends. While the server is lost, frames are skipped. If
/// the simulator must soon receive an error, set ReconnectPolicy::give_up_after to kShortPatience.
///
/// Two frames wait in addition to the window: one that is being sent and the newest one. Their
/// memory is reused. Any one thread receives events from the stream as usual. `time` or the order
/// of `OfferHooks::sending` identifies the frame of a result.
class LatestSender {
 public:
  /// `stream` must outlive this object; no other code sends on it.
  explicit LatestSender(FrameStream& stream, OfferHooks hooks = {});
  /// Cancels the stream unless Finish has returned.
  ~LatestSender();
  LatestSender(const LatestSender&) = delete;
  LatestSender& operator=(const LatestSender&) = delete;

  /// Copies the frame and returns. Never waits for the stream.
  /// Errors: the status that ended the stream; FAILED_PRECONDITION after Finish.
  absl::Status Offer(const Frame& frame, double time);
  /// Same as Offer for arrays with arbitrary strides. Errors: also those of
  /// FrameStream::SendArrays for the arrays and the time; such an offer is not counted.
  absl::Status OfferArrays(const ParticleArrays& particles, double time);

  /// Waits until the newest frame has been sent, then calls FinishSending on the stream. Errors:
  /// the status that ended the stream.
  absl::Status Finish();

  OfferCounts counts() const;

 private:
  class Sending;
  std::unique_ptr<Sending> sending_;
};

}  // namespace partiemc::client
