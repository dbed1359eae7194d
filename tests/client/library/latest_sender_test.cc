// LatestSender over a stream that accepts frames on request.
#include "partiemc/client/latest_sender.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "partiemc/client/local_stream.h"

namespace partiemc::client {
namespace {

using ::testing::ElementsAre;

// Send waits until the test releases it.
class GatedStream final : public FrameStream {
 public:
  const StreamInfo& info() const override { return info_; }
  absl::StatusOr<std::uint64_t> Send(const Frame& frame, double time) override {
    std::unique_lock lock(mutex_);
    ++arrived_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return allowed_ > 0 || cancelled_; });
    if (cancelled_) return absl::CancelledError("cancelled");
    --allowed_;
    const auto positions = std::get<std::span<const float>>(frame.positions);
    if (positions.empty()) {
      return ViolationError(absl::StatusCode::kInvalidArgument, {"EMPTY", "frame", "0", "rule"});
    }
    if (time < 0) return absl::UnavailableError("the stream has ended");
    taken.emplace_back(time, positions[0]);
    volumes.assign(frame.volumes.begin(), frame.volumes.end());
    return taken.size();
  }
  absl::StatusOr<std::uint64_t> SendArrays(const ParticleArrays&, double) override {
    return absl::UnimplementedError("a LatestSender sends its own copy");
  }
  absl::Status FinishSending() override {
    finished = true;
    return absl::OkStatus();
  }
  absl::StatusOr<Received> Receive(Event&, std::optional<std::chrono::milliseconds>) override {
    return Received::kEnd;
  }
  std::size_t InFlight() const override { return 0; }
  void Cancel() override {
    const std::scoped_lock lock(mutex_);
    cancelled_ = true;
    changed_.notify_all();
  }

  void Allow(int frames) {
    const std::scoped_lock lock(mutex_);
    allowed_ += frames;
    changed_.notify_all();
  }
  // Waits until `frames` frames have reached Send.
  void WaitForArrivals(int frames) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return arrived_ >= frames; });
  }

  std::vector<std::pair<double, float>> taken;  // Time, first coordinate.
  std::vector<float> volumes;                   // Volumes of the last frame.
  bool finished = false;

 private:
  StreamInfo info_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int allowed_ = 0, arrived_ = 0;
  bool cancelled_ = false;
};

// Offers frame `k`, whose arrays are freed when this returns.
absl::Status OfferFrame(LatestSender& sender, int k) {
  const std::vector<float> positions = {static_cast<float>(k), 0};
  const std::vector<float> volumes = {0.5f * static_cast<float>(k)};
  return sender.Offer({.positions = std::span<const float>(positions), .volumes = volumes}, k);
}

TEST(LatestSender, SendsTheNewestFrameAndReportsSkippedOnesInOrder) {
  GatedStream stream;
  std::string told;
  const auto tell = [&](char what) {
    return [&told, what](std::uint64_t offer) { (told += what) += std::to_string(offer); };
  };
  LatestSender sender(stream, {.sending = tell('+'), .skipped = tell('-')});
  ASSERT_TRUE(OfferFrame(sender, 1).ok());
  stream.WaitForArrivals(1);
  // The stream is busy, and the simulator continues.
  for (int k = 2; k <= 6; ++k) ASSERT_TRUE(OfferFrame(sender, k).ok());
  EXPECT_EQ(sender.counts().sent, 1u);
  EXPECT_EQ(sender.counts().skipped, 4u);
  stream.Allow(1);
  stream.WaitForArrivals(2);
  ASSERT_TRUE(OfferFrame(sender, 7).ok());
  stream.Allow(2);
  ASSERT_TRUE(sender.Finish().ok());
  EXPECT_TRUE(stream.finished);
  EXPECT_THAT(stream.taken,
              ElementsAre(std::pair(1.0, 1.f), std::pair(6.0, 6.f), std::pair(7.0, 7.f)));
  EXPECT_THAT(stream.volumes, ElementsAre(3.5f));
  EXPECT_EQ(told, "+1-2-3-4-5+6+7");
  EXPECT_EQ(sender.counts().sent, 3u);
  EXPECT_EQ(sender.counts().skipped, 4u);
}

TEST(LatestSender, SkipsNothingWhereTheStreamKeepsUp) {
  GatedStream stream;
  stream.Allow(1000);
  LatestSender sender(stream);
  for (int k = 1; k <= 20; ++k) {
    ASSERT_TRUE(OfferFrame(sender, k).ok());
    stream.WaitForArrivals(k);
  }
  ASSERT_TRUE(sender.Finish().ok());
  EXPECT_EQ(stream.taken.size(), 20u);
  EXPECT_EQ(sender.counts().skipped, 0u);
}

TEST(LatestSender, AFrameThatIsRefusedIsToldAndTheNextOneIsSent) {
  GatedStream stream;
  stream.Allow(2);
  std::vector<std::uint64_t> refused;
  LatestSender sender(stream, {.refused = [&](auto k, const auto&) { refused.push_back(k); }});
  ASSERT_TRUE(sender.Offer({}, 1).ok());
  stream.WaitForArrivals(1);
  ASSERT_TRUE(OfferFrame(sender, 2).ok());
  ASSERT_TRUE(sender.Finish().ok());
  EXPECT_THAT(refused, ElementsAre(1));
  EXPECT_EQ(sender.counts().refused, 1u);
  EXPECT_EQ(sender.counts().sent, 1u);
}

TEST(LatestSender, WhatEndsTheStreamIsToldByTheNextOfferAndByFinish) {
  GatedStream stream;
  stream.Allow(1);
  LatestSender sender(stream);
  ASSERT_TRUE(OfferFrame(sender, -1).ok());
  stream.WaitForArrivals(1);
  absl::Status status;
  while (status.ok()) {
    status = OfferFrame(sender, 1);
    std::this_thread::yield();
  }
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(sender.Finish().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(OfferFrame(sender, 2).code(), absl::StatusCode::kFailedPrecondition);
}

TEST(LatestSender, GoesAwayAlsoWhileTheStreamTakesNothing) {
  GatedStream stream;
  {
    LatestSender sender(stream);
    ASSERT_TRUE(OfferFrame(sender, 1).ok());
    stream.WaitForArrivals(1);
    ASSERT_TRUE(OfferFrame(sender, 2).ok());
  }
  EXPECT_TRUE(stream.taken.empty());
  EXPECT_FALSE(stream.finished);
}

// Over a real stream: every answer belongs to a sent frame, numbers have no gap, and each offer is
// sent, skipped or refused.
TEST(LatestSender, NumbersWhatItSendsWithoutAGap) {
  const auto stream = LocalStream::Open({.parameters = {.spacing = 1.0}, .threads = 1});
  ASSERT_TRUE(stream.ok());
  constexpr int kOffers = 200;
  std::vector<std::uint64_t> sent;
  LatestSender sender(**stream, {.sending = [&](auto offer) { sent.push_back(offer); }});
  auto received = std::async(std::launch::async, [&] {
    std::vector<double> times;
    Event event;
    while (*(*stream)->Receive(event) == Received::kEvent) {
      times.push_back(event.time);
      EXPECT_EQ(event.sequence, times.size());
    }
    return times;
  });
  std::vector<double> positions;
  for (int i = 0; i < 400; ++i) positions.insert(positions.end(), {i % 20 + 0.0, i / 20 + 0.0});
  for (int k = 1; k <= kOffers; ++k) {
    ASSERT_TRUE(sender.Offer({.positions = std::span<const double>(positions)}, k).ok());
  }
  ASSERT_TRUE(sender.Finish().ok());
  const std::vector<double> times = received.get();
  EXPECT_EQ(times, std::vector<double>(sent.begin(), sent.end()));
  EXPECT_EQ(times.back(), kOffers) << "the newest is always sent";
  EXPECT_EQ(sender.counts().sent + sender.counts().skipped, kOffers);
}

}  // namespace
}  // namespace partiemc::client
