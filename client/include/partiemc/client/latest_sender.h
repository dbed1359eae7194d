// For a simulator that must never wait: of the frames that come while the stream is busy only the
// newest one is sent.
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

/// What became of the frames that were offered, so far. Those that are in none of them wait.
struct OfferCounts {
  std::uint64_t sent = 0;     ///< Or being sent.
  std::uint64_t skipped = 0;  ///< A newer one came before the stream had taken them.
  std::uint64_t refused = 0;  ///< They broke a rule that the stream checks before it sends.
};

/// Told of every frame what becomes of it, in the order in which frames were offered. The calls are
/// never at the same time; they hold up the next offer, so they must be quick and may not call the
/// sender. Frames are numbered from 1 as they are offered.
struct OfferHooks {
  /// It is about to be sent, with the next sequence number of the stream.
  std::function<void(std::uint64_t offer)> sending = [](std::uint64_t) {};
  std::function<void(std::uint64_t offer)> skipped = [](std::uint64_t) {};
  /// After `sending`: the stream has not taken it, and its sequence number is not used up.
  std::function<void(std::uint64_t offer, const absl::Status&)> refused =
      [](std::uint64_t, const absl::Status&) {};
};

/// Give the stream kShortPatience as ReconnectPolicy::give_up_after if the simulator has to learn
/// soon that its server is gone; frames are skipped until then.
///
/// Beside the window of the stream there is one frame that waits for a place in it and one that
/// waits for that: memory for two copies of a frame, which is used again. One thread offers; the
/// sending is done by a thread of its own. Answers are received from the stream as ever; `time`
/// tells which frame they belong to, or the order of `OfferHooks::sending`.
class LatestSender {
 public:
  /// `stream` outlives this, and nobody else sends on it.
  explicit LatestSender(FrameStream& stream, OfferHooks hooks = {});
  /// Cancels the stream unless Finish has returned.
  ~LatestSender();
  LatestSender(const LatestSender&) = delete;
  LatestSender& operator=(const LatestSender&) = delete;

  /// Copies the frame and returns: costs the copying, whatever the stream does.
  /// Errors: whatever ended the stream before; FAILED_PRECONDITION after Finish.
  absl::Status Offer(const Frame& frame, double time);
  /// The same of arrays that lie anywhere. Errors: also INVALID_ARGUMENT with a Violation (reason
  /// COUNT) for a coordinate that is missing; such particles count as never offered.
  absl::Status OfferArrays(const ParticleArrays& particles, double time);

  /// No more frames will come. Waits until the newest one has been sent, then finishes sending on
  /// the stream. Errors: whatever ended the stream.
  absl::Status Finish();

  OfferCounts counts() const;

 private:
  class Sending;
  std::unique_ptr<Sending> sending_;
};

}  // namespace partiemc::client
