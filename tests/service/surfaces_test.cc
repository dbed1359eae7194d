// Surfaces through a server: the same bits for the producer, for ranks, for watchers and for a
// single call as in this process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/client/local_stream.h"
#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"
#include "partiemc/status.h"
#include "server/merging_balls.h"
#include "server/moving_blob.h"
#include "service/service_testing.h"
#include "wire/codec.h"

namespace partiemc::server {
namespace {

using client::Coordinates;
using client::Event;
using client::FrameStream;
using client::Received;

constexpr std::uint64_t kFrames = 14;

// The results of the first frames in this process.
std::vector<Result> LocalResults() {
  const auto stream = client::LocalStream::Open({.parameters = MergingBallsParameters()});
  EXPECT_TRUE(stream.ok()) << stream.status();
  std::vector<Result> results;
  Event event;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    EXPECT_TRUE((*stream)->Send(MergingBalls(k).AsFrame(0), .1 * static_cast<double>(k)).ok());
    EXPECT_TRUE((*stream)->Receive(event).ok());
    EXPECT_EQ(event.kind, Event::Kind::kResult) << event.message;
    results.push_back(event.frame.result);
  }
  EXPECT_EQ(results.front().surface.ShellCount(), 2u);
  EXPECT_EQ(results.back().surface.ShellCount(), 1u);
  EXPECT_EQ(results.back().sections.size(), 1u);
  return results;
}

class Surfaces : public ::testing::Test {
 protected:
  client::StreamOptions Options() const {
    client::StreamOptions options{.name = "balls", .parameters = MergingBallsParameters()};
    options.outputs.normals = true;
    return options;
  }
  std::unique_ptr<client::Stream> Open(const client::StreamOptions& options) const {
    auto stream = client::Stream::Open(address_, options);
    EXPECT_TRUE(stream.ok()) << stream.status();
    return stream.ok() ? *std::move(stream) : nullptr;
  }
  // Sends frame `k` and receives its result.
  static Result ResultOf(FrameStream& stream, std::uint64_t k) {
    EXPECT_TRUE(stream.Send(MergingBalls(k).AsFrame(0), .1 * static_cast<double>(k)).ok());
    Event event;
    EXPECT_TRUE(stream.Receive(event).ok());
    EXPECT_EQ(event.kind, Event::Kind::kResult) << event.message;
    EXPECT_EQ(event.frame.surface_digest, DigestSurface(event.frame.result.surface));
    EXPECT_EQ(event.frame.section_digests, DigestSections(event.frame.result));
    return event.frame.result;
  }

  const std::unique_ptr<Server> server_ = StartServer(TestOptions());
  const std::string address_ = server_->address().ToString();
  const std::vector<Result> expected_ = LocalResults();
};

// Outlines of sections have normals only if they were requested, so only geometry is compared.
void ExpectEqual(const Result& result, const Result& expected) {
  EXPECT_EQ(result.surface, expected.surface);
  EXPECT_EQ(result.statistics, expected.statistics);
  EXPECT_EQ(DigestSections(result), DigestSections(expected));
}

TEST_F(Surfaces, OfAStreamAreThoseOfThisProcess) {
  const auto stream = Open(Options());
  ASSERT_NE(stream, nullptr);
  EXPECT_EQ(stream->info().parameters.output, Output::kSurface);
  EXPECT_EQ(stream->info().parameters.surface, SurfaceOptions{});
  for (std::uint64_t k = 0; k < kFrames; ++k) ExpectEqual(ResultOf(*stream, k), expected_[k]);
}

// Streams share the workers of the server, and each worker keeps its last result.
TEST_F(Surfaces, WithAttributesChangeNoOutlineOfAnotherStream) {
  auto options = Options();
  options.outputs.attributes = {"height"};
  const auto surfaces = Open(options);
  const auto outlines =
      Open({.name = "blob", .parameters = BlobParameters(), .outputs = {.mesh = true}});
  ASSERT_TRUE(surfaces != nullptr && outlines != nullptr);
  Event event;
  for (std::uint64_t k = 0; k < 8; ++k) {
    const SpaceParticles balls = MergingBalls(k);
    const std::vector<float> heights(balls.ids.size(), 1);
    const std::vector<Attribute> attributes = {{"height", 1, heights}};
    Frame frame = balls.AsFrame(0);
    frame.attributes = attributes;
    ASSERT_TRUE(surfaces->Send(frame, 0).ok());
    ASSERT_TRUE(surfaces->Receive(event).ok());
    ASSERT_EQ(event.kind, Event::Kind::kResult) << event.message;
    EXPECT_EQ(event.frame.result.surface.attributes.size(), 1u);
    const std::vector<double> blob = MovingBlob(1, k);
    ASSERT_TRUE(outlines->Send({.positions = std::span<const double>(blob)}, 0).ok());
    ASSERT_TRUE(outlines->Receive(event).ok());
    ASSERT_EQ(event.kind, Event::Kind::kResult) << event.message;
    const Result& result = event.frame.result;
    EXPECT_GT(result.rings.PointCount(), 0u) << k;
    EXPECT_EQ(event.frame.rings_digest, DigestRings(result.rings));
    EXPECT_EQ(event.frame.mesh_digest, DigestMesh(result.mesh));
  }
}

// A frame that has begun cannot wait for memory, so it would be refused because of other streams.
TEST(SurfacesTogether, WaitForTheirMemoryInsteadOfBeingRefused) {
  ServerOptions options = TestOptions();
  options.threads = 2;
  options.limits.memory_budget = std::uint64_t{24} << 20;
  options.limits.frame.max_particles = 100'000;
  options.limits.max_frame_bytes = 3'000'000;
  const auto server = StartServer(options);
  std::vector<double> ball;
  constexpr int kRadius = 24;
  for (int x = -kRadius; x <= kRadius; ++x) {
    for (int y = -kRadius; y <= kRadius; ++y) {
      for (int z = -kRadius; z <= kRadius; ++z) {
        if (x * x + y * y + z * z > kRadius * kRadius) continue;
        ball.insert(ball.end(), {1.0 * x, 1.0 * y, 1.0 * z});
      }
    }
  }
  std::vector<std::thread> clients;
  for (int k = 0; k < 4; ++k) {
    clients.emplace_back([&] {
      const auto stream = client::Stream::Open(
          server->address().ToString(), {.parameters = {.output = Output::kSurface, .spacing = 1}});
      ASSERT_TRUE(stream.ok()) << stream.status();
      Event event;
      for (int frame = 0; frame < 3; ++frame) {
        const auto sent =
            (*stream)->Send({.positions = std::span<const double>(ball), .components = 3}, frame);
        ASSERT_TRUE(sent.ok()) << sent.status();
        ASSERT_TRUE((*stream)->Receive(event).ok());
        EXPECT_EQ(event.kind, Event::Kind::kResult) << event.message;
      }
    });
  }
  for (std::thread& client : clients) client.join();
}

TEST_F(Surfaces, OfASingleCallAreThoseOfAFirstFrame) {
  v1::ReconstructFrameRequest request;
  wire::EncodeParameters(MergingBallsParameters(), *request.mutable_parameters());
  wire::EncodeFrame(MergingBalls(3).AsFrame(0), *request.mutable_frame());
  wire::EncodeOutputs({.normals = true}, *request.mutable_outputs());
  v1::ReconstructFrameResponse response;
  TimedContext context;
  const auto stub = v1::ReconstructionService::NewStub(Connect(*server_, Transport::kTcp));
  const grpc::Status status = stub->ReconstructFrame(&context, request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.parameters().output(), v1::OUTPUT_SURFACE);
  wire::ReconstructedFrame frame;
  ASSERT_TRUE(wire::DecodeResult(response.frame(), frame).ok());
  const auto alone = client::LocalStream::Open({.parameters = MergingBallsParameters()});
  ASSERT_TRUE(alone.ok());
  ExpectEqual(frame.result, ResultOf(**alone, 3));
}

TEST_F(Surfaces, OfPartsAreThoseOfWholeFrames) {
  for (const std::uint32_t parts : {1u, 4u, 16u}) {
    SCOPED_TRACE(parts);
    std::vector<std::unique_ptr<client::Stream>> ranks;
    for (std::uint32_t part = 0; part < parts; ++part) {
      client::StreamOptions options = Options();
      options.parts = {.parts = parts, .part = part, .token = "of this job"};
      ranks.push_back(Open(options));
      ASSERT_NE(ranks.back(), nullptr);
    }
    for (std::uint64_t k = 0; k < kFrames; ++k) {
      const SpaceParticles whole = MergingBalls(k);
      for (std::uint32_t part = 0; part < parts; ++part) {
        SpaceParticles share;
        for (std::size_t i = part; i < whole.ids.size(); i += parts) {
          share.ids.push_back(whole.ids[i]);
          const auto at = whole.positions.begin() + static_cast<std::ptrdiff_t>(3 * i);
          share.positions.insert(share.positions.end(), at, at + 3);
        }
        ASSERT_TRUE(ranks[part]->Send(share.AsFrame(0), .1 * static_cast<double>(k)).ok());
      }
      Event event;
      for (std::uint32_t part = 0; part < parts; ++part) {
        ASSERT_TRUE(ranks[part]->Receive(event).ok());
        if (part > 0) {
          EXPECT_EQ(event.kind, Event::Kind::kPartTaken);
        } else {
          ExpectEqual(event.frame.result, expected_[k]);
        }
      }
    }
    // Part 0 ends last, so that the name is free afterwards.
    for (std::uint32_t part = parts; part-- > 0;) {
      EXPECT_TRUE(ranks[part]->FinishSending().ok());
      Event event;
      EXPECT_EQ(*ranks[part]->Receive(event), Received::kEnd);
    }
  }
}

TEST_F(Surfaces, OfALateWatcherAreThoseOfTheProducer) {
  client::StreamOptions options = Options();
  options.outputs.echo_particles = true;
  const auto stream = Open(options);
  ASSERT_NE(stream, nullptr);
  for (std::uint64_t k = 0; k < kFrames; ++k) ResultOf(*stream, k);
  const auto watcher = client::Watcher::Open(
      address_, "balls", {.mode = client::WatchMode::kEvery, .from_sequence = 1});
  ASSERT_TRUE(watcher.ok()) << watcher.status();
  EXPECT_EQ((*watcher)->stream().parameters.output, Output::kSurface);
  client::WatchedFrame frame;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    ASSERT_TRUE((*watcher)->Receive(frame).ok());
    EXPECT_EQ(frame.sequence, k + 1);
    ExpectEqual(frame.frame.result, expected_[k]);
    EXPECT_EQ(frame.frame.surface_digest, DigestSurface(expected_[k].surface));
    EXPECT_EQ(frame.particles, MergingBalls(k).positions) << "three coordinates of each particle";
    EXPECT_EQ(frame.particle_ids, MergingBalls(k).ids);
  }
}

TEST_F(Surfaces, InCompactCoordinatesHaveTheSameShells) {
  client::StreamOptions options = Options();
  options.outputs.coordinates = Coordinates::kCompact;
  const auto stream = Open(options);
  ASSERT_NE(stream, nullptr);
  Event event;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    ASSERT_TRUE(stream->Send(MergingBalls(k).AsFrame(0), .1 * static_cast<double>(k)).ok());
    ASSERT_TRUE(stream->Receive(event).ok());
    const Surface &received = event.frame.result.surface, &made = expected_[k].surface;
    EXPECT_EQ(event.frame.surface_digest, DigestSurface(made));
    EXPECT_EQ(received.measures, made.measures);
    EXPECT_EQ(received.parents, made.parents);
    EXPECT_EQ(received.TriangleCount(), made.TriangleCount());
    EXPECT_EQ(event.frame.section_digests, DigestSections(expected_[k]));
  }
}

TEST_F(Surfaces, AreRefusedWithTheFieldAndTheRule) {
  const auto refused = [&](const std::string& field,
                           const std::function<void(ReconstructionParameters&)>& change) {
    v1::ReconstructRequest request = OpenRequest("balls");
    ReconstructionParameters parameters = MergingBallsParameters();
    change(parameters);
    wire::EncodeParameters(parameters, *request.mutable_open()->mutable_parameters());
    StreamClient client(Connect(*server_, Transport::kTcp));
    EXPECT_FALSE(client.SendAndReceive(request).has_opened());
    const grpc::Status status = client.Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), ::testing::HasSubstr(field));
  };
  refused("parameters.spacing", [](auto& p) { p.spacing.reset(); });
  refused("parameters.slice", [](auto& p) { p.slice = SlicePlane{}; });
  refused("parameters.isovalue", [](auto& p) { p.isovalue = .5; });
  refused("parameters.placement", [](auto& p) { p.placement = Placement::kFarthestParticle; });
  refused("parameters.sections[0].slice", [](auto& p) { p.sections[0].slice.reset(); });
  refused("parameters.surface.simplify", [](auto& p) { p.surface.simplify = 2; });
  refused("parameters.surface.thinning_distance",
          [](auto& p) { p.surface.thinning_distance = -1; });

  const auto stream = Open(Options());
  ASSERT_NE(stream, nullptr);
  const std::vector<double> flat = {0, 0, 1, 0};
  ASSERT_TRUE(stream->Send({.positions = std::span<const double>(flat)}, 0).ok());
  Event event;
  ASSERT_TRUE(stream->Receive(event).ok());
  EXPECT_EQ(event.kind, Event::Kind::kRefusal);
  EXPECT_EQ(event.violation.field, "components");
  ExpectEqual(ResultOf(*stream, 0), expected_[0]);  // The stream continues.
}

}  // namespace
}  // namespace partiemc::server
