// Levels of detail for watchers, without messages: a level is computed once for all that share it.
// Also under ThreadSanitizer.
#include "server/watch/level_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/memory_watcher.h"

namespace partiemc::server {
namespace {

using ::testing::ElementsAre;

constexpr std::size_t kLevelBytes = 1000;

LevelOfDetail Error(double error) { return {.max_error = error, .max_triangles = {}}; }

std::uint64_t NumberOf(const LevelQueue::Frame& frame) {
  return static_cast<const NumberedFrame&>(*frame).number;
}

class TestWaiter final : public LevelQueue::Waiter {
 public:
  void LevelDone(const absl::StatusOr<LevelQueue::Frame>& level) override {
    const std::lock_guard lock(mutex_);
    done_ = level;
    changed_.notify_all();
  }
  // Waits for the level; returns its number. 0: skipped; -1: an error.
  int Wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return done_.has_value(); });
    const absl::StatusOr<LevelQueue::Frame> level = *std::exchange(done_, std::nullopt);
    if (!level.ok()) return -1;
    return *level == nullptr ? 0 : static_cast<int>(NumberOf(*level));
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<absl::StatusOr<LevelQueue::Frame>> done_;
};

class LevelQueueTest : public ::testing::Test {
 protected:
  ~LevelQueueTest() override {
    Release();
    queue_->Stop();
  }

  static LevelQueue::Frame FrameOf(std::uint64_t number) {
    return std::make_shared<NumberedFrame>(number, kLevelBytes);
  }
  LevelQueue::Seat Join(double error, const void* stream = nullptr) {
    auto seat = queue_->Join(stream, Error(error));
    EXPECT_TRUE(seat.ok()) << seat.status();
    return *std::move(seat);
  }

  // Computations wait from now on, until Release.
  void Hold() { Set(true); }
  void Release() { Set(false); }
  void WaitUntilBegun(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return begun_.size() >= count; });
  }
  std::vector<std::uint64_t> begun() {
    const std::lock_guard lock(mutex_);
    return begun_;
  }

  WatchDispatcher dispatcher_;
  bool lacks_memory_ = false;
  const std::shared_ptr<LevelQueue> queue_ = std::make_shared<LevelQueue>(
      dispatcher_,
      [this](const LevelQueue::Frame& exact, const LevelOfDetail&,
             const std::atomic<bool>& cancelled) { return Compute(exact, cancelled); },
      LevelQueue::Limits{.levels_per_stream = 3,
                         .kept_bytes = 2 * (kLevelBytes + kPublishedBytes)});

 private:
  void Set(bool held) {
    const std::lock_guard lock(mutex_);
    held_ = held;
    changed_.notify_all();
  }
  LevelQueue::Made Compute(const LevelQueue::Frame& exact, const std::atomic<bool>& cancelled) {
    std::unique_lock lock(mutex_);
    begun_.push_back(NumberOf(exact));
    changed_.notify_all();
    while (held_ && !cancelled) changed_.wait_for(lock, std::chrono::milliseconds(1));
    if (cancelled) return {.level = absl::CancelledError("cancelled")};
    if (lacks_memory_) {
      return {.level = absl::ResourceExhaustedError("memory"), .may_succeed_later = true};
    }
    return {.level = FrameOf(NumberOf(exact))};
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool held_ = false;
  std::vector<std::uint64_t> begun_;
};

TEST_F(LevelQueueTest, ComputesALevelOnceForAllThatShareIt) {
  const LevelQueue::Frame frame = FrameOf(1);
  const auto a = Join(.1), b = Join(.1), other = Join(.2);
  TestWaiter first, second, late, of_other;
  Hold();
  queue_->Request(a, frame, true, first);
  WaitUntilBegun(1);
  queue_->Request(b, frame, true, second);
  Release();
  EXPECT_EQ(first.Wait(), 1);
  EXPECT_EQ(second.Wait(), 1);
  queue_->Request(a, frame, true, late);
  EXPECT_EQ(late.Wait(), 1);
  EXPECT_EQ(queue_->computed(), 1u);
  EXPECT_EQ(queue_->shared(), 2u);
  queue_->Request(other, frame, true, of_other);
  EXPECT_EQ(of_other.Wait(), 1);
  EXPECT_EQ(queue_->computed(), 2u);
}

TEST_F(LevelQueueTest, RefusesMoreLevelsOfAStreamThanTheLimit) {
  int tank = 0, other_tank = 0;
  std::vector<LevelQueue::Seat> seats;
  for (int k = 1; k <= 3; ++k) seats.push_back(Join(.1 * k, &tank));
  const auto refused = queue_->Join(&tank, Error(.5));
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(FindViolation(refused.status())->reason, kReasonTooManyLevels);
  seats.push_back(Join(.1, &tank));  // Shares a level.
  const auto elsewhere = Join(.5, &other_tank);
  EXPECT_EQ(queue_->level_count(), 4u);
  seats[0] = {};
  EXPECT_FALSE(queue_->Join(&tank, Error(.5)).ok()) << "another watcher still has the level";
  seats[3] = {};
  seats.push_back(Join(.5, &tank));
  seats.clear();
  EXPECT_EQ(queue_->level_count(), 1u);
}

TEST_F(LevelQueueTest, WatchersThatMaySkipMeetAtTheNewestFrame) {
  const LevelQueue::Frame frames[] = {FrameOf(1), FrameOf(2), FrameOf(3), FrameOf(4)};
  const auto seat = Join(.1);
  TestWaiter slow, skipping, every, newest;
  Hold();
  queue_->Request(seat, frames[0], true, slow);
  WaitUntilBegun(1);
  queue_->Request(seat, frames[1], true, skipping);
  queue_->Request(seat, frames[2], false, every);
  queue_->Request(seat, frames[3], true, newest);
  EXPECT_EQ(skipping.Wait(), 0);
  EXPECT_EQ(queue_->waiting(), 3u);
  Release();
  EXPECT_EQ(slow.Wait(), 1);
  EXPECT_EQ(every.Wait(), 3);
  EXPECT_EQ(newest.Wait(), 4);
  EXPECT_THAT(begun(), ElementsAre(1, 3, 4));
}

TEST_F(LevelQueueTest, PairsOfStreamAndLevelTakeTurns) {
  const auto often = Join(.1), rare = Join(.2);
  TestWaiter waiters[5];
  Hold();
  const LevelQueue::Frame frames[] = {FrameOf(1), FrameOf(2), FrameOf(3), FrameOf(4), FrameOf(5)};
  for (int k = 0; k < 4; ++k) queue_->Request(often, frames[k], false, waiters[k]);
  WaitUntilBegun(1);
  queue_->Request(rare, frames[4], false, waiters[4]);
  Release();
  for (TestWaiter& waiter : waiters) EXPECT_GT(waiter.Wait(), 0);
  EXPECT_THAT(begun(), ElementsAre(1, 2, 5, 3, 4));
}

TEST_F(LevelQueueTest, AFrameThatNobodyWaitsForIsCancelled) {
  const LevelQueue::Frame frames[] = {FrameOf(1), FrameOf(2)};
  const auto seat = Join(.1);
  TestWaiter left, queued, other;
  Hold();
  queue_->Request(seat, frames[0], true, left);
  WaitUntilBegun(1);
  queue_->Request(seat, frames[1], false, queued);
  EXPECT_TRUE(queue_->Withdraw(queued));
  EXPECT_FALSE(queue_->Withdraw(queued));
  EXPECT_TRUE(queue_->Withdraw(left));  // Ends the computation, which is held.
  queue_->Request(seat, frames[0], true, other);
  WaitUntilBegun(2);
  Release();
  EXPECT_EQ(other.Wait(), 1);
  EXPECT_EQ(queue_->computed(), 1u);
}

TEST_F(LevelQueueTest, KeepsLevelsWithinItsBytesAndWhileTheirFramesExist) {
  std::vector<LevelQueue::Frame> frames = {FrameOf(1), FrameOf(2), FrameOf(3)};
  auto seat = Join(.1);
  TestWaiter waiter;
  const auto computes = [&](const LevelQueue::Frame& frame) {
    const std::uint64_t before = queue_->computed();
    queue_->Request(seat, frame, true, waiter);
    waiter.Wait();
    return queue_->computed() != before;
  };
  const std::uint64_t one = kLevelBytes + kPublishedBytes;
  for (const LevelQueue::Frame& frame : frames) EXPECT_TRUE(computes(frame));
  EXPECT_EQ(queue_->kept_bytes(), 2 * one);
  EXPECT_FALSE(computes(frames[2]));
  EXPECT_TRUE(computes(frames[0])) << "the oldest was dropped";
  frames.erase(frames.begin() + 1, frames.end());
  const LevelQueue::Frame newer = FrameOf(9);
  EXPECT_TRUE(computes(newer));
  EXPECT_FALSE(computes(newer));
  seat = {};
  EXPECT_EQ(queue_->kept_bytes(), 0u);
}

TEST_F(LevelQueueTest, WithoutMemoryWatchersThatMaySkipSkip) {
  const LevelQueue::Frame frame = FrameOf(1);
  const auto seat = Join(.1);
  TestWaiter latest, every;
  Hold();
  queue_->Request(seat, frame, true, latest);
  queue_->Request(seat, frame, false, every);
  lacks_memory_ = true;
  Release();
  EXPECT_EQ(latest.Wait(), 0);
  EXPECT_EQ(every.Wait(), -1);
  EXPECT_EQ(queue_->kept_bytes(), 0u);
}

// For ThreadSanitizer: watchers request and leave at any time.
TEST_F(LevelQueueTest, RequestsOfManyThreadsAreNoRace) {
  std::vector<std::thread> threads;
  const std::vector<LevelQueue::Frame> frames = {FrameOf(1), FrameOf(2), FrameOf(3)};
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int round = 0; round < 300; ++round) {
        const auto seat = Join(.1 * (1 + (t + round) % 2));
        TestWaiter waiter;
        queue_->Request(seat, frames[static_cast<std::size_t>(round) % 3], t % 2 == 0, waiter);
        if (round % 3 == 0 && queue_->Withdraw(waiter)) continue;
        EXPECT_GE(waiter.Wait(), 0);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(queue_->level_count(), 0u);
  EXPECT_EQ(queue_->kept_bytes(), 0u);
}

}  // namespace
}  // namespace partiemc::server
