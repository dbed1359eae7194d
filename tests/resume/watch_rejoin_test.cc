// Watchers of a stream that moves between servers, is taken over, or does not return.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"
#include "resume/fleet.h"
#include "resume/options.h"
#include "resume/watch_history.h"
#include "resume/workload.h"
#include "service/service_testing.h"
#include "support/random.h"

namespace partiemc::resume {
namespace {

using std::chrono::milliseconds;

std::vector<std::string> Others(const std::vector<std::string>& addresses) {
  return {addresses.begin() + 1, addresses.end()};
}

class WatchRejoin : public testing::TestWithParam<Workload (*)()> {};

INSTANTIATE_TEST_SUITE_P(Of, WatchRejoin, testing::Values(&DamBreak, &Merge),
                         [](const auto& test) { return test.param().name.substr(0, 3); });

TEST_P(WatchRejoin, KilledServersShowEachFrameOnceOrReportAGap) {
  constexpr std::size_t kServers = 3;
  constexpr double kRate = 40;
  std::printf("seed %llu\n", static_cast<unsigned long long>(GetOptions().seed));
  support::Random random(GetOptions().seed);
  Fleet fleet(kServers);
  const Workload workload = GetParam()();
  client::StreamOptions options{.name = workload.name,
                                .parameters = workload.parameters,
                                .fallback_addresses = Others(fleet.addresses())};
  options.connect_timeout = std::chrono::seconds(20);
  const auto stream = client::Stream::Open(fleet.addresses().front(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  const std::vector<client::WatchMode> modes = {client::WatchMode::kLatest,
                                                client::WatchMode::kEvery};
  std::vector<WatchHistory> seen(modes.size());
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < modes.size(); ++k) {
    threads.emplace_back([&, k] {
      const auto watcher = client::Watcher::Open(
          fleet.addresses().front(), workload.name,
          {.mode = modes[k], .credits = 4, .fallback_addresses = Others(fleet.addresses())});
      seen[k].end = watcher.status();
      if (watcher.ok()) seen[k] = WatchAll(**watcher);
    });
  }
  std::atomic<bool> over = false;
  threads.emplace_back([&] {
    for (std::uint64_t k = 0; k < GetOptions().kills; ++k) {
      std::this_thread::sleep_for(milliseconds(static_cast<int>(random.Uniform(200, 500))));
      fleet.KillAndRestart(random.Below(kServers));
    }
    std::this_thread::sleep_for(milliseconds(300));
    over = true;
  });
  const History history =
      RunThrough(**stream, workload, kRate, [&](std::uint64_t) -> bool { return over; });
  for (std::thread& thread : threads) thread.join();
  const History undisturbed = RunUndisturbed(workload, history.sent);
  EXPECT_TRUE(Complete(history)) << workload.name;
  for (std::size_t k = 0; k < modes.size(); ++k) {
    EXPECT_TRUE(seen[k].end.ok()) << seen[k].end;
    EXPECT_EQ(seen[k].reason, "FINISHED");
    EXPECT_TRUE(Rising(seen[k])) << workload.name << " " << k;
    EXPECT_TRUE(Accounted(seen[k], history.sent)) << workload.name << " " << k;
    EXPECT_TRUE(Identical(seen[k], undisturbed)) << workload.name << " " << k;
    std::uint64_t rejoined = 0, dropped = 0, gaps = 0;
    for (const WatchedAnswer& one : seen[k].seen) {
      rejoined += one.rejoined ? 1 : 0;
      dropped += one.dropped;
      gaps += one.gap;
    }
    std::printf("%s: %llu kills, %llu frames, %zu seen, %llu dropped, %llu in %llu gaps\n",
                workload.name.c_str(), static_cast<unsigned long long>(GetOptions().kills),
                static_cast<unsigned long long>(history.sent), seen[k].seen.size(),
                static_cast<unsigned long long>(dropped), static_cast<unsigned long long>(gaps),
                static_cast<unsigned long long>(rejoined));
  }
}

class WatchTakenOver : public testing::Test {
 protected:
  // A watch of the stream "tank".
  std::unique_ptr<client::Watcher> Watch(milliseconds give_up_after) {
    auto watcher = client::Watcher::Open(
        server_->address().ToString(), "tank",
        {.mode = client::WatchMode::kEvery,
         .credits = 20,
         .rejoin = {.give_up_after = give_up_after, .first_pause = milliseconds(10)}});
    EXPECT_TRUE(watcher.ok()) << watcher.status();
    return watcher.ok() ? *std::move(watcher) : nullptr;
  }
  // Frames 1 to `count`.
  static void Produce(server::StreamClient& producer, std::uint64_t count) {
    for (std::uint64_t k = 1; k <= count; ++k) {
      ASSERT_TRUE(producer.SendAndReceive(server::BlobRequest(k, 1, k)).has_frame());
    }
  }
  void WaitUntilWatched() {
    const auto stub = v1::ReconstructionService::NewStub(channel_);
    for (v1::ListStreamsResponse list;
         list.streams_size() != 1 || list.streams(0).watchers() == 0;) {
      server::TimedContext context;
      ASSERT_TRUE(stub->ListStreams(&context, {}, &list).ok());
    }
  }
  static std::vector<std::uint64_t> SequencesOf(const WatchHistory& history) {
    std::vector<std::uint64_t> sequences;
    for (const WatchedAnswer& one : history.seen) sequences.push_back(one.sequence);
    return sequences;
  }

  std::unique_ptr<server::Server> server_ = server::StartServer(server::TestOptions());
  std::shared_ptr<grpc::Channel> channel_ = server::Connect(*server_, server::Transport::kTcp);
};

TEST_F(WatchTakenOver, AStreamRestartedAfterAResumeShowsNoFrameTwice) {
  auto open = server::OpenRequest("tank");
  server::StreamClient first(channel_), second(channel_);
  const auto opened = first.SendAndReceive(open).opened();
  const auto watcher = Watch(std::chrono::seconds(60));
  ASSERT_NE(watcher, nullptr);
  Produce(first, 3);
  client::WatchedFrame frame;
  for (std::uint64_t k = 1; k <= 3; ++k) {
    ASSERT_TRUE(watcher->Receive(frame).ok());
    EXPECT_EQ(frame.sequence, k);
  }
  WatchHistory history;
  std::thread receiver([&] { history = WatchAll(*watcher); });
  // Without a checkpoint, so it starts with the first frame.
  open.mutable_open()->mutable_resume()->set_stream_token(opened.stream_token());
  EXPECT_TRUE(second.SendAndReceive(open).has_opened());
  WaitUntilWatched();
  Produce(second, 6);
  second.HalfClose();
  EXPECT_TRUE(second.Finish().ok());
  receiver.join();
  EXPECT_EQ(history.reason, "FINISHED");
  ASSERT_EQ(SequencesOf(history), (std::vector<std::uint64_t>{4, 5, 6}));
  EXPECT_TRUE(history.seen.front().rejoined);
  EXPECT_EQ(history.seen.front().gap, 0u);
  EXPECT_TRUE(Accounted(history, 6));
}

TEST_F(WatchTakenOver, AnotherStreamOfTheNameIsNotTakenForIt) {
  auto producer = std::make_unique<server::StreamClient>(channel_);
  ASSERT_TRUE(producer->SendAndReceive(server::OpenRequest("tank")).has_opened());
  const auto watcher = Watch(milliseconds(200));
  ASSERT_NE(watcher, nullptr);
  Produce(*producer, 2);
  do {  // The name is free when the server has detected that the former producer is lost.
    producer = std::make_unique<server::StreamClient>(channel_);
  } while (!producer->SendAndReceive(server::OpenRequest("tank")).has_opened());
  Produce(*producer, 5);
  const WatchHistory history = WatchAll(*watcher);
  EXPECT_TRUE(history.end.ok()) << history.end;
  EXPECT_EQ(history.reason, "PRODUCER_LOST");
  EXPECT_EQ(SequencesOf(history), (std::vector<std::uint64_t>{1, 2}));
}

TEST_F(WatchTakenOver, WhoDoesNotWantToRejoinHearsTheEndAtOnceAndAgain) {
  auto producer = std::make_unique<server::StreamClient>(channel_);
  ASSERT_TRUE(producer->SendAndReceive(server::OpenRequest("tank")).has_opened());
  const auto watcher = Watch(milliseconds(0));
  ASSERT_NE(watcher, nullptr);
  producer.reset();
  client::WatchedFrame frame;
  for (int k = 0; k < 2; ++k) EXPECT_EQ(*watcher->Receive(frame), client::Received::kEnd);
  EXPECT_EQ(watcher->end().reason, "PRODUCER_LOST");
}

TEST_F(WatchTakenOver, AServerThatDoesNotComeBackEndsTheWatchAndCancelEndsTheSearch) {
  server::StreamClient producer(channel_);
  ASSERT_TRUE(producer.SendAndReceive(server::OpenRequest("tank")).has_opened());
  const auto patient = Watch(std::chrono::minutes(10)), hasty = Watch(milliseconds(100));
  ASSERT_TRUE(patient != nullptr && hasty != nullptr);
  server_.reset();
  const WatchHistory history = WatchAll(*hasty);
  EXPECT_EQ(history.end.code(), absl::StatusCode::kUnavailable) << history.end;
  EXPECT_NE(history.end.message().find("not found again within 0.1 s"), std::string::npos);
  client::WatchedFrame frame;
  EXPECT_EQ(*patient->Receive(frame, milliseconds(50)), client::Received::kNothingYet);
  std::thread canceller([&] { patient->Cancel(); });
  EXPECT_EQ(patient->Receive(frame).status().code(), absl::StatusCode::kCancelled);
  canceller.join();
}

// Checks that the validators can fail.
TEST(WatchHistory, TheValidatorsFindWhatTheyAreNamedAfter) {
  const WatchHistory good{.seen = {{.sequence = 2, .rings_digest = 20},
                                   {.sequence = 4, .dropped = 1, .rings_digest = 40},
                                   {.sequence = 7, .gap = 2, .rings_digest = 70, .rejoined = true}},
                          .dropped_at_end = 1};
  EXPECT_TRUE(Rising(good));
  EXPECT_TRUE(Accounted(good, 8));
  EXPECT_FALSE(Accounted(good, 9));
  WatchHistory twice = good;
  twice.seen[1].sequence = 2;
  EXPECT_FALSE(Rising(twice));
  WatchHistory untold = good;
  untold.seen[1].dropped = 0;
  EXPECT_FALSE(Accounted(untold, 8));
  WatchHistory groundless = good;
  groundless.seen[2].rejoined = false;
  EXPECT_FALSE(Accounted(groundless, 8));
  History undisturbed;
  for (std::uint64_t k = 1; k <= 8; ++k) {
    undisturbed.answers.push_back({.sequence = k, .rings_digest = 10 * k});
  }
  EXPECT_TRUE(Identical(good, undisturbed));
  WatchHistory other = good;
  other.seen[0].rings_digest = 21;
  EXPECT_FALSE(Identical(other, undisturbed));
}

}  // namespace
}  // namespace partiemc::resume
