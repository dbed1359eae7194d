// Streams over gRPC, in process and over a port: results, frame errors, cancellation, concurrency.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "server/calls/stream_messages.h"
#include "server/moving_blob.h"
#include "server/stream/session.h"
#include "service/service_testing.h"
#include "wire/codec.h"

namespace partiemc::server {
namespace {

class Streams : public ::testing::TestWithParam<Transport> {
 protected:
  std::unique_ptr<Server> server_ = StartServer(TestOptions());
  std::shared_ptr<grpc::Channel> channel_ = Connect(*server_, GetParam());
};

INSTANTIATE_TEST_SUITE_P(Over, Streams, ::testing::Values(Transport::kInProcess, Transport::kTcp),
                         [](const auto& test) { return TransportName(test.param); });

TEST_P(Streams, OpeningTellsTheParametersAsResolvedTheWindowAndTheLimits) {
  StreamClient client(channel_);
  const auto answer = client.SendAndReceive(OpenRequest("tank"));
  ASSERT_TRUE(answer.has_opened());
  const v1::StreamOpened& opened = answer.opened();
  EXPECT_FALSE(opened.stream_id().empty());
  EXPECT_EQ(opened.parameters().placement(), v1::PLACEMENT_VIRTUAL_PLANE);
  EXPECT_TRUE(opened.parameters().has_reference_radius());
  EXPECT_EQ(opened.parameters().spacing(), kBlobSpacing);
  EXPECT_EQ(opened.frames_in_flight(), 4u);
  EXPECT_EQ(opened.limits().max_particles_per_frame(), 20'000u);
  EXPECT_EQ(opened.limits().max_frame_bytes(), 1'000'000u);
  EXPECT_EQ(opened.limits().max_streams(), 24u);
  EXPECT_EQ(opened.next_sequence(), 1u);
  client.HalfClose();
  EXPECT_TRUE(client.Finish().ok());
}

TEST_P(Streams, GiveTheResultsOfTheCoreInThisProcessBitForBit) {
  EXPECT_EQ(StreamedDigests(channel_, 1, 10), LocalDigests(1, 10));
}

TEST_P(Streams, AnAnswerIsAWholeAndValidResultWhoseDigestsAreItsOwn) {
  StreamClient client(channel_);
  client.SendAndReceive(OpenRequest());
  const auto answer = client.SendAndReceive(BlobRequest(1, 2, 8));
  ASSERT_TRUE(answer.has_frame());
  wire::ReconstructedFrame frame;
  ASSERT_TRUE(wire::DecodeResult(answer.frame(), frame).ok());
  EXPECT_EQ(frame.time, 2.0);
  EXPECT_TRUE(Validate(frame.result).ok()) << Validate(frame.result);
  EXPECT_EQ(DigestRings(frame.result.rings), frame.rings_digest);
  EXPECT_EQ(DigestMesh(frame.result.mesh), frame.mesh_digest);
  EXPECT_GE(frame.result.rings.RingCount(), 2u);
  EXPECT_GT(frame.times.total_ms, 0);
}

TEST_P(Streams, AttributesComeAsTheCoreMakesThem) {
  const std::vector<double> positions = MovingBlob(3, 0);
  std::vector<float> pressure, velocities;
  for (std::size_t k = 0; k < positions.size() / 2; ++k) {
    pressure.push_back(static_cast<float>(positions[2 * k] - 3 * positions[2 * k + 1]));
    velocities.push_back(static_cast<float>(k % 7));
    velocities.push_back(static_cast<float>(k % 5));
  }
  const std::vector<Attribute> attributes = {{"velocity", 2, velocities},
                                             {"pressure", 1, pressure}};
  auto open = OpenRequest();
  v1::Outputs& outputs = *open.mutable_open()->mutable_outputs();
  outputs.set_rings(true);
  outputs.add_attributes("velocity");
  outputs.add_attributes("pressure");
  for (const bool with_mesh : {true, false}) {
    SCOPED_TRACE(with_mesh);
    outputs.set_mesh(with_mesh);
    StreamClient client(channel_);
    ASSERT_TRUE(client.SendAndReceive(open).has_opened());
    v1::ReconstructRequest request;
    wire::EncodeFrame({.positions = positions,
                       .velocities = velocities,
                       .attributes = std::span(attributes).last(1)},
                      *request.mutable_frame());
    request.mutable_frame()->set_sequence(1);
    const auto answer = client.SendAndReceive(request);
    ASSERT_TRUE(answer.has_frame()) << answer.ShortDebugString().substr(0, 200);
    wire::ReconstructedFrame frame;
    ASSERT_TRUE(wire::DecodeResult(answer.frame(), frame).ok());

    const auto parameters = wire::DecodeParameters(open.open().parameters());
    const auto reconstructor = Reconstructor::Create(*parameters);
    State state;
    Workspace workspace;
    Result expected;
    ASSERT_TRUE(
        reconstructor
            ->Reconstruct(
                {.positions = positions, .velocities = velocities, .attributes = attributes}, state,
                workspace, expected)
            .ok());
    ASSERT_EQ(frame.result.attributes.size(), 2u);
    for (std::size_t k = 0; k < 2; ++k) {
      const AttributeValues& got = frame.result.attributes[k];
      AttributeValues& wanted = expected.attributes[k];
      if (!with_mesh) wanted.values.resize(expected.rings.PointCount() * wanted.components);
      EXPECT_EQ(got, wanted);
      EXPECT_FALSE(got.values.empty());
    }
  }
}

TEST_P(Streams, TooCoarseRelativeCoordinatesRefuseTheFrame) {
  StreamClient client(channel_);
  auto open = OpenRequest();
  open.mutable_open()->mutable_outputs()->set_rings(true);
  open.mutable_open()->mutable_outputs()->set_coordinate_format(
      v1::COORDINATE_FORMAT_FLOAT32_RELATIVE);
  ASSERT_TRUE(client.SendAndReceive(open).has_opened());
  const auto expected = LocalDigests(3, 2);
  EXPECT_EQ(client.SendAndReceive(BlobRequest(1, 3, 0)).frame().rings_digest(), expected[0].rings);

  // Two clusters so far apart that float32 relative to their middle cannot resolve them.
  std::vector<double> wide = MovingBlob(3, 7);
  for (std::size_t i = wide.size() / 2; i < wide.size(); ++i) wide[i] += 1e5 + 0.013;
  Frame frame;
  frame.positions = std::span<const double>(wide);
  v1::ReconstructRequest request;
  wire::EncodeFrame(frame, *request.mutable_frame());
  request.mutable_frame()->set_sequence(2);
  const auto refused = client.SendAndReceive(request);
  ASSERT_TRUE(refused.has_error());
  EXPECT_EQ(refused.error().reason(), wire::kReasonResolution);
  EXPECT_EQ(refused.error().next_sequence(), 3u);
  EXPECT_EQ(client.SendAndReceive(BlobRequest(3, 3, 1)).frame().rings_digest(), expected[1].rings);
}

TEST_P(Streams, DoubtsAreToldAndAGuessedSpacingLeavesNoTrace) {
  auto open = OpenRequest();
  open.mutable_open()->mutable_parameters()->clear_spacing();
  const std::vector<double> two_far = {0, 0, 3e4, 4e4};
  auto beginning = BlobRequest(1, 3, 0);
  beginning.mutable_frame()->set_positions(two_far.data(), two_far.size() * sizeof(double));

  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(open).has_opened());
  const auto guessed = client.SendAndReceive(beginning).frame();
  ASSERT_EQ(guessed.statistics().doubts_size(), 1);
  EXPECT_EQ(guessed.statistics().doubts(0), v1::DOUBT_SPACING_PROVISIONAL);
  const auto body = client.SendAndReceive(BlobRequest(2, 3, 0)).frame();
  EXPECT_EQ(body.statistics().doubts_size(), 0);

  StreamClient undisturbed(channel_);
  ASSERT_TRUE(undisturbed.SendAndReceive(open).has_opened());
  const auto expected = undisturbed.SendAndReceive(BlobRequest(1, 3, 0)).frame();
  EXPECT_EQ(body.rings_digest(), expected.rings_digest());
  EXPECT_EQ(body.mesh_digest(), expected.mesh_digest());

  // The spacing is fixed now, so particles three times as far apart are reported.
  std::vector<double> wide = MovingBlob(3, 1);
  for (double& coordinate : wide) coordinate *= 3;
  auto contradicting = BlobRequest(3, 3, 1);
  contradicting.mutable_frame()->set_positions(wide.data(), wide.size() * sizeof(double));
  const auto told = client.SendAndReceive(contradicting).frame();
  ASSERT_EQ(told.statistics().doubts_size(), 1);
  EXPECT_EQ(told.statistics().doubts(0), v1::DOUBT_SPACING_CONTRADICTED);
}

// Sends `request` and expects a frame error with this reason.
void ExpectError(StreamClient& client, const v1::ReconstructRequest& request,
                 std::string_view reason, std::uint64_t next_sequence) {
  const auto answer = client.SendAndReceive(request);
  ASSERT_TRUE(answer.has_error()) << answer.ShortDebugString().substr(0, 200);
  EXPECT_EQ(answer.error().reason(), reason);
  EXPECT_EQ(answer.error().sequence(), request.frame().sequence());
  EXPECT_EQ(answer.error().next_sequence(), next_sequence);
  EXPECT_FALSE(answer.error().field().empty());
  EXPECT_FALSE(answer.error().value().empty());
  EXPECT_FALSE(answer.error().rule().empty());
}

TEST_P(Streams, SpoiledFramesDoNotChangeTheOtherResults) {
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  const auto expected = LocalDigests(4, 30);
  std::uint64_t next = 1;
  for (std::uint64_t i = 0; i < 30; ++i) {
    if (i % 5 == 4) {
      auto nan = BlobRequest(next, 4, i);
      const double not_a_number = std::numeric_limits<double>::quiet_NaN();
      nan.mutable_frame()->mutable_positions()->replace(
          8 * i, 8, reinterpret_cast<const char*>(&not_a_number), 8);
      ExpectError(client, nan, kReasonNotFinite, next + 1);
      ++next;
      auto cut = BlobRequest(next, 4, i);
      cut.mutable_frame()->mutable_positions()->pop_back();
      ExpectError(client, cut, wire::kReasonByteCount, next + 1);
      ++next;
      auto crowd = BlobRequest(next, 4, i);
      crowd.mutable_frame()->set_positions(std::string(16 * 20'001, '\0'));
      ExpectError(client, crowd, kReasonTooManyParticles, next + 1);
      ++next;
      auto fat = BlobRequest(next, 4, i);
      fat.mutable_frame()->set_positions(std::string(16 * 70'000, '\0'));
      ExpectError(client, fat, kReasonFrameBytes, next + 1);
      ++next;
    }
    if (i % 7 == 3) ExpectError(client, BlobRequest(next + 1, 4, 99), kReasonSequenceGap, next);
    if (i % 7 == 5) {
      ExpectError(client, BlobRequest(next - 1, 4, 99), kReasonSequenceDuplicate, next);
    }
    const auto answer = client.SendAndReceive(BlobRequest(next++, 4, i));
    ASSERT_TRUE(answer.has_frame()) << answer.error().message();
    EXPECT_EQ((Digests{answer.frame().rings_digest(), answer.frame().mesh_digest()}), expected[i])
        << "frame " << i;
  }
}

TEST_P(Streams, AreTheSameAloneAndWithFiveOtherStreamsRunning) {
  const auto expected = LocalDigests(5, 8);
  std::vector<std::thread> others;
  for (unsigned seed = 200; seed < 205; ++seed) {
    others.emplace_back([&, seed] { StreamedDigests(Connect(*server_, GetParam()), seed, 12); });
  }
  EXPECT_EQ(StreamedDigests(channel_, 5, 8), expected);
  for (std::thread& other : others) other.join();
}

TEST_P(Streams, TwentyAtOnceAllGetTheirOwnResults) {
  std::vector<std::thread> clients;
  for (unsigned seed = 0; seed < 20; ++seed) {
    clients.emplace_back([&, seed] {
      EXPECT_EQ(StreamedDigests(Connect(*server_, GetParam()), seed, 5), LocalDigests(seed, 5));
    });
  }
  for (std::thread& client : clients) client.join();
}

TEST_P(Streams, AWindowOfFramesCanBeSentBeforeAnyAnswerIsReceived) {
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  const auto expected = LocalDigests(6, 12);
  // A separate writer, because nothing is buffered in process.
  std::thread writer([&] {
    for (std::uint64_t i = 0; i < 12; ++i) EXPECT_TRUE(client.Send(BlobRequest(i + 1, 6, i)));
    client.HalfClose();
  });
  for (std::uint64_t i = 0; i < 12; ++i) {
    const auto answer = client.Receive();
    EXPECT_EQ(answer.frame().sequence(), i + 1);
    EXPECT_EQ(answer.frame().rings_digest(), expected[i].rings);
  }
  writer.join();
  EXPECT_TRUE(client.Finish().ok());
}

TEST_P(Streams, MayBeCancelledAtAnyMomentAndTheirNamesAreFreeAgain) {
  constexpr unsigned kSeed = 17;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  for (int round = 0; round < 40; ++round) {
    StreamClient client(channel_);
    std::thread canceller([&, pause = std::chrono::microseconds(random() % 5000)] {
      std::this_thread::sleep_for(pause);
      client.Cancel();
    });
    if (client.SendAndReceive(OpenRequest()).has_opened()) {
      for (std::uint64_t i = 0; client.Send(BlobRequest(i + 1, 1, i % 3)); ++i) {
        if (client.Receive().response_case() == v1::ReconstructResponse::RESPONSE_NOT_SET) break;
      }
    }
    canceller.join();
    EXPECT_EQ(client.Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_EQ(StreamedDigests(channel_, 1, 3), LocalDigests(1, 3)) << "the server is well";
}

TEST(StreamsOverTcp, AreTheSameForOneTwoAndSevenThreads) {
  const auto expected = LocalDigests(8, 6);
  for (const unsigned threads : {1u, 2u, 7u}) {
    ServerOptions options = TestOptions();
    options.threads = threads;
    const auto server = StartServer(options);
    EXPECT_EQ(StreamedDigests(Connect(*server, Transport::kTcp), 8, 6), expected)
        << threads << " threads";
  }
}

}  // namespace
}  // namespace partiemc::server
