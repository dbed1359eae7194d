// Going back in a stream over gRPC: frames for late and paused watchers, and its limits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/program.h"
#include "partiemc/client/watcher.h"
#include "service/service_testing.h"
#include "support/chaos_proxy.h"

namespace partiemc::server {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::uint32_t kMany = 1000;  // Credit for all frames.

// A result is about 20 kB.
class WatchHistory : public ::testing::TestWithParam<v1::WatchMode> {
 protected:
  void Serve(std::uint64_t history_bytes = ServerLimits{}.history_bytes) {
    options_.limits.history_bytes = history_bytes;
    server_ = StartServer(options_);
    channel_ = Connect(*server_, Transport::kTcp);
    producer_ = std::make_unique<StreamClient>(channel_);
    ASSERT_TRUE(producer_->SendAndReceive(OpenRequest("tank")).has_opened());
  }
  // Produces and answers frames up to `last`.
  void ProduceUntil(std::uint64_t last) { ProduceUntil(*producer_, produced_, last); }
  static void ProduceUntil(StreamClient& producer, std::uint64_t& produced, std::uint64_t last) {
    for (; produced < last; ++produced) {
      ASSERT_TRUE(producer.SendAndReceive(BlobRequest(produced + 1, 1, produced)).has_frame());
    }
  }
  std::unique_ptr<WatchClient> Watch(std::uint32_t credits, std::optional<std::uint64_t> from) {
    auto watcher = std::make_unique<WatchClient>(channel_, "tank", GetParam(), credits, from);
    const auto answer = watcher->Receive();
    EXPECT_TRUE(answer.has_opened());
    opened_ = answer.opened();
    return watcher;
  }
  // The next `count` frames, serialised; expects no drop.
  static std::vector<std::string> Frames(WatchClient& watcher, std::size_t count) {
    std::vector<std::string> frames;
    while (frames.size() < count) {
      const auto answer = watcher.Receive();
      EXPECT_TRUE(answer.has_frame()) << answer.ShortDebugString();
      if (!answer.has_frame()) break;
      EXPECT_EQ(answer.frame().dropped(), 0u);
      frames.push_back(answer.frame().frame().SerializeAsString());
    }
    return frames;
  }
  static std::vector<std::uint64_t> Sequences(const std::vector<std::string>& frames) {
    std::vector<std::uint64_t> sequences;
    for (const std::string& bytes : frames) {
      v1::ReconstructedFrame frame;
      EXPECT_TRUE(frame.ParseFromString(bytes));
      sequences.push_back(frame.sequence());
    }
    return sequences;
  }
  static std::vector<std::uint64_t> From(std::uint64_t first, std::uint64_t last) {
    std::vector<std::uint64_t> sequences;
    for (std::uint64_t k = first; k <= last; ++k) sequences.push_back(k);
    return sequences;
  }
  v1::GetServerInfoResponse Info() { return InfoOf(channel_); }

  ServerOptions options_ = TestOptions();
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<StreamClient> producer_;
  std::uint64_t produced_ = 0;
  v1::WatchOpened opened_;
  std::string error_;  // Output of the program.
};

TEST_P(WatchHistory, ALateOneGetsAllThatIsHeldAsTheFirstOneGotIt) {
  Serve();
  WatchClient first(channel_, "tank", v1::WATCH_MODE_EVERY, kMany);
  ASSERT_TRUE(first.Receive().has_opened());
  ProduceUntil(25);
  const auto made = Frames(first, 25);
  const auto late = Watch(kMany, 0);
  EXPECT_TRUE(opened_.has_frames());
  EXPECT_EQ(opened_.oldest_sequence(), 1u);
  EXPECT_EQ(opened_.newest_sequence(), 25u);
  EXPECT_EQ(Frames(*late, 25), made);
  const auto later = Watch(kMany, 20);
  EXPECT_EQ(Frames(*later, 6), std::vector<std::string>(made.begin() + 19, made.end()));
  for (std::uint64_t k = 26; k <= 28; ++k) {  // Then live frames.
    ProduceUntil(k);
    const auto live = Frames(first, 1);
    EXPECT_EQ(Frames(*late, 1), live);
    EXPECT_EQ(Frames(*later, 1), live);
  }
}

TEST_P(WatchHistory, NobodyHasToHaveWatchedAndRefusedFramesAreNoHole) {
  Serve();
  ProduceUntil(4);
  auto bad = BlobRequest(5, 1, 4);
  bad.mutable_frame()->mutable_positions()->pop_back();
  ASSERT_TRUE(producer_->SendAndReceive(bad).has_error());
  produced_ = 5;
  ProduceUntil(9);
  EXPECT_THAT(Sequences(Frames(*Watch(kMany, 0), 8)), ElementsAre(1, 2, 3, 4, 6, 7, 8, 9));
  EXPECT_THAT(Sequences(Frames(*Watch(kMany, 5), 4)), ElementsAre(6, 7, 8, 9));
}

TEST_P(WatchHistory, OneThatPausedGoesOnWhereItWasInTheSameWatchAndInAnother) {
  Serve();
  ProduceUntil(5);
  const auto without_credit = Watch(3, 1), left = Watch(3, 1);
  EXPECT_EQ(Sequences(Frames(*without_credit, 3)), From(1, 3));
  EXPECT_EQ(Sequences(Frames(*left, 3)), From(1, 3));
  left->Cancel();
  ProduceUntil(12);
  without_credit->Credit(kMany);
  EXPECT_EQ(Sequences(Frames(*without_credit, 9)), From(4, 12));
  EXPECT_EQ(Sequences(Frames(*Watch(kMany, 4), 9)), From(4, 12));
}

TEST_P(WatchHistory, OneFromBeyondTheNewestGetsWhatIsLiveAlone) {
  Serve();
  ProduceUntil(6);
  const auto next = Watch(kMany, 7), far = Watch(kMany, 1'000'000);
  EXPECT_EQ(opened_.newest_sequence(), 6u);
  ProduceUntil(7);
  EXPECT_EQ(Sequences(Frames(*next, 1)), From(7, 7));
  EXPECT_EQ(Sequences(Frames(*far, 1)), From(7, 7));
}

TEST_P(WatchHistory, DropsTheOldestAndReportsThemToAWatcherThatAsks) {
  Serve(100'000);
  ProduceUntil(100);
  const auto watcher = Watch(kMany, 3);
  const std::uint64_t oldest = opened_.oldest_sequence();
  EXPECT_GT(oldest, 80u);
  EXPECT_LT(oldest, 100u);
  EXPECT_EQ(opened_.newest_sequence(), 100u);
  const auto frame = watcher->Receive().frame();
  EXPECT_EQ(frame.frame().sequence(), oldest);
  EXPECT_EQ(frame.oldest_sequence(), oldest);
  EXPECT_EQ(Sequences(Frames(*watcher, 100 - oldest)), From(oldest + 1, 100));
  ProduceUntil(101);
  EXPECT_GE(watcher->Receive().frame().oldest_sequence(), oldest);
}

TEST_P(WatchHistory, AllStreamsTogetherHoldAnEighthOfTheBudgetInSharesAtMost) {
  options_.limits.memory_budget = 8 << 20;
  options_.limits.max_frame_bytes = 100'000;
  Serve();
  EXPECT_EQ(options_.limits.AllHistoryBytes(), 1u << 20);
  EXPECT_EQ(Info().load().memory_budget(), 7u << 20);
  ProduceUntil(150);
  EXPECT_GT(Info().load().history_bytes(), 900'000u);
  std::vector<std::unique_ptr<StreamClient>> others;
  for (int k = 0; k < 3; ++k) {
    others.push_back(std::make_unique<StreamClient>(channel_));
    ASSERT_TRUE(others.back()->SendAndReceive(OpenRequest()).has_opened());
    std::uint64_t produced = 0;
    ProduceUntil(*others.back(), produced, 60);
    EXPECT_LE(Info().load().history_bytes(), 1u << 20);
  }
  // The first has made room although nothing was sent to it.
  Watch(1, 0);
  const std::uint64_t held = opened_.newest_sequence() + 1 - opened_.oldest_sequence();
  EXPECT_LT(held, 40u);
  EXPECT_GT(held, 5u);
  others.clear();
  producer_.reset();
  EXPECT_TRUE(Eventually([&] { return Info().load().history_bytes() == 0; }));
}

TEST_P(WatchHistory, OneThatReadsSlowlyHoldsUpNobodyAndHoldsNextToNothing) {
  Serve();
  ProduceUntil(40);
  const auto slow = Watch(1, 0);
  EXPECT_EQ(Sequences(Frames(*slow, 1)), From(1, 1));
  const auto other = Watch(kMany, 0);
  EXPECT_EQ(Sequences(Frames(*other, 40)), From(1, 40));
  for (std::uint64_t k = 41; k <= 80; ++k) {
    ProduceUntil(k);
    EXPECT_EQ(Sequences(Frames(*other, 1)), From(k, k));
  }
  EXPECT_TRUE(Eventually([&] { return Info().load().watched_bytes() == 0; }));
  slow->Credit(kMany);
  EXPECT_EQ(Sequences(Frames(*slow, 79)), From(2, 80));
}

TEST_P(WatchHistory, AStreamThatIsResumedKeepsIt) {
  Serve();
  auto open = OpenRequest("pond");
  open.mutable_open()->set_checkpoint_interval(1);
  StreamClient former(channel_), resumed(channel_);
  const auto opened = former.SendAndReceive(open).opened();
  std::string checkpoint;
  for (std::uint64_t k = 1; k <= 8; ++k) {
    const auto answer = former.SendAndReceive(BlobRequest(k, 1, k));
    ASSERT_TRUE(answer.has_frame());
    if (k == 6) checkpoint = answer.checkpoint();
  }
  open.mutable_open()->mutable_resume()->set_stream_token(opened.stream_token());
  open.mutable_open()->mutable_resume()->set_checkpoint(checkpoint);
  ASSERT_EQ(resumed.SendAndReceive(open).opened().next_sequence(), 7u);
  WatchClient watcher(channel_, "pond", GetParam(), kMany, 0);
  const auto answer = watcher.Receive();
  EXPECT_EQ(answer.opened().oldest_sequence(), 1u);
  EXPECT_EQ(answer.opened().newest_sequence(), 6u);
  EXPECT_EQ(Sequences(Frames(watcher, 6)), From(1, 6));
  for (std::uint64_t k = 7; k <= 9; ++k) {
    ASSERT_TRUE(resumed.SendAndReceive(BlobRequest(k, 1, k)).has_frame());
    EXPECT_EQ(Sequences(Frames(watcher, 1)), From(k, k));
  }
}

TEST_P(WatchHistory, AServerWithoutItShowsTheNewest) {
  Serve(0);
  EXPECT_THAT(Info().capabilities(), Not(Contains("history")));
  ProduceUntil(5);
  const auto watcher = Watch(kMany, 1);
  EXPECT_EQ(opened_.oldest_sequence(), 5u);
  EXPECT_EQ(opened_.newest_sequence(), 5u);
  EXPECT_EQ(Sequences(Frames(*watcher, 1)), From(5, 5));
  EXPECT_EQ(Info().load().history_bytes(), 0u);
}

TEST_P(WatchHistory, AWatchWhoseConnectionIsCutMissesNothing) {
  Serve();
  EXPECT_THAT(Info().capabilities(), Contains("history"));
  support::ChaosProxy proxy(server_->address().ToString());
  ProduceUntil(3);
  const auto watcher = client::Watcher::Open(
      proxy.address(), "tank",
      {.mode = GetParam() == v1::WATCH_MODE_EVERY ? client::WatchMode::kEvery
                                                  : client::WatchMode::kLatest,
       .from_sequence = 2,
       .rejoin = {.first_pause = std::chrono::milliseconds(10)}});
  ASSERT_TRUE(watcher.ok()) << watcher.status();
  ASSERT_TRUE((*watcher)->stream().held.has_value());
  EXPECT_EQ((*watcher)->stream().held->oldest_sequence, 1u);
  EXPECT_EQ((*watcher)->stream().held->newest_sequence, 3u);
  std::uint64_t rejoined = 0, last = 1;
  client::WatchedFrame frame;
  const auto receive_until = [&](std::uint64_t sequence) {
    while (last < sequence) {
      const auto received = (*watcher)->Receive(frame);
      ASSERT_TRUE(received.ok()) << received.status();
      ASSERT_EQ(frame.sequence, last + 1);
      EXPECT_EQ(frame.dropped + frame.gap, 0u);
      EXPECT_EQ(frame.oldest_sequence, 1u);
      last = frame.sequence;
      rejoined += frame.rejoined.empty() ? 0 : 1;
    }
  };
  receive_until(3);
  for (std::uint64_t round = 1; round <= 5; ++round) {
    proxy.Reset();
    ProduceUntil(3 + 10 * round);
    receive_until(3 + 10 * round);
  }
  EXPECT_EQ(rejoined, 5u);
}

TEST_P(WatchHistory, ThePartiemcProgramGoesBack) {
  Serve(100'000);
  ProduceUntil(60);
  Watch(1, 0);
  const auto oldest = static_cast<std::size_t>(opened_.oldest_sequence());
  const support::TemporaryFolder folder;
  const auto frames = [&](const std::string& from, std::size_t count) {
    const std::string directory = folder.Path("from-" + from);
    const client::Ran ran = client::RunPartiemc(
        {"watch", "tank", "--server", server_->address().ToString(), "--mode",
         GetParam() == v1::WATCH_MODE_EVERY ? "every" : "latest", "--from", from, "--frames",
         std::to_string(count), "--quiet", "--output-dir", directory});
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    error_ = ran.error;
    return client::FilesIn(directory);
  };
  const std::size_t held = 61 - oldest;
  const auto all = frames("oldest", held);
  EXPECT_EQ(all.size(), held);
  EXPECT_EQ(error_, "");
  EXPECT_EQ(all.back(), "frame_000059.geojson");
  EXPECT_THAT(frames("58", 3),
              ElementsAre("frame_000057.geojson", "frame_000058.geojson", "frame_000059.geojson"));
  EXPECT_EQ(frames("1", held), all);
  EXPECT_THAT(error_, HasSubstr("frames before " + std::to_string(oldest) +
                                " are no longer in the history"));
}

INSTANTIATE_TEST_SUITE_P(Modes, WatchHistory,
                         ::testing::Values(v1::WATCH_MODE_LATEST, v1::WATCH_MODE_EVERY),
                         [](const auto& mode) {
                           return mode.param == v1::WATCH_MODE_EVERY ? "Every" : "Latest";
                         });

}  // namespace
}  // namespace partiemc::server
