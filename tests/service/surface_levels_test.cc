// Watchers of levels of detail through a server: a level is computed once for all that share it, is
// closed, and disturbs neither the producer nor exact watchers.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"
#include "partiemc/status.h"
#include "relay/nats_process.h"
#include "server/merging_balls.h"
#include "service/service_testing.h"
#include "support/shell_measures.h"

namespace partiemc::server {
namespace {

using client::Coordinates;
using client::Event;
using client::Received;
using client::WatchMode;

constexpr std::uint64_t kFrames = 14;

LevelOfDetail MaxError(double error) { return {.max_error = error, .max_triangles = {}}; }
LevelOfDetail MaxTriangles(std::uint64_t n) { return {.max_error = {}, .max_triangles = n}; }

class SurfaceLevels : public ::testing::Test {
 protected:
  // Opens the stream "balls".
  void Produce(Coordinates coordinates = Coordinates::kRelativeFloat32) {
    client::StreamOptions options{.name = "balls", .parameters = MergingBallsParameters()};
    options.outputs.normals = true;
    options.outputs.echo_particles = true;
    options.outputs.coordinates = coordinates;
    auto stream = client::Stream::Open(address_, options);
    ASSERT_TRUE(stream.ok()) << stream.status();
    producer_ = *std::move(stream);
  }
  // Sends the next frame and receives its result.
  void Step() {
    const std::uint64_t k = results_.size();
    ASSERT_TRUE(producer_->Send(MergingBalls(k).AsFrame(0), .1 * static_cast<double>(k)).ok());
    Event event;
    ASSERT_TRUE(producer_->Receive(event).ok());
    ASSERT_EQ(event.kind, Event::Kind::kResult) << event.message;
    results_.push_back(std::move(event.frame));
  }
  std::unique_ptr<client::Watcher> Watch(const client::WatcherOptions& options) const {
    auto watcher = client::Watcher::Open(address_, "balls", options);
    EXPECT_TRUE(watcher.ok()) << watcher.status();
    return watcher.ok() ? *std::move(watcher) : nullptr;
  }
  std::unique_ptr<client::Watcher> WatchLevel(const LevelOfDetail& level,
                                              WatchMode mode = WatchMode::kEvery) const {
    return Watch({.mode = mode, .level_of_detail = level});
  }
  static client::WatchedFrame Next(client::Watcher& watcher) {
    client::WatchedFrame frame;
    const auto received = watcher.Receive(frame, std::chrono::seconds(60));
    EXPECT_TRUE(received.ok() && *received == Received::kEvent) << received.status();
    return frame;
  }
  // Expects a level of the exact frame.
  void ExpectLevel(const client::WatchedFrame& frame, double error) const {
    ASSERT_TRUE(frame.level.has_value());
    EXPECT_EQ(frame.level->error, error);
    const client::FrameResult& exact = results_.at(frame.sequence - 1);
    Surface surface = frame.frame.result.surface;
    EXPECT_EQ(frame.level->digest, DigestSurface(surface));
    EXPECT_EQ(frame.frame.surface_digest, exact.surface_digest);
    EXPECT_EQ(frame.frame.section_digests, exact.section_digests);
    EXPECT_EQ(frame.frame.result.statistics, exact.result.statistics);
    EXPECT_EQ(surface.measures, exact.result.surface.measures);
    EXPECT_EQ(surface.parents, exact.result.surface.parents);
    EXPECT_LT(3 * surface.TriangleCount(), 2 * exact.result.surface.TriangleCount());
    EXPECT_EQ(surface.normals.size(), 3 * surface.PointCount());
    EXPECT_EQ(frame.particles, MergingBalls(frame.sequence - 1).positions);
    support::MeasureShells(surface);
    const absl::Status valid = Validate(surface);
    EXPECT_TRUE(valid.ok()) << valid;
  }
  double Metric(const std::string& name) const {
    const std::string metrics = Get(*server_->metrics_address(), "/metrics");
    const std::size_t at = metrics.find("\n" + name + " ");
    return at == std::string::npos ? -1 : std::stod(metrics.substr(at + name.size() + 2));
  }
  static ServerOptions Options() {
    ServerOptions options = TestOptions();
    options.metrics = Address{.host = "127.0.0.1", .port = 0, .unix_path = {}};
    options.limits.max_watchers = 20;
    return options;
  }

  const std::unique_ptr<Server> server_ = StartServer(Options());
  const std::string address_ = server_->address().ToString();
  std::unique_ptr<client::Stream> producer_;
  std::vector<client::FrameResult> results_;
};

TEST_F(SurfaceLevels, AreComputedOnceForAllWatchersThatShareThem) {
  Produce();
  const auto first = WatchLevel(MaxError(.1)), second = WatchLevel(MaxError(.1));
  const auto exact = Watch({.mode = WatchMode::kEvery});
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    Step();
    const client::WatchedFrame a = Next(*first), b = Next(*second), all = Next(*exact);
    ExpectLevel(a, .1);
    EXPECT_EQ(a.frame.result.surface, b.frame.result.surface);
    EXPECT_EQ(a.level, b.level);
    EXPECT_FALSE(all.level.has_value());
    EXPECT_EQ(all.frame.result.surface, results_.back().result.surface);
    EXPECT_EQ(all.frame.surface_digest, results_.back().surface_digest);
  }
  EXPECT_EQ(Metric("partiemc_levels_computed_total"), kFrames);
  EXPECT_EQ(Metric("partiemc_levels_shared_total"), kFrames);
  EXPECT_GT(Metric("partiemc_level_bytes"), 0);
  EXPECT_EQ(Metric("partiemc_levels_waiting"), 0);
}

TEST_F(SurfaceLevels, OfTheHistoryReachALateWatcher) {
  Produce(Coordinates::kCompact);
  for (std::uint64_t k = 0; k < kFrames; ++k) Step();
  const auto late =
      Watch({.mode = WatchMode::kLatest, .from_sequence = 1, .level_of_detail = MaxTriangles(300)});
  for (std::uint64_t k = 1; k <= kFrames; ++k) {
    const client::WatchedFrame frame = Next(*late);
    EXPECT_EQ(frame.sequence, k);
    EXPECT_EQ(frame.dropped, 0u);
    EXPECT_LE(frame.frame.result.surface.TriangleCount(), 300u);
    ExpectLevel(frame, frame.level.value_or(SurfaceLevel{}).error);
  }
  const auto newest = WatchLevel(MaxError(.2), WatchMode::kLatest);
  const client::WatchedFrame frame = Next(*newest);
  EXPECT_EQ(frame.sequence, kFrames);
  ExpectLevel(frame, .2);
}

TEST_F(SurfaceLevels, OfWatchersOfLatestMissNoFrameUncounted) {
  Produce();
  std::vector<std::unique_ptr<client::Watcher>> watchers;
  for (int k = 0; k < 8; ++k) {
    watchers.push_back(WatchLevel(MaxError(k % 2 == 0 ? .05 : .1), WatchMode::kLatest));
    Step();
    Step();
  }
  const std::uint64_t sent = results_.size();
  ASSERT_TRUE(producer_->FinishSending().ok());
  for (const auto& watcher : watchers) {
    client::WatchedFrame frame;
    std::uint64_t first = 0, received = 0, dropped = 0;
    for (auto got = watcher->Receive(frame); got.ok() && *got == Received::kEvent;
         got = watcher->Receive(frame)) {
      if (received++ == 0) first = frame.sequence;
      if (received > 1) dropped += frame.dropped;
      EXPECT_TRUE(frame.level.has_value());
    }
    EXPECT_EQ(watcher->end().reason, "FINISHED");
    dropped += watcher->end().dropped;
    EXPECT_EQ(first + received - 1 + dropped, sent);
    EXPECT_EQ(frame.sequence, sent) << "the newest frame is never skipped";
  }
  EXPECT_LE(Metric("partiemc_levels_computed_total"), 2 * static_cast<double>(sent));
}

TEST_F(SurfaceLevels, EndWithTheirWatchersAtAnyTime) {
  Produce();
  for (int round = 0; round < 10; ++round) {
    const auto leaves = WatchLevel(MaxError(.01 * (1 + round % 3)));
    const auto stays = WatchLevel(MaxError(.01 * (1 + round % 2)));
    Step();
    EXPECT_EQ(Next(*stays).level.has_value(), true);
  }
  EXPECT_TRUE(Eventually([&] {
    return Metric("partiemc_watchers") == 0 && Metric("partiemc_level_bytes") == 0 &&
           Metric("partiemc_levels_waiting") == 0;
  }));
  EXPECT_TRUE(Eventually([&] { return Metric("partiemc_memory_held_bytes") == 0; }));
}

TEST_F(SurfaceLevels, WithoutMemoryEndAWatchOfEveryFrame) {
  ServerOptions options = Options();
  options.limits.memory_budget = 1 << 20;
  const auto small = StartServer(options);
  client::StreamOptions stream{.name = "balls", .parameters = MergingBallsParameters()};
  const auto producer = client::Stream::Open(small->address().ToString(), stream);
  ASSERT_TRUE(producer.ok()) << producer.status();
  const auto watcher =
      client::Watcher::Open(small->address().ToString(), "balls",
                            {.mode = WatchMode::kEvery, .level_of_detail = MaxError(.1)});
  ASSERT_TRUE(watcher.ok()) << watcher.status();
  ASSERT_TRUE((*producer)->Send(MergingBalls(0).AsFrame(0), 0).ok());
  Event event;
  ASSERT_TRUE((*producer)->Receive(event).ok());
  EXPECT_EQ(event.kind, Event::Kind::kResult) << "the producer is served";
  client::WatchedFrame frame;
  const auto received = (*watcher)->Receive(frame);
  EXPECT_EQ(received.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ((*watcher)->end().reason, "MEMORY_BUDGET");
}

TEST_F(SurfaceLevels, OfAStreamOfAnotherReplicaAreRefused) {
  const NatsProcess nats;
  ServerOptions options = Options();
  options.nats = nats.url();
  const auto has = StartServer(options), shows = StartServer(options);
  const auto producer = client::Stream::Open(
      has->address().ToString(), {.name = "balls", .parameters = MergingBallsParameters()});
  ASSERT_TRUE(producer.ok()) << producer.status();
  const auto watch = [&](const Server& server, const std::optional<LevelOfDetail>& level) {
    return client::Watcher::Open(server.address().ToString(), "balls", {.level_of_detail = level})
        .status();
  };
  EXPECT_TRUE(Eventually([&] { return watch(*shows, std::nullopt).ok(); }));
  const absl::Status refused = watch(*shows, MaxError(.1));
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(watch(*has, MaxError(.1)).ok());
}

TEST_F(SurfaceLevels, DoNotDelayADrain) {
  Produce();
  const auto watcher = Watch({.mode = WatchMode::kEvery,
                              .level_of_detail = MaxTriangles(1),
                              .rejoin = {.give_up_after = std::chrono::milliseconds(0)}});
  for (int k = 0; k < 8; ++k) Step();
  server_->Drain(std::chrono::seconds(10));
  client::WatchedFrame frame;
  auto received = watcher->Receive(frame);
  while (received.ok() && *received == Received::kEvent) received = watcher->Receive(frame);
  EXPECT_FALSE(received.ok() && *received == Received::kNothingYet);
}

}  // namespace
}  // namespace partiemc::server
