// Watchers of levels of detail through a server: a level is computed once for all that share it, is
// closed, and disturbs neither the producer nor exact watchers.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "relay/forging_peer.h"
#include "relay/nats_process.h"
#include "server/merging_balls.h"
#include "service/service_testing.h"
#include "support/shell_measures.h"
#include "wire/codec.h"
#include "wire/surface_level.h"

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
  double Metric(const std::string& name) const { return MetricOf(*server_, name); }
  static double MetricOf(const Server& server, const std::string& name) {
    const std::string metrics = Get(*server.metrics_address(), "/metrics");
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

// A server beside the one of the fixture, and the bus between them.
class LevelsElsewhere : public SurfaceLevels {
 protected:
  static ServerOptions OptionsOn(const NatsProcess& nats) {
    ServerOptions options = Options();
    options.nats = nats.url();
    return options;
  }
  static v1::WatchStreamRequest RequestOf(const std::string& stream, const LevelOfDetail& level) {
    v1::WatchStreamRequest request;
    request.mutable_open()->set_stream_name(stream);
    request.mutable_open()->set_mode(v1::WATCH_MODE_EVERY);
    request.mutable_open()->set_credits(100);
    request.mutable_open()->set_from_sequence(1);
    wire::EncodeLevelOfDetail(level, *request.mutable_open()->mutable_level_of_detail());
    return request;
  }
  // The bytes of the frames of a watch with a level.
  static std::vector<std::string> BytesOf(WatchClient& watcher, std::uint64_t frames) {
    std::vector<std::string> bytes;
    EXPECT_TRUE(watcher.Receive().has_opened());
    for (std::uint64_t k = 0; k < frames; ++k) {
      bytes.push_back(watcher.Receive().frame().frame().SerializeAsString());
    }
    return bytes;
  }
  // The watch of a level of the stream "forged" ends with INVALID_RESULT. Returns the message.
  static std::string ExpectInvalid(const std::shared_ptr<grpc::Channel>& channel,
                                   std::uint64_t from_sequence) {
    WatchClient watcher(channel);
    v1::WatchStreamRequest request = RequestOf("forged", MaxError(.1));
    request.mutable_open()->set_from_sequence(from_sequence);
    watcher.Send(request);
    EXPECT_TRUE(watcher.Receive().has_opened());
    const grpc::Status status = watcher.Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::DATA_LOSS) << status.error_message();
    EXPECT_EQ(watcher.reason(), "INVALID_RESULT") << status.error_message();
    return status.error_message();
  }
  static bool IsFound(const Server& server, const std::string& stream) {
    return client::Watcher::Open(server.address().ToString(), stream, {}).ok();
  }

  const NatsProcess nats_;
  const std::unique_ptr<Server> has_ = StartServer(OptionsOn(nats_));
  const std::unique_ptr<Server> shows_ = StartServer(OptionsOn(nats_));
};

TEST_F(LevelsElsewhere, HaveTheBytesOfTheOwnersLevels) {
  for (const Coordinates coordinates :
       {Coordinates::kFloat64, Coordinates::kRelativeFloat32, Coordinates::kCompact}) {
    const std::string name = "balls" + std::to_string(static_cast<int>(coordinates));
    client::StreamOptions options{.name = name, .parameters = MergingBallsParameters()};
    options.outputs.normals = true;
    options.outputs.echo_particles = true;
    options.outputs.coordinates = coordinates;
    const auto producer = client::Stream::Open(has_->address().ToString(), options);
    ASSERT_TRUE(producer.ok()) << producer.status();
    constexpr std::uint64_t kSent = 4;
    for (std::uint64_t k = 0; k < kSent; ++k) {
      ASSERT_TRUE((*producer)->Send(MergingBalls(k).AsFrame(0), static_cast<double>(k)).ok());
      Event event;
      ASSERT_TRUE((*producer)->Receive(event).ok());
    }
    ASSERT_TRUE(Eventually([&] { return IsFound(*shows_, name); }));
    for (const LevelOfDetail& level : {MaxError(.1), MaxTriangles(300)}) {
      const double computed = MetricOf(*shows_, "partiemc_levels_computed_total");
      const double shared = MetricOf(*shows_, "partiemc_levels_shared_total");
      std::vector<std::string> bytes[3];
      std::unique_ptr<WatchClient> watchers[3];
      for (int k = 0; k < 3; ++k) {
        watchers[k] =
            std::make_unique<WatchClient>(Connect(k == 0 ? *has_ : *shows_, Transport::kTcp));
        watchers[k]->Send(RequestOf(name, level));
        bytes[k] = BytesOf(*watchers[k], kSent);
      }
      v1::ReconstructedFrame frame;
      ASSERT_TRUE(frame.ParseFromString(bytes[0].back()));
      EXPECT_GT(frame.surface().level().error(), 0);
      EXPECT_GT(frame.particles().size(), 0u);
      EXPECT_EQ(bytes[1], bytes[0]);
      EXPECT_EQ(bytes[2], bytes[0]);
      EXPECT_EQ(MetricOf(*shows_, "partiemc_levels_computed_total") - computed, kSent);
      EXPECT_EQ(MetricOf(*shows_, "partiemc_levels_shared_total") - shared, kSent);
    }
  }
}

TEST_F(LevelsElsewhere, OfOutlinesAreRefused) {
  const auto producer = client::Stream::Open(has_->address().ToString(), {.name = "outlines"});
  ASSERT_TRUE(producer.ok()) << producer.status();
  ASSERT_TRUE(Eventually([&] { return IsFound(*shows_, "outlines"); }));
  WatchClient watcher(Connect(*shows_, Transport::kTcp));
  watcher.Send(RequestOf("outlines", MaxError(.1)));
  EXPECT_EQ(watcher.Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(watcher.reason(), "UNSUPPORTED");
}

// What a peer may send instead of a valid surface. Each change breaks the message of a valid one.
struct Forgery {
  const char* name;
  std::function<void(v1::ReconstructedFrame& frame)> forge;
};

// The first of the merging balls' results.
Result ReconstructBalls() {
  const auto reconstructor = Reconstructor::Create(MergingBallsParameters());
  const SpaceParticles balls = MergingBalls(0);
  State state;
  Workspace workspace;
  Result result;
  EXPECT_TRUE(reconstructor->Reconstruct(balls.AsFrame(0), state, workspace, result).ok());
  return result;
}

std::uint32_t& Index(std::string& array, std::size_t at) {
  return reinterpret_cast<std::uint32_t*>(array.data())[at];
}
double& Coordinate(v1::Surface& surface, std::size_t at) {
  return reinterpret_cast<double*>(surface.mutable_points()->data())[at];
}

const std::vector<Forgery>& Forgeries() {
  static const auto* const kForgeries = new std::vector<Forgery>{
      {"an index beyond the points",
       [](auto& frame) { Index(*frame.mutable_surface()->mutable_triangles(), 5) = 1 << 30; }},
      {"a triangle twice",
       [](auto& frame) {
         std::string& triangles = *frame.mutable_surface()->mutable_triangles();
         triangles.replace(12, 12, triangles.substr(0, 12));
       }},
      {"a hole",
       [](auto& frame) {
         std::string& triangles = *frame.mutable_surface()->mutable_triangles();
         triangles.resize(triangles.size() - 12);
         --Index(*frame.mutable_surface()->mutable_triangle_offsets(),
                 frame.surface().triangle_offsets().size() / 4 - 1);
       }},
      {"a triangle with a point twice",
       [](auto& frame) {
         std::string& triangles = *frame.mutable_surface()->mutable_triangles();
         Index(triangles, 1) = Index(triangles, 0);
       }},
      {"a triangle turned over",
       [](auto& frame) {
         std::string& triangles = *frame.mutable_surface()->mutable_triangles();
         std::swap(Index(triangles, 1), Index(triangles, 0));
       }},
      {"a coordinate that is no number",
       [](auto& frame) { Coordinate(*frame.mutable_surface(), 7) = std::nan(""); }},
      {"a coordinate that is too large",
       [](auto& frame) { Coordinate(*frame.mutable_surface(), 7) = 1e300; }},
      {"more points than bytes",
       [](auto& frame) {
         std::string& offsets = *frame.mutable_surface()->mutable_point_offsets();
         Index(offsets, offsets.size() / 4 - 1) = 0xffffffff;
       }},
      {"no spacing", [](auto& frame) { frame.mutable_statistics()->set_spacing(0); }},
      {"a tiny spacing", [](auto& frame) { frame.mutable_statistics()->set_spacing(1e-70); }},
      {"measures of no shell",
       [](auto& frame) {
         for (int k = 0; k < 1000; ++k) frame.mutable_surface()->add_measures();
       }},
  };
  return *kForgeries;
}

TEST_F(LevelsElsewhere, OfForgedSurfacesAreRefusedAndOthersServed) {
  const std::string address = shows_->address().ToString();
  client::StreamOptions options{.name = "honest", .parameters = MergingBallsParameters()};
  const auto producer = client::Stream::Open(has_->address().ToString(), options);
  ASSERT_TRUE(producer.ok()) << producer.status();
  ForgingPeer peer(nats_.url(), "forged");
  peer.Publish("no message");
  ASSERT_TRUE(Eventually([&] { return IsFound(*shows_, "forged"); }));
  ASSERT_TRUE(Eventually([&] { return IsFound(*shows_, "honest"); }));
  WatchClient honest(Connect(*shows_, Transport::kTcp)), exact(Connect(*shows_, Transport::kTcp));
  honest.Send(RequestOf("honest", MaxError(.1)));
  ASSERT_TRUE(honest.Receive().has_opened());
  exact.Open("forged", v1::WATCH_MODE_EVERY, 100, 2);
  ASSERT_TRUE(exact.Receive().has_opened());
  std::uint64_t sent = 1;
  EXPECT_NE(ExpectInvalid(Connect(*shows_, Transport::kTcp), sent).find("cannot be parsed"),
            std::string::npos);

  v1::ReconstructedFrame valid;
  ASSERT_TRUE(wire::EncodeResult(ReconstructBalls(), {}, {.normals = true}, valid).ok());
  for (const Forgery& forgery : Forgeries()) {
    SCOPED_TRACE(forgery.name);
    v1::ReconstructedFrame forged = valid;
    forgery.forge(forged);
    forged.set_sequence(++sent);
    peer.Publish(forged.SerializeAsString());
    EXPECT_EQ(exact.Receive().frame().frame().sequence(), sent) << "exact results are not checked";
    std::printf("%s: %s\n", forgery.name,
                ExpectInvalid(Connect(*shows_, Transport::kTcp), sent).c_str());
    ASSERT_TRUE((*producer)->Send(MergingBalls(0).AsFrame(0), static_cast<double>(sent)).ok());
    Event event;
    ASSERT_TRUE((*producer)->Receive(event).ok());
    EXPECT_GT(honest.Receive().frame().frame().surface().level().error(), 0);
  }
  // Rounding can make self-intersections, so they are no fault.
  Coordinate(*valid.mutable_surface(), 0) += 3;
  valid.set_sequence(++sent);
  peer.Publish(valid.SerializeAsString());
  WatchClient level(Connect(*shows_, Transport::kTcp));
  v1::WatchStreamRequest request = RequestOf("forged", MaxError(.1));
  request.mutable_open()->set_from_sequence(sent);
  level.Send(request);
  EXPECT_TRUE(level.Receive().has_opened());
  EXPECT_GT(level.Receive().frame().frame().surface().level().error(), 0);
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
