// Timeouts and intervals of the relay, on a clock of the test.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/status.h"
#include "relay/memory_replica.h"
#include "server/base/call_errors.h"
#include "server/stream/stream_token.h"
#include "support/manual_clock.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

class RelayTimes : public testing::Test {
 protected:
  RelayTimes() {
    has_.Open("dam", NewStreamToken());
    EXPECT_TRUE(Within(seconds(1), [this] { return shows_.relay().remote_streams() == 1; }));
  }

  // Each relay does what is due after every step.
  void Pass(milliseconds time) { clock_.Advance(time, kStep, relays_); }
  bool Within(milliseconds time, const std::function<bool()>& is_true) {
    for (; time.count() > 0 && !is_true(); time -= kStep) Pass(kStep);
    return is_true();
  }
  void Publish(std::uint64_t first, std::uint64_t last) {
    for (std::uint64_t k = first; k <= last; ++k) has_.Publish("dam", k);
  }
  absl::Status FindNothing() {
    const auto found = std::make_shared<std::atomic<bool>>(false);
    const auto status = std::make_shared<absl::Status>();
    shows_.relay().Find("nothing", std::nullopt, [found, status](const auto& one) {
      *status = one.status();
      *found = true;
    });
    EXPECT_TRUE(Within(seconds(2), [&] { return found->load(); }));
    return *found ? *status : absl::UnknownError("no answer");
  }

  static constexpr milliseconds kStep{50};

  support::ManualClock clock_;
  MemoryHub hub_;
  std::size_t relays_ = 2;
  MemoryReplica has_{hub_, 8 << 20, {}, {.clock = &clock_}};
  MemoryReplica shows_{hub_, 8 << 20, {}, {.clock = &clock_}};
};

TEST_F(RelayTimes, RefusesAnUnknownNameAndSaysWhatToDo) {
  absl::Status status = FindNothing();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(status.message(),
            "open.stream_name: \"nothing\"; must be the name of an open stream; ListStreams "
            "(`partiemc streams`) lists them");
  shows_.bus().SetConnected(false);
  ASSERT_TRUE(Within(seconds(1), [this] { return !shows_.relay().connected(); }));
  status = FindNothing();
  const auto violation = FindViolation(status);
  ASSERT_TRUE(violation) << status;
  EXPECT_EQ(violation->reason, kReasonNoSuchStream);
  EXPECT_THAT(std::string(status.message()), HasSubstr("NATS cannot be reached"));
}

TEST_F(RelayTimes, AReplicaIsGoneAfterThreeSecondsOfSilence) {
  Publish(1, 1);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  Pass(seconds(10));
  EXPECT_EQ(shows_.relay().replicas(), 1u);
  has_.bus().SetConnected(false);
  Pass(milliseconds(1900));
  EXPECT_EQ(shows_.relay().replicas(), 1u);
  Pass(milliseconds(1300));
  EXPECT_EQ(shows_.relay().replicas(), 0u);
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->end_reason(), kReasonProducerLost);
  has_.bus().SetConnected(true);
  EXPECT_TRUE(Within(seconds(4), [this] { return has_.relay().exported_streams() == 0; }));
}

TEST_F(RelayTimes, WithoutRoomForTheWholeHistoryAStreamIsImportedTwiceAtMost) {
  MemoryReplica small(hub_, 20'000, {}, {.clock = &clock_});  // Room for 13 frames.
  relays_ = 3;
  ASSERT_TRUE(Within(seconds(2), [&] { return small.relay().remote_streams() == 1; }));
  Publish(1, 100);
  std::set<const ResultBroadcaster*> imports;
  std::vector<std::unique_ptr<MemoryWatcher>> watchers;
  for (const std::uint64_t from : {99, 50, 40}) {
    watchers.push_back(small.Watch("dam", WatchMode::kEvery, from));
    ASSERT_NE(watchers.back(), nullptr);
    watchers.back()->WaitForFrames(from == 99 ? 2 : 13);
    EXPECT_EQ(watchers.back()->seen().back(), (SeenFrame{100, 0}));
    const auto found = small.Find("dam", from);
    ASSERT_TRUE(found.ok()) << found.status();
    imports.insert(found->broadcaster.get());
    Pass(milliseconds(5100));  // Longer than an import counts as new.
  }
  EXPECT_EQ(imports.size(), 2u);
  EXPECT_EQ(small.relay().imported_streams(), 2u);
  watchers.clear();
  EXPECT_TRUE(Within(seconds(10), [&] { return small.relay().imported_streams() == 0; }));
  EXPECT_TRUE(Within(seconds(4), [this] { return has_.relay().exported_streams() == 0; }));
}

TEST_F(RelayTimes, ADrainedReplicaAnnouncesNothing) {
  MemoryReplica leaves(hub_, 0, {}, {.clock = &clock_});
  relays_ = 3;
  ASSERT_TRUE(Within(seconds(2), [&] { return shows_.relay().replicas() == 2; }));
  leaves.relay().Drain();
  leaves.Open("late", NewStreamToken());
  Pass(milliseconds(1200));  // Longer than the interval of announcements.
  EXPECT_EQ(shows_.relay().replicas(), 1u);
  EXPECT_EQ(shows_.relay().remote_streams(), 1u);
}

TEST_F(RelayTimes, ADrainOverASlowBusSendsAllResults) {
  Publish(1, 1);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  std::atomic<bool> drains = false;
  hub_.SetLoses([&](const std::string& subject, std::string_view) {
    if (!subject.starts_with("partiemc.results.")) return false;
    while (!drains) std::this_thread::yield();
    // A tenth of the time for which a drain waits for the next result.
    clock_.Advance(milliseconds(30));
    return false;
  });
  Publish(2, 21);
  has_.Close("dam");
  drains = true;
  has_.relay().Drain();
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->end_reason(), kReasonFinished);
  EXPECT_EQ(watcher->seen().size(), 21u);
}

TEST_F(RelayTimes, PublishesNothingWithoutWatchersElsewhere) {
  std::atomic<int> results = 0;
  hub_.SetLoses([&](const std::string& subject, std::string_view) {
    if (subject.starts_with("partiemc.results.")) ++results;
    return false;
  });
  Publish(1, 20);
  auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  EXPECT_TRUE(Within(seconds(1), [this] { return has_.relay().exported_streams() == 1; }));
  watcher.reset();
  Pass(seconds(4));
  EXPECT_EQ(shows_.relay().imported_streams(), 1u) << "watchers may reconnect";
  EXPECT_EQ(has_.relay().exported_streams(), 1u);
  EXPECT_TRUE(Within(seconds(2), [this] { return shows_.relay().imported_streams() == 0; }));
  EXPECT_TRUE(Within(seconds(4), [this] { return has_.relay().exported_streams() == 0; }));
  const int before = results;
  Publish(21, 40);
  Pass(seconds(1));
  EXPECT_EQ(results, before);
}

}  // namespace
}  // namespace partiemc::server
