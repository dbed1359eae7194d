// StreamStateMachine over an in-memory transport: order, window, ends, and results that do not
// depend on other streams. Also under ThreadSanitizer.
#include "server/stream/stream_state_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/status.h"
#include "server/memory_transport.h"
#include "server/moving_blob.h"

namespace partiemc::server {
namespace {

using ::testing::ElementsAre;

constexpr FrameLimits kLimits{.max_particles = 2000, .max_tiles = 1000};
constexpr std::size_t kWindow = 4;

// Blocks a pool's only thread until opened.
class Gate {
 public:
  explicit Gate(ComputePool& pool) {
    pool.Submit([future = opened_.get_future().share()](Worker&) { future.wait(); });
  }
  ~Gate() { Open(); }
  void Open() {
    if (!std::exchange(is_open_, true)) opened_.set_value();
  }

 private:
  std::promise<void> opened_;
  bool is_open_ = false;
};

std::vector<MemoryAnswer> ReceiveAll(MemoryTransport& transport) {
  std::vector<MemoryAnswer> answers;
  while (auto answer = transport.Receive()) answers.push_back(*answer);
  return answers;
}

// The answers of a whole stream of blob `seed`, opened and half-closed.
std::vector<MemoryAnswer> RunStream(ComputePool& pool, unsigned seed, std::uint64_t frames) {
  MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
  transport.Open();
  for (std::uint64_t i = 0; i < frames; ++i) transport.Send(i + 1, MovingBlob(seed, i));
  transport.HalfClose();
  return ReceiveAll(transport);
}

TEST(StreamStateMachine, OpensAnswersEveryFrameInOrderAndEndsWell) {
  ComputePool pool(2);
  MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
  transport.Open();
  for (std::uint64_t i = 1; i <= 10; ++i) transport.Send(i, MovingBlob(1, i));
  transport.HalfClose();
  const auto answers = ReceiveAll(transport);
  ASSERT_EQ(answers.size(), 11u);
  EXPECT_EQ(answers[0].what, Outgoing::kOpened);
  for (std::uint64_t i = 1; i <= 10; ++i) {
    EXPECT_EQ(answers[i].sequence, i);
    EXPECT_EQ(answers[i].reason, "");
  }
  EXPECT_TRUE(transport.status().ok()) << transport.status();
  EXPECT_EQ(transport.machine().counts().frames, 10u);
  EXPECT_EQ(transport.machine().counts().last_sequence, 10u);
}

TEST(StreamStateMachine, ReadsNoFurtherAheadThanTheWindowWhenTheClientDoesNotReceive) {
  ComputePool pool(2);
  for (const std::size_t window : {std::size_t{1}, std::size_t{3}, kWindow}) {
    MemoryTransport transport(pool, window, BlobParameters(), kLimits);
    transport.Open();
    for (std::uint64_t i = 1; i <= 20; ++i) transport.Send(i, MovingBlob(1, i));
    transport.HalfClose();
    // The transport holds `opened`; the window fills behind it, and no more.
    transport.WaitUntilRead(window);
    EXPECT_EQ(ReceiveAll(transport).size(), 21u);
    // The transport holds one answer that is neither in the server nor received.
    EXPECT_LE(transport.most_inside(), window + 1);
    EXPECT_GE(transport.most_inside(), window);
  }
}

TEST(StreamStateMachine, SpoiledFramesDoNotChangeTheOtherResults) {
  ComputePool pool(2);
  const auto undisturbed = RunStream(pool, 5, 20);
  MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
  transport.Open();
  std::vector<std::string> expected;  // Reason by answer; empty for a result.
  std::uint64_t sequence = 0;
  const auto send = [&](std::uint64_t number, std::vector<double> positions,
                        std::string_view reason) {
    transport.Send(number, std::move(positions));
    expected.emplace_back(reason);
  };
  for (std::uint64_t i = 0; i < 20; ++i) {
    if (i % 5 == 4) {
      std::vector<double> nan = MovingBlob(5, i);
      nan[i] = std::numeric_limits<double>::quiet_NaN();
      send(++sequence, nan, kReasonNotFinite);
      send(++sequence, std::vector<double>(5001 * 2, 1.0), kReasonTooManyParticles);
      send(sequence, MovingBlob(5, 99), kReasonSequenceDuplicate);
      send(sequence + 7, MovingBlob(5, 99), kReasonSequenceGap);
    }
    send(++sequence, MovingBlob(5, i), "");
  }
  transport.HalfClose();
  std::vector<std::string> reasons;
  std::vector<MemoryAnswer> results;
  for (const MemoryAnswer& answer : ReceiveAll(transport)) {
    if (answer.what != Outgoing::kAnswer) continue;
    reasons.push_back(answer.reason);
    if (answer.reason.empty()) results.push_back(answer);
  }
  EXPECT_EQ(reasons, expected);
  ASSERT_EQ(results.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(results[i].digests, undisturbed[i + 1].digests) << "frame " << i;
  }
  EXPECT_EQ(transport.machine().counts().frames, 20u);
  EXPECT_EQ(transport.machine().counts().frame_errors, 16u);
}

TEST(StreamStateMachine, ResultsAreTheSameForOneTwoAndSevenThreads) {
  // One pool at a time, because each limits the threads of the process.
  const auto answers_with = [](unsigned threads) {
    ComputePool pool(threads);
    return RunStream(pool, 6, 8);
  };
  const auto expected = answers_with(1);
  ASSERT_EQ(expected.size(), 9u);
  EXPECT_EQ(answers_with(2), expected);
  EXPECT_EQ(answers_with(7), expected);
}

TEST(StreamStateMachine, ResultsAreTheSameAloneAndWithFiveOtherStreamsRunning) {
  ComputePool pool(3);
  const auto expected = RunStream(pool, 7, 10);
  std::vector<std::thread> others;
  for (unsigned seed = 100; seed < 105; ++seed) {
    others.emplace_back([&pool, seed] { EXPECT_EQ(RunStream(pool, seed, 10).size(), 11u); });
  }
  EXPECT_EQ(RunStream(pool, 7, 10), expected);
  for (std::thread& other : others) other.join();
}

TEST(StreamStateMachine, AFrameBeforeOpenEndsTheStream) {
  ComputePool pool(1);
  MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
  transport.Send(1, MovingBlob(1, 0));
  EXPECT_TRUE(ReceiveAll(transport).empty());
  EXPECT_EQ(transport.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(transport.status().message(), "request: frame; the first must be `open`");
}

TEST(StreamStateMachine, AStreamThatNeverOpensEndsWithAWordAboutIt) {
  ComputePool pool(1);
  MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
  transport.HalfClose();
  EXPECT_EQ(transport.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(FindViolation(transport.status())->reason, kReasonProtocol);
}

TEST(StreamStateMachine, ParametersThatAreRefusedEndTheStreamWithTheirReason) {
  ComputePool pool(1);
  ReconstructionParameters parameters;
  parameters.cell_size = -1;
  MemoryTransport transport(pool, kWindow, parameters, kLimits);
  transport.Open();
  EXPECT_TRUE(ReceiveAll(transport).empty());
  EXPECT_EQ(FindViolation(transport.status())->reason, kReasonOutOfRange);
}

TEST(StreamStateMachine, ASecondOpenOrEmptyRequestEndsTheStreamAfterItsAnswers) {
  ComputePool pool(2);
  for (const RequestKind kind : {RequestKind::kOpen, RequestKind::kEmpty}) {
    MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
    transport.Open();
    transport.Send(1, MovingBlob(1, 0));
    transport.Send(2, MovingBlob(1, 1));
    transport.SendRequest({.kind = kind, .sequence = 0, .positions = {}});
    transport.Send(3, MovingBlob(1, 2));
    const auto answers = ReceiveAll(transport);
    ASSERT_EQ(answers.size(), 3u);
    EXPECT_EQ(answers[2].sequence, 2u);
    EXPECT_EQ(transport.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(FindViolation(transport.status())->reason, kReasonProtocol);
  }
}

TEST(StreamStateMachine, ADrainTellsTheClientAnswersWhatWasReadAndEndsUnavailable) {
  ComputePool pool(1);
  MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
  transport.Open();
  ASSERT_EQ(transport.Receive()->what, Outgoing::kOpened);
  Gate gate(pool);
  for (std::uint64_t i = 1; i <= 10; ++i) transport.Send(i, MovingBlob(1, i));
  transport.WaitUntilRead(kWindow);
  transport.machine().Drain();
  gate.Open();
  const auto answers = ReceiveAll(transport);
  // The machine may drop a read that was delivered but not yet reported.
  ASSERT_GE(answers.size(), kWindow);
  ASSERT_LE(answers.size(), kWindow + 1);
  EXPECT_EQ(answers[0].what, Outgoing::kDraining);
  for (std::size_t i = 1; i < answers.size(); ++i) EXPECT_EQ(answers[i].sequence, i);
  EXPECT_EQ(transport.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(FindViolation(transport.status())->reason, kReasonDraining);
}

TEST(StreamStateMachine, ADrainEndsAStreamThatHasNotOpened) {
  ComputePool pool(1);
  MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
  transport.machine().Drain();
  EXPECT_TRUE(ReceiveAll(transport).empty());
  EXPECT_EQ(transport.status().code(), absl::StatusCode::kUnavailable);
}

// The transport throws if it is used after the end.
TEST(StreamStateMachine, WhatComesAfterTheEndReachesNoTransport) {
  ComputePool pool(1);
  MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
  transport.Open();
  transport.HalfClose();
  EXPECT_EQ(ReceiveAll(transport).size(), 1u);
  EXPECT_TRUE(transport.status().ok());
  EXPECT_NO_THROW({
    transport.machine().TakenOver();
    transport.machine().Drain();
    transport.machine().Cancelled();
    transport.machine().EndIfIdle({.streaming = std::chrono::milliseconds(1)},
                                  std::chrono::steady_clock::now() + std::chrono::hours(1));
    transport.machine().Granted(0);
  });
}

TEST(StreamStateMachine, ACancelledStreamComputesNothingThatWasOnlyQueued) {
  ComputePool pool(1);
  Gate gate(pool);
  MemoryTransport transport(pool, kWindow, BlobParameters(), kLimits);
  transport.Open();
  for (std::uint64_t i = 1; i <= 10; ++i) transport.Send(i, MovingBlob(1, i));
  transport.WaitUntilRead(kWindow);
  transport.Cancel();
  gate.Open();
  EXPECT_EQ(transport.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(transport.machine().counts().frames, 0u);
}

// The transport throws if the machine violates its contract: two concurrent reads or writes, or any
// use after the end.
TEST(StreamStateMachine, MayBeCancelledAndDrainedAtAnyMoment) {
  constexpr unsigned kSeed = 31;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  ComputePool pool(2);
  for (int round = 0; round < 200; ++round) {
    MemoryTransport transport(pool, 1 + random() % 4, BlobParameters(), kLimits);
    transport.Open();
    for (std::uint64_t i = 1; i <= 4; ++i) transport.Send(i, MovingBlob(1, i));
    if (random() % 2 == 0) transport.HalfClose();
    const bool drain = random() % 2 == 0, cancel = !drain || random() % 2 == 0;
    const auto pause = std::chrono::microseconds(random() % 3000);
    std::thread outside([&] {
      std::this_thread::sleep_for(pause);
      if (drain) transport.machine().Drain();
      if (cancel) transport.Cancel();
    });
    std::uint64_t expected = 1;
    while (const auto answer = transport.Receive()) {
      if (answer->what != Outgoing::kAnswer) continue;
      EXPECT_EQ(answer->sequence, expected++);
    }
    outside.join();
    const auto code = transport.status().code();
    // Before `open`, a read that ends with the connection looks like a half-close.
    EXPECT_TRUE(code == absl::StatusCode::kOk || code == absl::StatusCode::kCancelled ||
                code == absl::StatusCode::kUnavailable ||
                (cancel && code == absl::StatusCode::kInvalidArgument))
        << transport.status();
  }
}

TEST(ComputePool, RunsWhatWasSubmittedBeforeItGoes) {
  std::atomic<int> ran = 0;
  {
    ComputePool pool(2);
    for (int i = 0; i < 100; ++i) pool.Submit([&](Worker&) { ++ran; });
  }
  EXPECT_EQ(ran, 100);
}

// A stream of large frames beside twenty of small ones. Counts turns instead of time: each stream
// waits for at most one frame of every other stream.
TEST(StreamStateMachine, OneOfLargeFramesDelaysEachSmallFrameByOneOfItsOwn) {
  constexpr int kStreams = 21;
  ComputePool pool(1);
  Gate gate(pool);
  std::vector<int> turns;  // Turns of the pool's only thread.
  std::vector<std::unique_ptr<MemoryTransport>> transports;
  std::vector<std::thread> clients;
  for (int i = 0; i < kStreams; ++i) {
    transports.push_back(
        std::make_unique<MemoryTransport>(pool, kWindow, BlobParameters(), kLimits));
    MemoryTransport& transport = *transports.back();
    transport.when_answering = [&turns, i] { turns.push_back(i); };
    transport.Open();
    for (std::uint64_t k = 1; k <= 3 * kWindow; ++k) {
      // The first stream's frames are thirty times larger.
      std::vector<double> positions = MovingBlob(1, k);
      if (i > 0) positions.resize(80);
      transport.Send(k, std::move(positions));
    }
    transport.HalfClose();
  }
  // Every window is full when the first turn begins.
  for (const auto& transport : transports) transport->WaitUntilRead(kWindow);
  gate.Open();
  for (const auto& transport : transports) {
    clients.emplace_back(
        [&transport] { EXPECT_EQ(ReceiveAll(*transport).size(), 3 * kWindow + 1); });
  }
  for (std::thread& client : clients) client.join();
  ASSERT_EQ(turns.size(), kStreams * 3 * kWindow);
  // While all have waiting frames, each stream has one turn per round.
  for (std::size_t round = 0; round < kWindow - 1; ++round) {
    std::set<int> in_round;
    for (int i = 0; i < kStreams; ++i) in_round.insert(turns[round * kStreams + i]);
    EXPECT_EQ(in_round.size(), kStreams) << "round " << round;
  }
}

TEST(ComputePool, GivesEveryStreamATurnBeforeAnyHasASecond) {
  ComputePool pool(1);
  Gate gate(pool);
  std::vector<int> order;
  std::promise<void> done;
  // Each stream submits its next frame when the previous one has ended, like StreamStateMachine.
  std::function<void(int, int)> submit = [&](int stream, int frames) {
    pool.Submit([&, stream, frames](Worker&) {
      order.push_back(stream);
      if (order.size() == 6) done.set_value();
      if (frames > 1) submit(stream, frames - 1);
    });
  };
  submit(0, 3);
  submit(1, 2);
  submit(2, 1);
  gate.Open();
  done.get_future().wait();
  EXPECT_THAT(order, ElementsAre(0, 1, 2, 0, 1, 0));
}

}  // namespace
}  // namespace partiemc::server
