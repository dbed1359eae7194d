// AsyncStream: answers by callbacks and futures.
#include "partiemc/client/async_stream.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <future>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "partiemc/client/local_stream.h"
#include "partiemc/partiemc.h"

namespace partiemc::client {
namespace {

using namespace std::chrono_literals;

const ReconstructionParameters kParameters{.spacing = 1.0};

std::vector<double> Lattice(int side) {
  std::vector<double> positions;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      positions.push_back(column);
      positions.push_back(row);
    }
  }
  return positions;
}

Frame FrameOf(const std::vector<double>& positions) {
  return {.positions = std::span<const double>(positions)};
}

std::unique_ptr<LocalStream> Open(const LocalStreamOptions& options = {.parameters = kParameters}) {
  auto stream = LocalStream::Open(options);
  EXPECT_TRUE(stream.ok()) << stream.status();
  return *std::move(stream);
}

TEST(AsyncStream, EachFutureGetsItsOwnAnswer) {
  const auto stream = Open();
  AsyncStream async(*stream);
  std::vector<std::future<AsyncStream::Answer>> answers;
  for (int side = 8; side < 20; ++side) answers.push_back(async.Send(FrameOf(Lattice(side)), side));
  EXPECT_TRUE(async.Finish().ok());
  double last = 0;
  for (auto& one : answers) {
    const auto answer = one.get();
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_GT(answer->result.statistics.area, last + 10);
    last = answer->result.statistics.area;
    EXPECT_EQ(answer->rings_digest, DigestRings(answer->result.rings));
  }
}

TEST(AsyncStream, CallbacksComeInTheOrderOfTheFrames) {
  const auto stream = Open();
  AsyncStream async(*stream);
  const auto positions = Lattice(8);
  std::vector<int> order;
  for (int k = 0; k < 20; ++k) {
    async.Send(FrameOf(positions), k, [&order, k](const AsyncStream::Answer& answer) {
      EXPECT_TRUE(answer.ok());
      order.push_back(k);
    });
  }
  EXPECT_TRUE(async.Finish().ok());
  ASSERT_EQ(order.size(), 20);
  for (int k = 0; k < 20; ++k) EXPECT_EQ(order[static_cast<std::size_t>(k)], k);
}

TEST(AsyncStream, ARefusedFrameIsToldWhyAndTheNextIsAnswered) {
  const auto stream = Open();
  AsyncStream async(*stream);
  auto positions = Lattice(8);
  const auto good = positions;
  positions[5] = std::numeric_limits<double>::quiet_NaN();
  auto refused = async.Send(FrameOf(positions), 0);
  auto taken = async.Send(FrameOf(good), 1);
  // Refused before it is sent: y is missing.
  const std::vector<double> x(4);
  auto incomplete = async.SendArrays({.count = 4, .x = x.data()}, 2);
  const auto answer = refused.get();
  ASSERT_TRUE(FindViolation(answer.status())) << answer.status();
  EXPECT_EQ(FindViolation(answer.status())->field, "positions[2].y");
  EXPECT_TRUE(taken.get().ok());
  const auto why = incomplete.get();
  ASSERT_TRUE(FindViolation(why.status())) << why.status();
  EXPECT_EQ(FindViolation(why.status())->reason, "COUNT");
  EXPECT_TRUE(async.Finish().ok());
}

TEST(AsyncStream, WhatIsUnansweredAtTheEndGetsTheEnd) {
  const auto positions = Lattice(200);
  std::atomic<int> answered = 0;
  {
    const auto stream = Open({.parameters = kParameters, .frames_in_flight = 4});
    AsyncStream async(*stream);
    for (int k = 0; k < 4; ++k) {
      async.Send(FrameOf(positions), k, [&](const AsyncStream::Answer&) { ++answered; });
    }
    stream->Cancel();
    auto late = async.Send(FrameOf(positions), 5);
    EXPECT_EQ(late.get().status().code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(async.Finish().code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(async.Finish().code(), absl::StatusCode::kFailedPrecondition);
  }
  EXPECT_EQ(answered, 4);
}

TEST(AsyncStream, GoesAwayWithItsAnswersOutstanding) {
  const auto positions = Lattice(100);
  const auto stream = Open({.parameters = kParameters, .frames_in_flight = 8});
  std::vector<std::future<AsyncStream::Answer>> answers;
  {
    AsyncStream async(*stream);
    for (int k = 0; k < 8; ++k) answers.push_back(async.Send(FrameOf(positions), k));
  }
  for (auto& one : answers) {
    ASSERT_EQ(one.wait_for(0s), std::future_status::ready);
    const auto answer = one.get();
    EXPECT_TRUE(answer.ok() || answer.status().code() == absl::StatusCode::kCancelled);
  }
}

TEST(SendTimeout, RefusesTheFrameAndTheStreamGoesOn) {
  const auto stream =
      Open({.parameters = kParameters, .frames_in_flight = 1, .send_timeout = 20ms});
  const auto positions = Lattice(8);
  ASSERT_TRUE(stream->Send(FrameOf(positions), 0).ok());
  const auto refused = stream->Send(FrameOf(positions), 1);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kDeadlineExceeded);
  ASSERT_TRUE(FindViolation(refused.status()));
  EXPECT_EQ(FindViolation(refused.status())->reason, "SEND_TIMEOUT");
  Event event;
  ASSERT_TRUE(stream->Receive(event).ok());
  const auto sent = stream->Send(FrameOf(positions), 2);
  ASSERT_TRUE(sent.ok()) << sent.status();
  EXPECT_EQ(*sent, 2);
}

}  // namespace
}  // namespace partiemc::client
