// WatchStateMachine over an in-memory transport: what watchers receive from a producer, in which
// order and at which rate. Also under ThreadSanitizer.
#include "server/watch/watch_state_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "partiemc/status.h"
#include "server/memory_watcher.h"
#include "server/stream/stream_state_machine.h"
#include "server/watch/watch_registry.h"
#include "server/watch_fixture.h"

namespace partiemc::server {
namespace {

using ::testing::ElementsAre;

TEST_F(WatchTest, ALateOneGetsTheNewestFrameAtOnceAndAgainWhenAllHadLeft) {
  for (std::uint64_t k = 1; k <= 5; ++k) Publish(k);
  for (int round = 0; round < 3; ++round) {
    const auto watcher = Join(WatchMode::kLatest, 1);
    watcher->WaitForFrames(1);
    EXPECT_THAT(watcher->seen(), ElementsAre(SeenFrame{5, 0}));
  }
}

TEST_F(WatchTest, AFrameTooLargeToBeKeptForNobodyIsNot) {
  Publish(1);
  Publish(2, 3 * kFrameBytes);
  const auto watcher = Join(WatchMode::kLatest, 1);
  while (broadcaster_->watcher_count() == 0) std::this_thread::yield();
  Publish(3);
  watcher->WaitForFrames(1);
  EXPECT_THAT(watcher->seen(), ElementsAre(SeenFrame{3, 0}));
}

TEST_F(WatchTest, AFrameThatIsLargerThanAWatcherMayHoldEndsTheWatch) {
  for (const WatchMode mode : {WatchMode::kLatest, WatchMode::kEvery}) {
    const auto watcher = Join(mode, 9);
    while (broadcaster_->watcher_count() == 0) std::this_thread::yield();
    Publish(1, kMaxBytes);
    EXPECT_EQ(watcher->status().code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(watcher->end_reason(), kReasonWatchedBytes);
    EXPECT_EQ(watcher->end_dropped(), 1u);
  }
}

TEST_F(WatchTest, EveryHoldsAsMuchAsItMayAndEndsWithTheFirstFrameBeyond) {
  const auto watcher = Join(WatchMode::kEvery, 1);
  Publish(1);
  watcher->WaitForFrames(1);
  for (std::uint64_t k = 2; k <= 10; ++k) Publish(k);  // Nine frames without credit.
  watcher->Credit(2);
  watcher->WaitForFrames(3);
  EXPECT_EQ(watcher->seen().back(), (SeenFrame{3, 0}));
  for (std::uint64_t k = 11; k <= 14; ++k) Publish(k);  // Seven are held, and these do not all fit.
  EXPECT_EQ(watcher->status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(watcher->end_reason(), kReasonFellBehind);
  EXPECT_EQ(watcher->seen().size(), 3u);
  EXPECT_EQ(watcher->end_dropped(), watcher->machine().counts().dropped);
}

TEST_F(WatchTest, ResultsLostBetweenServersLoseTheProducerInModeEvery) {
  const auto every = Join(WatchMode::kEvery, 9), latest = Join(WatchMode::kLatest, 9);
  while (broadcaster_->watcher_count() < 2) std::this_thread::yield();
  const auto publish = [&](std::uint64_t number, std::uint64_t last_loss) {
    broadcaster_->PublishNumbered(
        {std::make_shared<NumberedFrame>(number, kFrameBytes), number, number, last_loss});
  };
  publish(1, 0);
  every->WaitForFrames(1);
  latest->WaitForFrames(1);
  publish(4, 4);
  EXPECT_TRUE(every->status().ok());
  EXPECT_EQ(every->end_reason(), kReasonProducerLost);
  EXPECT_EQ(every->end_dropped(), 3u);
  latest->WaitForFrames(2);
  EXPECT_EQ(latest->seen().back(), (SeenFrame{4, 2}));
}

TEST_F(WatchTest, OneThatTakesNothingHoldsUpNobody) {
  const auto stuck = Join(WatchMode::kLatest, 1000);
  stuck->StopReading();
  const auto reading = Join(WatchMode::kEvery, 1000);
  while (broadcaster_->watcher_count() < 2) std::this_thread::yield();
  for (std::uint64_t k = 1; k <= 100; ++k) {
    Publish(k);
    reading->WaitForFrames(k);
  }
  EndStream();
  EXPECT_TRUE(reading->status().ok());
  EXPECT_EQ(reading->seen().size(), 100u);
  EXPECT_LE(stuck->seen().size(), 1u);
}

// Only the clock orders the end after the dispatcher's work, so ThreadSanitizer can see whether
// both hold the broadcaster's lock.
TEST_F(WatchTest, AStreamEndsWhileItsWatchersAreServed) {
  const auto watcher = Join(WatchMode::kLatest, 1);
  while (broadcaster_->watcher_count() == 0) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EndStream();
  EXPECT_TRUE(watcher->status().ok());
}

TEST_F(WatchTest, ADrainEndsThoseWithoutCreditAndCutsThoseWhoTakeNothing) {
  WatchRegistry registry(2);
  const auto poor = Join(WatchMode::kEvery, 1);
  const auto stuck = Join(WatchMode::kLatest, 9);
  EXPECT_TRUE(registry.Enter(poor->machine().shared_from_this()).ok());
  EXPECT_TRUE(registry.Enter(stuck->machine().shared_from_this()).ok());
  Publish(1);
  poor->WaitForFrames(1);
  stuck->WaitForFrames(1);
  stuck->StopReading();
  Publish(2);
  stuck->WaitForFrames(2);
  registry.Drain(std::chrono::steady_clock::now() + std::chrono::milliseconds(50));
  EXPECT_EQ(poor->status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(poor->end_reason(), kReasonDraining);
  EXPECT_EQ(stuck->status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(registry.Enter(poor->machine().shared_from_this()).code(),
            absl::StatusCode::kUnavailable);
}

TEST_F(WatchTest, OfWhatIsPublishedAfterItIsInAWatcherOfEveryMissesNothing) {
  for (std::uint64_t round = 0; round < 200; ++round) {
    const auto watcher = Join(WatchMode::kEvery, 9);
    watcher->WaitUntilOpened();
    const std::uint64_t first = 10 * round + 1;
    for (std::uint64_t k = first; k < first + 4; ++k) Publish(k);
    const std::size_t newest = round == 0 ? 0 : 1;  // From the previous round.
    watcher->WaitForFrames(newest + 4);
    const auto seen = watcher->seen();
    ASSERT_EQ(seen.size(), newest + 4) << "round " << round;
    EXPECT_EQ(seen[newest].number, first);
  }
}

// For ThreadSanitizer: the stream may end on another thread than the one that serves its watchers.
TEST_F(WatchTest, AnEndWhileWatchersAreServedIsNoRace) {
  for (int round = 0; round < 200; ++round) {
    broadcaster_ = std::make_shared<ResultBroadcaster>(
        dispatcher_,
        ResultBroadcaster::Limits{.mailbox_bytes = kMaxBytes, .kept_bytes = 2 * kFrameBytes});
    const auto watcher = Join(WatchMode::kLatest, 1000);
    watcher->WaitUntilOpened();
    std::thread producer([this] {
      for (std::uint64_t k = 1; k <= 30; ++k) Publish(k);
    });
    EndStream();
    producer.join();
    EXPECT_TRUE(watcher->status().ok());
    EXPECT_EQ(watcher->end_reason(), kReasonFinished);
  }
}

// Checks that reported and counted drops agree, and that every gap in the numbers was reported.
void ExpectSound(const MemoryWatcher& watcher, bool every) {
  EXPECT_EQ(watcher.unpaid(), 0u);
  const auto seen = watcher.seen();
  for (std::size_t k = 1; k < seen.size(); ++k) {
    EXPECT_EQ(seen[k].number, seen[k - 1].number + seen[k].dropped + 1);
    if (every) {
      EXPECT_EQ(seen[k].dropped, 0u);
    }
  }
}

TEST_F(WatchTest, WatchersComeAndGoAndDawdleWhileTheProducerNeverWaits) {
  constexpr std::uint64_t kFrames = 20'000;
  std::atomic<bool> done = false;
  std::vector<std::thread> audience;
  for (unsigned seed = 0; seed < 6; ++seed) {
    audience.emplace_back([&, seed] {
      std::mt19937 random(seed);
      while (!done) {
        const bool every = random() % 2 == 0;
        const auto watcher = Join(every ? WatchMode::kEvery : WatchMode::kLatest, 1 + random() % 3);
        const std::size_t frames = random() % 20;
        for (std::size_t k = 1; k <= frames && !done; ++k) {
          watcher->WaitForFrames(k);
          watcher->Credit(1 + random() % 2);
          if (random() % 8 == 0) std::this_thread::yield();
        }
        ExpectSound(*watcher, every);
      }
    });
  }
  const auto stuck = Join(WatchMode::kLatest, 1000);
  stuck->StopReading();
  const auto last = Join(WatchMode::kLatest, kFrames);
  while (broadcaster_->watcher_count() < 2) std::this_thread::yield();
  for (std::uint64_t k = 1; k <= kFrames; ++k) {
    Publish(k);
    if (k % 16 == 0) std::this_thread::yield();
  }
  EndStream();
  EXPECT_TRUE(last->status().ok());
  done = true;
  stuck->Cancel();
  for (std::thread& watcher : audience) watcher.join();
  ExpectSound(*last, /*every=*/false);
  ASSERT_FALSE(last->seen().empty());
  EXPECT_EQ(last->seen().back().number, kFrames);  // The last frame is never missed.
  const SeenFrame first = last->seen().front();
  EXPECT_EQ(last->seen().size() + last->machine().counts().dropped,
            kFrames - (first.number - first.dropped) + 1);
#ifndef PARTIEMC_SANITIZED  // Sanitizers' allocators delay this.
  EXPECT_EQ(broadcaster_->producer_waits(), 0u);
#endif
}

}  // namespace
}  // namespace partiemc::server
