// Results that are dropped because the dispatcher is busy and they exceed the limit of bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "server/memory_watcher.h"
#include "server/watch/result_broadcaster.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch_fixture.h"

namespace partiemc::server {
namespace {

using ::testing::ElementsAre;

TEST(ResultMailbox, HoldsNoMoreBytesThanItMayAndDropsTheOlderOnes) {
  ResultMailbox mailbox(3 * (kFrameBytes + kPublishedBytes));
  const auto put = [&](std::uint64_t number) {
    mailbox.Put({std::make_shared<NumberedFrame>(number, kFrameBytes), number});
  };
  const auto taken = [&] {
    std::vector<std::uint64_t> numbers;
    mailbox.Take([&](const Published& published) { numbers.push_back(published.number); });
    return numbers;
  };
  for (const std::uint64_t number : {1, 2, 3}) put(number);
  EXPECT_THAT(taken(), ElementsAre(1, 2, 3));
  for (const std::uint64_t number : {4, 5, 6, 7}) put(number);
  EXPECT_THAT(taken(), ElementsAre(7));
}

// Occupies the dispatcher's thread until it is released.
class Occupied final : public Dispatched {
 public:
  std::promise<void> begun, released;

 private:
  void Serve() override {
    begun.set_value();
    released.get_future().wait();
  }
};

class DroppedResults : public ::testing::Test {
 protected:
  std::unique_ptr<MemoryWatcher> Join(WatchMode mode) {
    return std::make_unique<MemoryWatcher>(broadcaster_, mode, 1000, kMaxBytes);
  }
  std::shared_ptr<Occupied> Occupy() {
    auto occupied = std::make_shared<Occupied>();
    dispatcher_.Wake(*occupied);
    occupied->begun.get_future().wait();
    return occupied;
  }
  void EndStream() { broadcaster_->End(WatchEnd::OfStream(absl::OkStatus())); }

  WatchDispatcher dispatcher_;
  std::shared_ptr<ResultBroadcaster> broadcaster_ = std::make_shared<ResultBroadcaster>(
      dispatcher_,
      ResultBroadcaster::Limits{.mailbox_bytes = kMaxBytes, .kept_bytes = 2 * kFrameBytes});
};

TEST_F(DroppedResults, ResultsForABusyDispatcherAreBounded) {
  const auto watcher = Join(WatchMode::kLatest);
  while (broadcaster_->watcher_count() == 0) std::this_thread::yield();
  const auto occupied = Occupy();
  std::vector<std::weak_ptr<const WatchFrame>> frames;
  for (std::uint64_t k = 1; k <= 100; ++k) {
    const auto frame = std::make_shared<NumberedFrame>(k, kFrameBytes);
    frames.push_back(frame);
    if (broadcaster_->Publish(frame, k)) broadcaster_->Announce();
    EXPECT_EQ(broadcaster_->LastNumber(), k);  // Takes the frame out of the mailbox.
  }
  const auto held =
      std::ranges::count_if(frames, [](const auto& frame) { return !frame.expired(); });
  EXPECT_LE(held * (kFrameBytes + kPublishedBytes), kMaxBytes);
  occupied->released.set_value();
  EndStream();
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->seen().back().number, 100u);
}

TEST_F(DroppedResults, ALossIsReportedEvenIfTheResultAfterItIsDropped) {
  std::uint64_t number = 1;
  const auto publish = [&](std::uint64_t count, std::uint64_t last_loss, bool is_collected) {
    for (const std::uint64_t end = number + count; number < end; ++number) {
      broadcaster_->PublishNumbered(
          {std::make_shared<NumberedFrame>(number, kFrameBytes), number, number, last_loss});
      // Takes the result out of the mailbox, so that it is dropped later.
      if (is_collected) {
        EXPECT_EQ(broadcaster_->LastNumber(), number);
      }
    }
  };
  publish(1, 0, false);
  for (const bool is_collected : {false, true}) {
    SCOPED_TRACE(is_collected);
    const auto before = Join(WatchMode::kEvery);
    before->WaitForFrames(1);
    const auto occupied = Occupy();
    const std::uint64_t loss = number += 3;
    publish(20, loss, is_collected);
    // A watcher that joins after the loss misses results only because they are dropped.
    const auto after = Join(WatchMode::kEvery);
    after->WaitForFrames(1);
    publish(20, loss, is_collected);
    occupied->released.set_value();
    EXPECT_TRUE(before->status().ok());
    EXPECT_EQ(before->end_reason(), kReasonProducerLost);
    EXPECT_EQ(after->status().code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(after->end_reason(), kReasonFellBehind);
  }
}

// Calls a function when it is freed.
class FreedFrame final : public WatchFrame {
 public:
  FreedFrame(std::size_t bytes, std::function<void()> on_freed)
      : WatchFrame(bytes), on_freed_(std::move(on_freed)) {}
  ~FreedFrame() override { on_freed_(); }

 private:
  const std::function<void()> on_freed_;
};

TEST_F(DroppedResults, AreFreedWithoutTheLock) {
  const auto watcher = Join(WatchMode::kLatest);
  while (broadcaster_->watcher_count() == 0) std::this_thread::yield();
  const auto occupied = Occupy();
  struct Probe {
    std::once_flag once;
    std::future<std::uint64_t> last;  // Needs the lock.
    std::optional<std::future_status> waited;
  };
  const auto probe = std::make_shared<Probe>();
  const auto on_freed = [this, probe] {
    std::call_once(probe->once, [&] {
      probe->last = std::async(std::launch::async, [this] { return broadcaster_->LastNumber(); });
      probe->waited = probe->last.wait_for(std::chrono::seconds(5));
    });
  };
  for (std::uint64_t k = 1; !probe->waited && k <= 100; ++k) {
    const auto publish = [&] {
      return broadcaster_->Publish(std::make_shared<FreedFrame>(kFrameBytes, on_freed), k);
    };
    EXPECT_TRUE(publish());
    EXPECT_EQ(broadcaster_->LastNumber(), k);  // Takes the frame out of the mailbox.
  }
  EXPECT_EQ(probe->waited, std::future_status::ready);
  occupied->released.set_value();
  EndStream();
  EXPECT_TRUE(watcher->status().ok());
}

}  // namespace
}  // namespace partiemc::server
