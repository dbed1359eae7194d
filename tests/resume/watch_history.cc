#include "resume/watch_history.h"

namespace partiemc::resume {
namespace {

using testing::AssertionFailure;
using testing::AssertionSuccess;

}  // namespace

WatchHistory WatchAll(client::Watcher& watcher) {
  WatchHistory history;
  client::WatchedFrame frame;
  for (;;) {
    const auto received = watcher.Receive(frame);
    if (!received.ok() || *received == client::Received::kEnd) {
      history.end = received.status();
      history.reason = watcher.end().reason;
      history.dropped_at_end = watcher.end().dropped;
      return history;
    }
    history.seen.push_back({.sequence = frame.sequence,
                            .dropped = frame.dropped,
                            .gap = frame.gap,
                            .rings_digest = frame.frame.rings_digest,
                            .mesh_digest = frame.frame.mesh_digest,
                            .surface_digest = frame.frame.surface_digest,
                            .rejoined = !frame.rejoined.empty(),
                            .at = Clock::now()});
  }
}

testing::AssertionResult Rising(const WatchHistory& history) {
  for (std::size_t k = 1; k < history.seen.size(); ++k) {
    if (history.seen[k].sequence <= history.seen[k - 1].sequence) {
      return AssertionFailure() << "frame " << history.seen[k].sequence << " came after frame "
                                << history.seen[k - 1].sequence;
    }
  }
  return AssertionSuccess();
}

testing::AssertionResult Accounted(const WatchHistory& history, std::uint64_t sent) {
  if (history.seen.empty()) return AssertionFailure() << "nothing was seen";
  for (std::size_t k = 1; k < history.seen.size(); ++k) {
    const WatchedAnswer &before = history.seen[k - 1], &now = history.seen[k];
    if (now.gap > 0 && !now.rejoined) {
      return AssertionFailure() << "a gap before frame " << now.sequence << " without a loss";
    }
    if (now.sequence != before.sequence + now.dropped + now.gap + 1) {
      return AssertionFailure() << "from frame " << before.sequence << " to " << now.sequence
                                << " with " << now.dropped << " dropped and a gap of " << now.gap;
    }
  }
  const std::uint64_t last = history.seen.back().sequence;
  if (last + history.dropped_at_end != sent) {
    return AssertionFailure() << "the last frame was " << last << " of " << sent << ", with "
                              << history.dropped_at_end << " dropped after it";
  }
  return AssertionSuccess();
}

testing::AssertionResult Identical(const WatchHistory& history, const History& undisturbed) {
  for (const WatchedAnswer& seen : history.seen) {
    if (seen.sequence < 1 || seen.sequence > undisturbed.answers.size()) {
      return AssertionFailure() << "there is no frame " << seen.sequence;
    }
    const Answer& made = undisturbed.answers[seen.sequence - 1];
    if (seen.rings_digest != made.rings_digest || seen.mesh_digest != made.mesh_digest ||
        seen.surface_digest != made.surface_digest) {
      return AssertionFailure() << "frame " << seen.sequence << " is another one";
    }
  }
  return AssertionSuccess();
}

}  // namespace partiemc::resume
