// Watchers at one replica of another replica's streams.
#include "server/relay/relay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "partiemc/status.h"
#include "relay/memory_replica.h"
#include "relay/soon.h"
#include "server/base/call_errors.h"
#include "server/relay/watched_result.h"
#include "server/stream/stream_token.h"
#include "support/random.h"
#include "wire/codec.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;

constexpr milliseconds kSoon(10'000);

bool InTime(const std::function<bool()>& is_true) { return Soon(is_true, kSoon); }

std::string ReasonOf(const absl::Status& status) {
  const auto violation = FindViolation(status);
  return violation ? violation->reason : status.ToString();
}

// Expects all frames from `first` to `last`, in order.
void ExpectAll(const std::vector<SeenFrame>& seen, std::uint64_t first, std::uint64_t last) {
  ASSERT_EQ(seen.size(), last - first + 1);
  for (std::size_t k = 0; k < seen.size(); ++k) {
    EXPECT_EQ(seen[k], (SeenFrame{first + k, 0}));
  }
}

// Expects that the numbers of consecutive frames differ by one plus the dropped frames.
void ExpectAccounted(const MemoryWatcher& watcher, std::uint64_t last) {
  const auto seen = watcher.seen();
  ASSERT_FALSE(seen.empty());
  for (std::size_t k = 1; k < seen.size(); ++k) {
    EXPECT_EQ(seen[k].number, seen[k - 1].number + seen[k].dropped + 1);
  }
  EXPECT_EQ(seen.back().number + watcher.end_dropped(), last);
}

class RelayTest : public testing::Test {
 protected:
  RelayTest() {
    has_.Open("dam", token_);
    Both([this] { return shows_.relay().remote_streams() == 1; });
  }

  static void Both(const std::function<bool()>& know_each_other) {
    ASSERT_TRUE(InTime(know_each_other));
  }
  void Publish(std::uint64_t first, std::uint64_t last, std::size_t bytes = 1000) {
    for (std::uint64_t k = first; k <= last; ++k) has_.Publish("dam", k, bytes);
  }

  const std::string token_ = NewStreamToken();
  MemoryHub hub_;
  MemoryReplica has_{hub_}, shows_{hub_};
};

TEST_F(RelayTest, TheNewestComesAtOnceAndThenEveryOther) {
  Publish(1, 5);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  watcher->WaitForFrames(1);
  EXPECT_TRUE(watcher->held().any);
  EXPECT_EQ(watcher->held().newest, 5u);
  EXPECT_EQ(watcher->held().oldest, 1u) << "frames that its replica holds can be asked for here";
  for (std::uint64_t k = 6; k <= 50; ++k) has_.Publish("dam", k);
  watcher->WaitForFrames(46);
  ExpectAll(watcher->seen(), 5, 50);
}

TEST_F(RelayTest, BytesLabelsParametersAndLineageAreThoseOfTheReplicaThatHasIt) {
  constexpr std::size_t kLarge = 900'000;  // More than one piece.
  has_.Publish("dam", 1, kLarge);
  const auto found = shows_.Find("dam");
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->stream.lineage(), LineageOf(token_));
  EXPECT_EQ(found->stream.summary().labels().at("made"), "here");
  v1::ReconstructionParameters parameters;
  wire::EncodeParameters(MemoryReplica::Parameters(), parameters);
  EXPECT_EQ(found->stream.summary().parameters().ShortDebugString(), parameters.ShortDebugString());
  EXPECT_EQ(parameters.walls_size(), 1);
  EXPECT_EQ(parameters.sections_size(), 2);
  const Published newest = found->broadcaster->Newest();
  ASSERT_NE(newest.frame, nullptr);
  EXPECT_EQ(newest.sequence, 1u);
  EXPECT_EQ(static_cast<const WatchedResult&>(*newest.frame).bytes.ToString(),
            FrameBytes(1, kLarge));
}

TEST_F(RelayTest, WhoGoesBackGetsWhatItsReplicaHoldsAndWhoGoesFurtherBackToo) {
  Publish(1, 100);
  const auto recent = shows_.Watch("dam", WatchMode::kEvery, 60);
  ASSERT_NE(recent, nullptr);
  recent->WaitForFrames(41);
  ExpectAll(recent->seen(), 60, 100);
  const auto all = shows_.Watch("dam", WatchMode::kLatest, 0);
  ASSERT_NE(all, nullptr);
  all->WaitForFrames(100);
  ExpectAll(all->seen(), 1, 100);
  has_.Publish("dam", 101);
  recent->WaitForFrames(42);
  all->WaitForFrames(101);
  ExpectAll(recent->seen(), 60, 101);
  ExpectAll(all->seen(), 1, 101);
}

TEST_F(RelayTest, AStreamIsImportedTwiceAtMost) {
  Publish(1, 100);
  std::set<const ResultBroadcaster*> imports;
  std::vector<std::unique_ptr<MemoryWatcher>> watchers;
  for (std::uint64_t from = 66; from >= 10; from -= 8) {
    const auto found = shows_.Find("dam", from);
    ASSERT_TRUE(found.ok()) << found.status();
    imports.insert(found->broadcaster.get());
    watchers.push_back(shows_.Watch("dam", WatchMode::kEvery, from));
    ASSERT_NE(watchers.back(), nullptr);
    watchers.back()->WaitForFrames(101 - from);
    ExpectAll(watchers.back()->seen(), from, 100);
  }
  EXPECT_EQ(imports.size(), 2u);
  Publish(101, 101);
  for (std::size_t k = 0; k < watchers.size(); ++k) {
    const std::uint64_t from = 66 - 8 * k;
    watchers[k]->WaitForFrames(102 - from);
    ExpectAll(watchers[k]->seen(), from, 101);
  }
}

// More than one response to a fetch can hold.
TEST_F(RelayTest, AHistoryOfManyMegabytesComesInParts) {
  constexpr std::size_t kBytes = 200'000;
  Publish(1, 38, kBytes);
  const auto watcher = shows_.Watch("dam", WatchMode::kEvery, 1);
  ASSERT_NE(watcher, nullptr);
  watcher->WaitForFrames(38);
  ExpectAll(watcher->seen(), 1, 38);
}

TEST_F(RelayTest, WhatTheBusLosesIsFetched) {
  Publish(1, 1);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  support::Random random(7);
  std::atomic<int> lost = 0;
  hub_.SetLoses([&](const std::string& subject, std::string_view) {
    const bool loses = subject.starts_with("partiemc.results.") && random.Chance(0.3);
    if (loses) ++lost;
    return loses;
  });
  for (std::uint64_t k = 2; k <= 300; ++k) {
    has_.Publish("dam", k);
    if (k % 10 == 0) std::this_thread::sleep_for(milliseconds(1));
  }
  watcher->WaitForFrames(
      300);  // Including the last one: replicas request the number of the last result.
  ExpectAll(watcher->seen(), 1, 300);
  EXPECT_GT(lost, 10);
}

TEST(RelayWithoutHistory, WhatCannotBeHadCountsAsDropped) {
  MemoryHub hub;
  MemoryReplica has(hub, 0), shows(hub, 0);
  has.Open("dam", NewStreamToken());
  has.Publish("dam", 1);
  const auto watcher = shows.Watch("dam", WatchMode::kLatest);
  ASSERT_NE(watcher, nullptr);
  watcher->WaitForFrames(1);
  hub.SetLoses([&, k = 0](const std::string& subject, std::string_view) mutable {
    return subject.starts_with("partiemc.results.") && ++k % 3 == 0;
  });
  for (std::uint64_t k = 2; k <= 100; ++k) {
    has.Publish("dam", k);
    std::this_thread::sleep_for(milliseconds(1));
  }
  has.Close("dam");
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->end_reason(), kReasonFinished);
  EXPECT_LT(watcher->seen().size(), 100u) << "nothing was lost";
  ExpectAccounted(*watcher, 100);
}

TEST_F(RelayTest, WhileTheBusIsAwayNothingComesAndNothingIsMissingAfterwards) {
  Publish(1, 10);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  std::uint64_t last = 10;
  for (MemoryReplica* const away : {&has_, &shows_}) {
    away->bus().SetConnected(false);
    Publish(last + 1, last + 20);
    last += 20;
    EXPECT_TRUE(InTime([&] { return !away->relay().connected(); }));
    watcher->WaitForFrames(last - 29);
    EXPECT_EQ(watcher->seen().back().number, last - 20);
    away->bus().SetConnected(true);
    watcher->WaitForFrames(last - 9);
    ExpectAll(watcher->seen(), 10, last);
  }
}

TEST_F(RelayTest, WhoAsksAReplicaThatHasJustComeIsToldAllTheSame) {
  Publish(1, 1);
  for (int k = 0; k < 5; ++k) {
    MemoryReplica fresh(hub_);
    const auto watcher = fresh.Watch("dam");
    ASSERT_NE(watcher, nullptr) << "replica " << k;
    watcher->WaitForFrames(1);
  }
}

TEST_F(RelayTest, AStreamThatGoesOnElsewhereIsTakenOverForAllItsWatchers) {
  Publish(1, 10);
  MemoryReplica third(hub_);
  const auto own = has_.WatchOwn("dam"), elsewhere = shows_.Watch("dam");
  ASSERT_NE(elsewhere, nullptr);
  elsewhere->WaitForFrames(1);
  std::this_thread::sleep_for(milliseconds(3));  // Clocks have milliseconds.
  third.Open("dam", token_, 11);
  third.Publish("dam", 11);
  for (const auto* const watcher : {&own, &elsewhere}) {
    EXPECT_TRUE((*watcher)->status().ok());
    EXPECT_EQ((*watcher)->end_reason(), kReasonTakenOver);
  }
  // The former stream has not ended yet, and is not found.
  for (MemoryReplica* const replica : {&has_, &shows_}) {
    const auto again = replica->Watch("dam", WatchMode::kEvery, 11);
    ASSERT_NE(again, nullptr);
    again->WaitForFrames(1);
    EXPECT_EQ(again->seen().front().number, 11u);
    EXPECT_EQ(replica->relay().List("", 10, Caller()).size(), 1u);
  }
  EXPECT_TRUE(third.relay().List("", 10, Caller()).empty()) << "it is here, and later";
}

TEST_F(RelayTest, AStreamThatGoesOnHereIsTakenOverForThoseWhoWatchItHere) {
  Publish(1, 10);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  std::this_thread::sleep_for(milliseconds(3));
  shows_.Open("dam", token_, 11);
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->end_reason(), kReasonTakenOver);
}

TEST_F(RelayTest, AnEndIsToldAfterTheLastFrame) {
  Publish(1, 1);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  Publish(2, 40);
  has_.Close("dam");
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->end_reason(), kReasonFinished);
  ExpectAll(watcher->seen(), 1, 40);
}

TEST_F(RelayTest, AnEndWhileTheBusIsAwayIsToldOnceItIsBack) {
  Publish(1, 10);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  watcher->WaitForFrames(1);
  has_.bus().SetConnected(false);
  ASSERT_TRUE(InTime([this] { return !has_.relay().connected(); }));
  Publish(11, 40);
  has_.Close("dam");
  std::this_thread::sleep_for(milliseconds(200));
  has_.bus().SetConnected(true);
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->end_reason(), kReasonFinished);
  ExpectAll(watcher->seen(), 10, 40);
}

TEST_F(RelayTest, WhoIsAwayWhileAStreamEndsHearsHowAndHowMuchIsMissing) {
  Publish(1, 10);
  const auto watcher = shows_.Watch("dam", WatchMode::kLatest);
  ASSERT_NE(watcher, nullptr);
  watcher->WaitForFrames(1);
  shows_.bus().SetConnected(false);
  ASSERT_TRUE(InTime([this] { return !shows_.relay().connected(); }));
  Publish(11, 40);
  has_.Close("dam");
  std::this_thread::sleep_for(milliseconds(200));
  shows_.bus().SetConnected(true);
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->end_reason(), kReasonFinished);
  ExpectAccounted(*watcher, 40);
}

TEST_F(RelayTest, AReplicaThatDrainsIsAProducerLostForThoseWhoWatchElsewhere) {
  Publish(1, 1);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  has_.Close("dam", DrainingError());
  EXPECT_TRUE(watcher->status().ok()) << watcher->status();
  EXPECT_EQ(watcher->end_reason(), kReasonProducerLost);
}

TEST_F(RelayTest, AFrameThatIsTooLargeToBeWatchedEndsItWithTheSameError) {
  Publish(1, 1);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  has_.Publish("dam", 2, MemoryReplica::kWatcherBytes + 1);
  EXPECT_EQ(watcher->status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(watcher->end_reason(), kReasonWatchedBytes);
}

TEST_F(RelayTest, OneThatLeavesIsGoneAtOnce) {
  MemoryHub hub;
  MemoryReplica shows(hub);
  std::unique_ptr<MemoryWatcher> watcher;
  {
    MemoryReplica has(hub);
    has.Open("dam", NewStreamToken());
    has.Publish("dam", 1);
    watcher = shows.Watch("dam");
    ASSERT_NE(watcher, nullptr);
  }
  EXPECT_TRUE(watcher->status().ok());
  EXPECT_EQ(watcher->end_reason(), kReasonProducerLost);
  EXPECT_EQ(shows.relay().replicas(), 0u);
}

TEST_F(RelayTest, AddressesAreThoseOfReplicasThatDoNotDrain) {
  MemoryReplica a(hub_, 0, "a.example:50051"), b(hub_, 0, "b.example:50051");
  MemoryReplica path(hub_, 0, "unix:/run/p.sock"), malformed(hub_, 0, "a;b");
  ASSERT_TRUE(InTime([&] { return shows_.relay().replicas() == 5; }));
  EXPECT_THAT(shows_.relay().Addresses(), ElementsAre("a.example:50051", "b.example:50051"));
  EXPECT_TRUE(InTime([&] { return !a.relay().Addresses().empty(); }));
  EXPECT_THAT(a.relay().Addresses(), ElementsAre("b.example:50051"));
  b.relay().WillDrain();
  EXPECT_TRUE(InTime([&] { return shows_.relay().Addresses().size() == 1; }));
  EXPECT_THAT(shows_.relay().Addresses(), ElementsAre("a.example:50051"));
  EXPECT_EQ(shows_.relay().replicas(), 5u);
  a.relay().Drain();
  EXPECT_TRUE(InTime([&] { return shows_.relay().Addresses().empty(); }));
}

TEST_F(RelayTest, WhoWaitsForAStreamIsRefusedWhereItsReplicaDrains) {
  std::atomic<bool> refused = false;
  shows_.relay().Find("nothing", std::nullopt, [&](const auto& found) {
    refused = ReasonOf(found.status()) == kReasonDraining;
  });
  shows_.relay().Drain();
  EXPECT_TRUE(InTime([&] { return refused.load(); }));
  EXPECT_EQ(ReasonOf(shows_.Find("dam").status()), kReasonDraining);
}

TEST_F(RelayTest, ManyWatchersShareWhatIsPublishedOnce) {
  std::atomic<int> results = 0;
  hub_.SetLoses([&](const std::string& subject, std::string_view) {
    if (subject.starts_with("partiemc.results.")) ++results;
    return false;
  });
  Publish(1, 1);
  MemoryReplica third(hub_);
  std::vector<std::unique_ptr<MemoryWatcher>> watchers;
  for (int k = 0; k < 20; ++k) watchers.push_back((k % 2 == 0 ? shows_ : third).Watch("dam"));
  const int before = results;
  Publish(2, 11);
  for (const auto& watcher : watchers) {
    ASSERT_NE(watcher, nullptr);
    watcher->WaitForFrames(11);
    ExpectAll(watcher->seen(), 1, 11);
  }
  EXPECT_EQ(results - before, 10);
}

// A replica that forges a take-over succeeds: it can replace the shown results, but affects nothing
// else.
bool IsForgedTakeover(const std::string& message, const relay::v1::LiveStream& stream) {
  PieceJoiner joiner(message.size());
  relay::v1::RelayMessage forged;
  const auto whole = joiner.Add(message);
  if (!whole || !forged.ParseFromString(*whole)) return false;
  const auto& announcement = forged.announcement();
  return announcement.leaving() ||
         std::ranges::any_of(announcement.streams(), [&](const auto& other) {
           return other.lineage() == stream.lineage() &&
                  other.opened_unix_ms() > stream.opened_unix_ms();
         });
}

TEST_F(RelayTest, GarbageOnTheBusHarmsNobody) {
  Publish(1, 1);
  const auto watcher = shows_.Watch("dam");
  ASSERT_NE(watcher, nullptr);
  const auto stranger = hub_.Connect();
  support::Random random(3);
  std::mutex mutex;
  std::vector<std::string> heard;  // Guarded by the mutex.
  auto listens = stranger->Subscribe(kReplicasSubject, [&](std::string_view message) {
    const std::lock_guard lock(mutex);
    heard.emplace_back(message);
  });
  ASSERT_TRUE(InTime([&] {
    const std::lock_guard lock(mutex);
    return heard.size() > 1;
  }));
  listens.reset();
  const relay::v1::LiveStream stream = shows_.Find("dam")->stream;
  const std::string id = stream.summary().stream_id();
  for (int k = 0; k < 3000; ++k) {
    std::string message = random.Chance(0.5) ? heard[random.Below(2)] : std::string(40, 'x');
    for (std::size_t n = 1 + random.Below(4); n > 0; --n) {
      message[random.Below(message.size())] = static_cast<char>(random.Bits());
    }
    if (IsForgedTakeover(message, stream)) continue;
    stranger->Publish(random.Chance(0.5) ? kReplicasSubject : SubjectOfResults(id), message);
  }
  Publish(2, 20);
  watcher->WaitForFrames(20);
  ExpectAll(watcher->seen(), 1, 20);
}

}  // namespace
}  // namespace partiemc::server
