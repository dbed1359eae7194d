// A replica that floods the bus: watchers elsewhere get all results and the end, and no drain is
// delayed.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "relay/memory_replica.h"
#include "relay/soon.h"
#include "server/base/call_errors.h"
#include "server/relay/pieces.h"
#include "server/relay/relay_queue.h"
#include "server/stream/stream_token.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;

class RelayFlood : public testing::Test {
 protected:
  RelayFlood() {
    hub_.SetLoses([this](const std::string& subject, std::string_view) {
      const std::lock_guard lock(mutex_);
      if (subject.starts_with("partiemc.ask.")) asked_ = subject;
      return false;
    });
    has_->Open("dam", NewStreamToken());
    EXPECT_TRUE(Soon([this] { return shows_.relay().remote_streams() == 1; }));
  }
  ~RelayFlood() override {
    flooding_ = false;
    if (flood_.joinable()) flood_.join();
  }

  std::string AskedSubject() {
    const std::lock_guard lock(mutex_);
    return asked_;
  }
  // Publishes `make(k)` for k = 1, 2, ... until the test ends.
  void Flood(const std::string& subject,
             std::function<relay::v1::RelayMessage(std::uint64_t k)> make) {
    flood_ = std::thread([this, subject, make = std::move(make)] {
      const auto stranger = hub_.Connect();
      for (std::uint64_t k = 1; flooding_; ++k) {
        const relay::v1::RelayMessage message = make(k);
        SendInPieces(message.replica(), k, message.SerializeAsString(),
                     [&](std::string_view piece) { return stranger->Publish(subject, piece); });
        if (++sent_ % 64 == 0) std::this_thread::yield();
      }
    });
    // More than a relay answers at once.
    ASSERT_TRUE(Soon([this] { return sent_ > 20'000; }));
  }
  static relay::v1::RelayMessage FetchAll(const std::string& stream_id, std::uint64_t number) {
    relay::v1::RelayMessage message;
    message.set_replica("stranger" + std::to_string(number % 50));
    message.mutable_fetch()->set_stream_id(stream_id);
    message.mutable_fetch()->set_fetch(number);
    message.mutable_fetch()->set_sequence(1);
    return message;
  }
  // The watcher has every frame, and the end of its stream.
  void ExpectFinished(MemoryWatcher& watcher, std::uint64_t frames) {
    EXPECT_TRUE(Soon([&] { return !watcher.end_reason().empty(); }));
    EXPECT_EQ(watcher.end_reason(), "FINISHED");
    EXPECT_EQ(watcher.seen().size(), frames);
    EXPECT_EQ(watcher.end_dropped(), 0u);
  }

  MemoryHub hub_;
  std::mutex mutex_;
  std::string asked_;  // Guarded by the mutex.
  std::unique_ptr<MemoryReplica> has_ = std::make_unique<MemoryReplica>(hub_);
  MemoryReplica shows_{hub_};
  std::atomic<bool> flooding_ = true;
  std::atomic<std::uint64_t> sent_ = 0;
  std::thread flood_;
};

TEST_F(RelayFlood, FetchesDelayNeitherResultsNorTheEndNorADrain) {
  for (std::uint64_t k = 1; k <= 50; ++k) has_->Publish("dam", k, 60'000);
  const auto watcher = shows_.Watch("dam", WatchMode::kEvery, 1);
  ASSERT_NE(watcher, nullptr);
  const std::string id = shows_.Find("dam")->stream.summary().stream_id();
  Flood(AskedSubject(), [id](std::uint64_t k) { return FetchAll(id, k); });
  for (std::uint64_t k = 51; k <= 100; ++k) {
    has_->Publish("dam", k, 1000);
    std::this_thread::sleep_for(milliseconds(1));
  }
  // A new watcher is served, too.
  const auto late = shows_.Watch("dam", WatchMode::kEvery, 1);
  ASSERT_NE(late, nullptr);
  has_->Close("dam");
  has_->relay().Drain();
  has_.reset();
  ExpectFinished(*watcher, 100);
  ExpectFinished(*late, 100);
}

TEST_F(RelayFlood, AnnouncementsThatAskDelayNothing) {
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  Flood(kReplicasSubject, [](std::uint64_t k) {
    relay::v1::RelayMessage message;
    message.set_replica("stranger" + std::to_string(k % 2000));
    message.mutable_announcement()->set_asks(true);
    return message;
  });
  for (std::uint64_t k = 1; k <= 50; ++k) has_->Publish("dam", k, 1000);
  has_->Close("dam");
  has_->relay().Drain();
  has_.reset();
  ExpectFinished(*watcher, 50);
}

TEST(RelayQueue, EmptyMessagesTakeRoom) {
  MemoryHub hub;
  const auto here = hub.Connect(), stranger = hub.Connect();
  const auto queue =
      std::make_shared<RelayQueue>(std::array<std::size_t, RelayQueue::kLanes>{2048, 2048});
  const auto subscription = queue->Listen(*here, "news", RelayQueue::kNews);
  for (int k = 0; k < 10'000; ++k) stranger->Publish("news", "");
  const std::uint64_t lost = queue->lost_messages();
  EXPECT_GT(lost, 9'000u);
  RelayQueue::Work work;
  ASSERT_TRUE(queue->Take(milliseconds(0), work));
  stranger->Publish("news", "");
  EXPECT_EQ(queue->lost_messages(), lost) << "taken messages have left room";
}

}  // namespace
}  // namespace partiemc::server
