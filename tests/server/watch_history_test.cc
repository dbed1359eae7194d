// Watchers that go back in a stream, over an in-memory transport: first the history in order, then
// live frames, without gaps or doubles. Also under ThreadSanitizer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <random>
#include <thread>
#include <vector>

#include "partiemc/status.h"
#include "server/base/call_errors.h"
#include "server/memory_watcher.h"
#include "server/watch/result_broadcaster.h"
#include "server/watch/watch_registry.h"
#include "server/watch_fixture.h"

namespace partiemc::server {
namespace {

constexpr std::size_t kFourFrames = 4 * kFrameCost;
constexpr std::uint64_t kMany = 1000;  // Credit for all frames.

class WatchBack : public ::testing::TestWithParam<WatchMode> {
 protected:
  void SetUp() override { broadcaster_ = Begin(nullptr, 1); }

  std::shared_ptr<ResultBroadcaster> Begin(ResultBroadcaster* former, std::uint64_t next) {
    auto broadcaster = std::make_shared<ResultBroadcaster>(
        dispatcher_, ResultBroadcaster::Limits{.mailbox_bytes = 20 * kFrameCost, .kept_bytes = 0});
    broadcaster->BeginHistory(room_, former, next);
    return broadcaster;
  }
  // Publishes frame `number`; its sequence number is the same.
  void Publish(std::uint64_t number) { PublishTo(*broadcaster_, number); }
  static void PublishTo(ResultBroadcaster& broadcaster, std::uint64_t number) {
    if (broadcaster.Publish(std::make_shared<NumberedFrame>(number, kFrameBytes), number)) {
      broadcaster.Announce();
    }
  }
  void PublishAll(std::uint64_t first, std::uint64_t last) {
    for (std::uint64_t k = first; k <= last; ++k) Publish(k);
  }
  std::unique_ptr<MemoryWatcher> Join(std::uint64_t credit, std::optional<std::uint64_t> from) {
    auto watcher =
        std::make_unique<MemoryWatcher>(broadcaster_, GetParam(), credit, kFourFrames, from);
    watcher->WaitUntilOpened();
    return watcher;
  }
  static std::chrono::steady_clock::time_point Later(std::chrono::seconds time) {
    return std::chrono::steady_clock::now() + time;
  }
  void EndStream() { broadcaster_->End(WatchEnd::OfStream(absl::OkStatus())); }

  static std::vector<std::uint64_t> NumbersOf(const MemoryWatcher& watcher) {
    std::vector<std::uint64_t> numbers;
    for (const SeenFrame& seen : watcher.seen()) numbers.push_back(seen.number);
    return numbers;
  }
  static std::vector<std::uint64_t> From(std::uint64_t first, std::uint64_t last) {
    std::vector<std::uint64_t> numbers;
    for (std::uint64_t k = first; k <= last; ++k) numbers.push_back(k);
    return numbers;
  }

  HistoryRoom room_{10 * kFrameCost, 20 * kFrameCost};
  WatchDispatcher dispatcher_;
  std::shared_ptr<ResultBroadcaster> broadcaster_;
};

TEST_P(WatchBack, ALateOneGetsAllThatIsHeldThenWhatComesLive) {
  PublishAll(1, 15);
  for (const std::uint64_t from : {0, 1, 6}) {  // 1 is too old.
    const auto watcher = Join(kMany, from);
    EXPECT_TRUE(watcher->held().any);
    EXPECT_EQ(watcher->held().oldest, 6u);
    EXPECT_EQ(watcher->held().newest, 15u);
    watcher->WaitForFrames(10);
    EXPECT_EQ(NumbersOf(*watcher), From(6, 15));
  }
  const auto watcher = Join(kMany, 12);
  watcher->WaitForFrames(4);
  for (std::uint64_t k = 16; k <= 18; ++k) {  // One at a time, so that `latest` drops none.
    Publish(k);
    watcher->WaitForFrames(k - 11);
  }
  EXPECT_EQ(NumbersOf(*watcher), From(12, 18));
  for (const SeenFrame& seen : watcher->seen()) EXPECT_EQ(seen.dropped, 0u);
}

TEST_P(WatchBack, OneFromBeyondTheNewestGetsWhatComesLiveAlone) {
  const auto before = Join(kMany, 0);  // Before the first frame.
  EXPECT_FALSE(before->held().any);
  PublishAll(1, 3);
  before->WaitForFrames(1);
  for (const std::uint64_t from : {4, 99}) {
    const auto watcher = Join(kMany, from);
    EXPECT_EQ(watcher->held().newest, 3u + (from == 99 ? 1 : 0));
    Publish(from == 99 ? 5 : 4);
    watcher->WaitForFrames(1);
    EXPECT_EQ(watcher->seen().front(), (SeenFrame{from == 99 ? 5u : 4u, 0}));
  }
}

TEST_P(WatchBack, OneWithoutItBeginsWithTheNewest) {
  PublishAll(1, 5);
  const auto watcher = Join(kMany, std::nullopt);
  EXPECT_EQ(watcher->held().oldest, 1u);
  watcher->WaitForFrames(1);
  EXPECT_EQ(watcher->seen().front(), (SeenFrame{5, 0}));
}

TEST_P(WatchBack, OneThatPausesGoesOnWhereItWas) {
  PublishAll(1, 3);
  const auto watcher = Join(2, 1);
  watcher->WaitForFrames(2);
  PublishAll(4, 10);
  EXPECT_LE(watcher->machine().counts().most_held_bytes, kFrameCost);
  watcher->Credit(kMany);
  watcher->WaitForFrames(10);
  EXPECT_EQ(NumbersOf(*watcher), From(1, 10));
}

TEST_P(WatchBack, WhatIsNoLongerHeldIsToldOrEndsTheWatch) {
  PublishAll(1, 10);
  const auto watcher = Join(3, 1);
  watcher->WaitForFrames(3);
  PublishAll(11, 17);
  dispatcher_.Flush();  // Frames 8 to 17 are held.
  watcher->Credit(kMany);
  if (GetParam() == WatchMode::kEvery) {
    const absl::Status status = watcher->status();
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(FindViolation(status)->reason, kReasonFellBehind);
    EXPECT_EQ(watcher->end_reason(), kReasonFellBehind);
    EXPECT_EQ(NumbersOf(*watcher), From(1, 3));
  } else {
    watcher->WaitForFrames(13);
    EXPECT_EQ(watcher->seen()[3], (SeenFrame{8, 4}));
    EXPECT_EQ(watcher->seen().back(), (SeenFrame{17, 0}));
    EXPECT_EQ(watcher->machine().counts().dropped, 4u);
  }
}

TEST_P(WatchBack, AFrameThatTheHistoryHasNoRoomForComesInItsTurn) {
  PublishAll(1, 3);
  const auto watcher = Join(kMany, 1);
  watcher->WaitForFrames(3);
  const auto large = [this](std::uint64_t number) {
    const std::size_t bytes = 3 * kFrameBytes;
    EXPECT_TRUE(broadcaster_->Publish(std::make_shared<NumberedFrame>(number, bytes), number));
    broadcaster_->Announce();
  };
  ResultHistory others[] = {ResultHistory(room_), ResultHistory(room_), ResultHistory(room_),
                            ResultHistory(room_), ResultHistory(room_), ResultHistory(room_),
                            ResultHistory(room_), ResultHistory(room_), ResultHistory(room_)};
  EXPECT_EQ(room_.share(), 2 * kFrameCost);
  for (std::uint64_t k = 4; k <= 9; ++k) {
    k % 3 == 0 ? large(k) : Publish(k);
    watcher->WaitForFrames(k);
  }
  EXPECT_EQ(NumbersOf(*watcher), From(1, 9));
  EXPECT_LE(room_.held(), 2 * kFrameCost);
}

TEST_P(WatchBack, WhatIsHeldStillComesAfterTheEndOfTheStream) {
  PublishAll(1, 8);
  const auto watcher = Join(2, 1);
  watcher->WaitForFrames(2);
  EndStream();
  watcher->Credit(3);
  watcher->WaitForFrames(5);
  EXPECT_EQ(watcher->end_reason(), "");
  watcher->Credit(3);
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(NumbersOf(*watcher), From(1, 8));
  EXPECT_EQ(watcher->end_reason(), kReasonFinished);
  EXPECT_EQ(watcher->end_dropped(), 0u);
}

TEST_P(WatchBack, AnEndedStreamWaitsForCreditForALimitedTime) {
  using std::chrono::seconds;
  constexpr PauseLimits kLimits{.pause = seconds(30), .write = seconds(120)};
  constexpr auto kNever = std::chrono::steady_clock::time_point::max();
  WatchRegistry registry(1);
  PublishAll(1, 8);
  const auto watcher = Join(2, 1);
  watcher->WaitForFrames(2);
  ASSERT_TRUE(registry.Enter(watcher->machine().shared_from_this()).ok());
  EXPECT_EQ(registry.EndPaused(kLimits, Later(seconds(999))), kNever) << "the stream is open";
  EndStream();
  dispatcher_.Flush();
  watcher->Credit(1);
  watcher->WaitForFrames(3);
  while (watcher->writes()) std::this_thread::yield();
  EXPECT_EQ(registry.EndPaused({}, Later(seconds(999))), kNever);
  const auto next = registry.EndPaused(kLimits, Later(seconds(20)));
  EXPECT_GT(next, Later(seconds(20)));
  EXPECT_LE(next, Later(seconds(30)));
  EXPECT_GT(room_.held(), 0u);
  registry.EndPaused(kLimits, Later(seconds(31)));
  const absl::Status status = watcher->status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(FindViolation(status)->value, "gives no credit for 30 s");
  EXPECT_EQ(watcher->end_reason(), kReasonIdle);
  EXPECT_EQ(watcher->end_dropped(), 5u);
  registry.Leave(watcher->machine());
}

TEST_P(WatchBack, AnEndedStreamWaitsForAWriteForALimitedTime) {
  using std::chrono::seconds;
  constexpr PauseLimits kLimits{.pause = seconds(30), .write = seconds(120)};
  PublishAll(1, 8);
  const auto watcher = Join(1, 1);
  watcher->WaitForFrames(1);
  watcher->StopReading();
  watcher->Credit(kMany);
  watcher->WaitForFrames(2);
  EndStream();
  dispatcher_.Flush();
  watcher->machine().EndIfPaused(kLimits, Later(seconds(110)));
  EXPECT_TRUE(watcher->writes());
  watcher->machine().EndIfPaused(kLimits, Later(seconds(121)));
  EXPECT_EQ(FindViolation(watcher->status())->value, "takes no result for 120 s");
}

TEST_P(WatchBack, AnEndedStreamDropsItsHistoryAfterItsLastReader) {
  PublishAll(1, 8);
  auto reader = Join(1, 1);
  const auto other = Join(1, std::nullopt);
  reader->WaitForFrames(1);
  other->WaitForFrames(1);
  Publish(9);  // `other` has no credit for it.
  EndStream();
  dispatcher_.Flush();
  EXPECT_EQ(room_.held(), 9 * kFrameCost);
  reader.reset();
  dispatcher_.Flush();
  EXPECT_EQ(room_.held(), 0u);
}

TEST_P(WatchBack, AnEndedStreamKeepsAHeldHistory) {
  broadcaster_->HoldHistory();
  PublishAll(1, 3);
  const auto paused = Join(1, std::nullopt);
  paused->WaitForFrames(1);
  Publish(4);  // `paused` has no credit for it, and does not go back.
  auto leaver = Join(kMany, std::nullopt);
  EndStream();
  EXPECT_TRUE(leaver->status().ok());
  leaver.reset();
  dispatcher_.Flush();
  EXPECT_EQ(broadcaster_->Held(1).number, 1u);
  broadcaster_->ReleaseHistory();
  dispatcher_.Flush();
  EXPECT_EQ(broadcaster_->Held(1).frame, nullptr);
}

TEST_P(WatchBack, AnEndedStreamSharesTheRoomWithOpenOnes) {
  PublishAll(1, 10);
  const auto paused = Join(1, 1);
  paused->WaitForFrames(1);
  const auto ended = std::exchange(broadcaster_, Begin(nullptr, 1));
  ended->End(WatchEnd::OfStream(absl::OkStatus()));
  PublishAll(1, 10);
  EXPECT_EQ(room_.held(), 20 * kFrameCost);
  const auto third = Begin(nullptr, 1);
  dispatcher_.Flush();
  EXPECT_LE(room_.held(), 12 * kFrameCost) << "each of three may have six";
  for (std::uint64_t k = 1; k <= 6; ++k) PublishTo(*third, k);
  EXPECT_EQ(third->oldest_here(), 1u);
}

TEST_P(WatchBack, AnEndedStreamHoldsNothingForThoseWhoDoNotGoBack) {
  PublishAll(1, 8);
  const auto watcher = Join(1, std::nullopt);
  watcher->WaitForFrames(1);
  Publish(9);  // Without credit for it.
  EndStream();
  dispatcher_.Flush();
  EXPECT_EQ(room_.held(), 0u);
  watcher->Credit(1);
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->seen().back(), (SeenFrame{9, 0}));
}

TEST_P(WatchBack, AStreamThatIsTakenOverKeepsItsHistoryUpToWhereItGoesOn) {
  PublishAll(1, 10);
  for (const bool watched :
       {false, true}) {  // The second time the former history still has a reader.
    std::unique_ptr<MemoryWatcher> reading;
    if (watched) {
      reading = Join(1, 1);
      reading->WaitForFrames(1);
    }
    const auto former = std::exchange(broadcaster_, Begin(broadcaster_.get(), watched ? 6 : 8));
    former->End(WatchEnd::OfStream(absl::OkStatus()));
    PublishAll(watched ? 6 : 8, 9);  // Computed again.
    const auto watcher = Join(kMany, 0);
    watcher->WaitForFrames(9);
    EXPECT_EQ(NumbersOf(*watcher), From(1, 9));
    if (!watched) continue;
    reading->Credit(kMany);
    EXPECT_TRUE(reading->status().ok());
    EXPECT_EQ(NumbersOf(*reading), From(1, 9));
  }
}

TEST_P(WatchBack, ATakeoverMovesTheHistoryAndReturnsTheRest) {
  PublishAll(1, 10);
  const auto next = std::make_shared<ResultBroadcaster>(dispatcher_, ResultBroadcaster::Limits{});
  const auto rest = next->BeginHistory(room_, broadcaster_.get(), 8);
  ASSERT_EQ(rest.size(), 3u);
  EXPECT_EQ(rest.front().sequence, 8u);
  EXPECT_EQ(room_.held(), 7 * kFrameCost);
  EXPECT_EQ(broadcaster_->HeldFrom(1).frame, nullptr);
  EXPECT_EQ(next->oldest_here(), 1u);
  EXPECT_EQ(next->Newest().sequence, 7u);
  EXPECT_EQ(next->LastNumber(), 7u);
}

TEST_P(WatchBack, OthersGetAllWhileOneReadsSlowly) {
  PublishAll(1, 10);
  const auto slow = Join(1, 0);
  slow->WaitForFrames(1);
  slow->StopReading();
  slow->Credit(kMany);
  const auto other = Join(kMany, 0);
  other->WaitForFrames(10);
  for (std::uint64_t k = 11; k <= 200; ++k) {
    Publish(k);
    other->WaitForFrames(k);
  }
  EXPECT_EQ(NumbersOf(*other), From(1, 200));
  EXPECT_LE(slow->machine().counts().most_held_bytes, kFrameCost);
  EXPECT_LE(room_.held(), 10 * kFrameCost);
}

TEST_P(WatchBack, RandomWatchersMissNoFrameThatIsNotReported) {
  constexpr std::uint64_t kFrames = 20'000;
  std::atomic<std::uint64_t> published = 0, went_back = 0;
  std::atomic<bool> over = false;
  std::vector<std::thread> audience;
  for (unsigned seed = 0; seed < 4; ++seed) {
    audience.emplace_back([&, seed] {
      std::mt19937 random(seed);
      while (!over) {
        const std::uint64_t now = published, back = random() % 12;
        const std::uint64_t from = now > back ? now - back : 0;
        MemoryWatcher watcher(broadcaster_, GetParam(), 1 + random() % 5, kFourFrames, from);
        watcher.WaitUntilOpened();
        const std::size_t frames = random() % 30;
        for (std::size_t k = 1; k <= frames && !over; ++k) {
          watcher.WaitForFrames(k);
          watcher.Credit(1);
          if (random() % 8 == 0) std::this_thread::yield();
        }
        EXPECT_EQ(watcher.unpaid(), 0u);
        const auto seen = watcher.seen();
        const HeldFrames held = watcher.held();
        if (!seen.empty() && held.any && held.newest >= from) {
          EXPECT_GE(seen.front().number, from);
          EXPECT_LE(seen.front().number - seen.front().dropped, std::max(from, held.oldest));
          ++went_back;
        }
        for (std::size_t k = 1; k < seen.size(); ++k) {
          ASSERT_EQ(seen[k].number, seen[k - 1].number + seen[k].dropped + 1);
          ASSERT_TRUE(seen[k].dropped == 0 || GetParam() == WatchMode::kLatest);
        }
      }
    });
  }
  for (std::uint64_t k = 1; k <= kFrames || went_back < 50; ++k) {
    Publish(k);
    published = k;
    if (k % 16 == 0) std::this_thread::yield();
  }
  over = true;
  EndStream();  // For watchers that wait for a frame.
  for (std::thread& watcher : audience) watcher.join();
  EXPECT_LE(room_.held(), 10 * kFrameCost);
#ifndef PARTIEMC_SANITIZED  // Sanitizers' allocators delay this.
  EXPECT_EQ(broadcaster_->producer_waits(), 0u);
#endif
}

INSTANTIATE_TEST_SUITE_P(Modes, WatchBack, ::testing::Values(WatchMode::kLatest, WatchMode::kEvery),
                         [](const auto& mode) {
                           return mode.param == WatchMode::kEvery ? "Every" : "Latest";
                         });

using WatchBehind = WatchBack;

TEST_P(WatchBehind, OneOfEveryThatMayHoldNoMoreWaitsInTheHistory) {
  const auto watcher = Join(1, std::nullopt);
  PublishAll(1, 10);  // It may hold four of them.
  watcher->WaitForFrames(1);
  dispatcher_.Flush();
  watcher->Credit(kMany);
  watcher->WaitForFrames(10);
  EXPECT_EQ(NumbersOf(*watcher), From(1, 10));
  for (std::uint64_t k = 11; k <= 13; ++k) {
    Publish(k);
    watcher->WaitForFrames(k);
  }
  EXPECT_EQ(NumbersOf(*watcher), From(1, 13));
  EXPECT_LE(watcher->machine().counts().most_held_bytes, kFourFrames);
}

INSTANTIATE_TEST_SUITE_P(Mode, WatchBehind, ::testing::Values(WatchMode::kEvery),
                         [](const auto&) { return "Every"; });

}  // namespace
}  // namespace partiemc::server
