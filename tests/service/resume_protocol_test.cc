// Checkpoints, tokens and take-over on the wire (proto/PROTOCOL.md, "Resume").
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "partiemc/partiemc.h"
#include "server/moving_blob.h"
#include "service/captured_log.h"
#include "service/service_testing.h"
#include "support/temporary_folder.h"
#include "wire/codec.h"

namespace partiemc::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr unsigned kSeed = 7;
constexpr std::uint64_t kFrames = 8;

v1::ReconstructRequest OpenWithCheckpoints(std::uint32_t interval) {
  auto open = OpenRequest("tank");
  open.mutable_open()->set_checkpoint_interval(interval);
  return open;
}

v1::ReconstructRequest Resume(const std::string& checkpoint, const std::string& token) {
  auto open = OpenWithCheckpoints(1);
  open.mutable_open()->mutable_resume()->set_checkpoint(checkpoint);
  open.mutable_open()->mutable_resume()->set_stream_token(token);
  return open;
}

class ResumeProtocol : public ::testing::TestWithParam<Transport> {
 protected:
  // Expects this end of a stream opened by `open`.
  void ExpectRefused(const v1::ReconstructRequest& open, grpc::StatusCode code,
                     const std::string& reason) {
    StreamClient client(channel_);
    client.Send(open);
    client.HalfClose();
    const grpc::Status status = client.Finish();
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_EQ(client.reason(), reason);
  }

  void ExpectMismatch(const v1::ReconstructRequest& open, const std::string& what) {
    StreamClient client(channel_);
    client.Send(open);
    client.HalfClose();
    const grpc::Status status = client.Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << what;
    EXPECT_EQ(client.reason(), "CHECKPOINT_MISMATCH") << what;
    EXPECT_THAT(status.error_message(), HasSubstr(what));
  }

  // An open stream, and its checkpoint after one frame.
  struct Stream {
    std::unique_ptr<StreamClient> client;
    std::string token, checkpoint;
  };
  Stream Start(const std::string& name = "tank") {
    Stream stream{.client = std::make_unique<StreamClient>(channel_)};
    auto open = OpenWithCheckpoints(1);
    open.mutable_open()->set_stream_name(name);
    stream.token = stream.client->SendAndReceive(open).opened().stream_token();
    stream.checkpoint = stream.client->SendAndReceive(BlobRequest(1, kSeed, 0)).checkpoint();
    return stream;
  }

  // The name of the only stream.
  static std::string ListedName(const std::shared_ptr<grpc::Channel>& channel) {
    TimedContext context;
    v1::ListStreamsResponse streams;
    EXPECT_TRUE(
        v1::ReconstructionService::NewStub(channel)->ListStreams(&context, {}, &streams).ok());
    EXPECT_EQ(streams.streams_size(), 1);
    return streams.streams_size() == 1 ? streams.streams(0).stream_name() : "";
  }

  std::unique_ptr<Server> server_ = StartServer(TestOptions());
  std::shared_ptr<grpc::Channel> channel_ = Connect(*server_, GetParam());
};

INSTANTIATE_TEST_SUITE_P(Over, ResumeProtocol,
                         ::testing::Values(Transport::kInProcess, Transport::kTcp),
                         [](const auto& test) { return TransportName(test.param); });

// The results of the stream are all at its former server.
TEST_P(ResumeProtocol, AStreamThatFinishesElsewhereWithoutAFrameIsKnownThereAsFinished) {
  Stream stream = Start();
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_LATEST, 9);
  const std::string lineage = watcher.Receive().opened().lineage();
  stream.client->Cancel();
  const auto elsewhere = StartServer(TestOptions());
  const auto channel = Connect(*elsewhere, GetParam());
  StreamClient resumed(channel);
  const auto opened = resumed.SendAndReceive(Resume(stream.checkpoint, stream.token)).opened();
  EXPECT_EQ(opened.next_sequence(), 2u);
  resumed.HalfClose();
  ASSERT_TRUE(resumed.Finish().ok());
  WatchClient back(channel);
  v1::WatchStreamRequest request;
  request.mutable_open()->set_stream_name("tank");
  request.mutable_open()->set_credits(1);
  request.mutable_open()->set_lineage(lineage);
  back.Send(request);
  const auto found = back.Receive().opened();
  EXPECT_EQ(found.lineage(), lineage);
  EXPECT_TRUE(found.has_frames());
  EXPECT_EQ(found.newest_sequence(), 1u);
  EXPECT_EQ(back.Receive().ended().reason(), "FINISHED");
  EXPECT_TRUE(back.Finish().ok());
}

TEST_P(ResumeProtocol, ACheckpointComesWithEveryKthFrameWhateverItsAnswer) {
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenWithCheckpoints(3)).has_opened());
  for (std::uint64_t k = 1; k <= 7; ++k) {
    auto request = BlobRequest(k, kSeed, k);
    if (k == 6) request.mutable_frame()->mutable_positions()->pop_back();
    const auto answer = client.SendAndReceive(request);
    ASSERT_EQ(answer.has_error(), k == 6);
    EXPECT_EQ(!answer.checkpoint().empty(), k % 3 == 0) << k;
  }
  const auto gap = client.SendAndReceive(BlobRequest(9, kSeed, 9));
  EXPECT_EQ(gap.error().reason(), "SEQUENCE_GAP");
  EXPECT_TRUE(gap.checkpoint().empty()) << "uses up no number";
}

TEST_P(ResumeProtocol, AResumedStreamGivesTheDigestsOfAnUndisturbedOne) {
  const std::vector<Digests> expected = LocalDigests(kSeed, kFrames);
  std::string token, checkpoint;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    // Each frame in its own call, while the previous call is still open.
    StreamClient client(channel_);
    const auto opened =
        client.SendAndReceive(k == 0 ? OpenWithCheckpoints(1) : Resume(checkpoint, token));
    ASSERT_TRUE(opened.has_opened());
    EXPECT_EQ(opened.opened().next_sequence(), k + 1);
    ASSERT_EQ(opened.opened().stream_token().size(), 32u);
    if (k > 0) {
      EXPECT_EQ(opened.opened().stream_token(), token) << "it stays the same";
    }
    token = opened.opened().stream_token();
    const auto answer = client.SendAndReceive(BlobRequest(k + 1, kSeed, k));
    ASSERT_TRUE(answer.has_frame());
    EXPECT_EQ((Digests{answer.frame().rings_digest(), answer.frame().mesh_digest()}), expected[k]);
    checkpoint = answer.checkpoint();
  }
}

TEST_P(ResumeProtocol, ANoiseFilterGoesOnAndGivesTheDigestsOfThisProcess) {
  const auto filtered = [](v1::ReconstructRequest open) {
    open.mutable_open()->mutable_parameters()->set_noise_filter(.5);
    return open;
  };
  ReconstructionParameters parameters = BlobParameters();
  parameters.noise_filter = .5;
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok());
  State state;
  Workspace workspace;
  Result result;
  std::string token, checkpoint;
  const std::vector<Digests> without = LocalDigests(kSeed, kFrames);
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    const std::vector<double> positions = MovingBlob(kSeed, k);
    std::vector<std::uint64_t> ids;
    for (std::uint64_t id = 0; 2 * id < positions.size(); ++id) ids.push_back(id);
    const Frame frame{.positions = std::span<const double>(positions), .ids = ids};
    ASSERT_TRUE(reconstructor->Reconstruct(frame, state, workspace, result).ok());
    StreamClient client(channel_);
    const auto opened = client.SendAndReceive(
        filtered(k == 0 ? OpenWithCheckpoints(1) : Resume(checkpoint, token)));
    ASSERT_TRUE(opened.has_opened());
    EXPECT_EQ(opened.opened().parameters().noise_filter(), .5);
    token = opened.opened().stream_token();
    if (k + 1 == kFrames) {  // Without ids.
      const auto refused = client.SendAndReceive(BlobRequest(k + 1, kSeed, k));
      EXPECT_EQ(refused.error().reason(), "COUNT");
      EXPECT_EQ(refused.error().field(), "ids");
      checkpoint = refused.checkpoint();
      break;
    }
    auto request = BlobRequest(k + 1, kSeed, k);
    request.mutable_frame()->set_ids(ids.data(), 8 * ids.size());
    const auto answer = client.SendAndReceive(request);
    ASSERT_TRUE(answer.has_frame());
    const Digests digests{answer.frame().rings_digest(), answer.frame().mesh_digest()};
    EXPECT_EQ(digests, (Digests{DigestRings(result.rings), DigestMesh(result.mesh)})) << k;
    EXPECT_EQ(digests == without[k], k == 0);
    checkpoint = answer.checkpoint();
  }
  ExpectMismatch(Resume(checkpoint, token), "other parameters");
}

// A column of particles in the corner of a tank; the right side moves.
TEST_P(ResumeProtocol, WallsGoOnAndGiveTheDigestsOfThisProcess) {
  ReconstructionParameters parameters = BlobParameters();
  parameters.walls = {{.points = {0, 0, 2, 0, 2, 2, 0, 2}}};
  const auto with_walls = [&](v1::ReconstructRequest open) {
    wire::EncodeParameters(parameters, *open.mutable_open()->mutable_parameters());
    return open;
  };
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok()) << reconstructor.status();
  State state;
  Workspace workspace;
  Result result;
  std::string token, checkpoint;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    std::vector<double> positions;
    for (int i = 0; i < 400; ++i) {
      const double stretch = 1 + .01 * static_cast<double>(k);
      positions.push_back(kBlobSpacing * (i % 20 + .5) * stretch);
      positions.push_back(kBlobSpacing * (static_cast<double>(i / 20) + .5) / stretch);
    }
    const Frame frame{.positions = std::span<const double>(positions)};
    ASSERT_TRUE(reconstructor->Reconstruct(frame, state, workspace, result).ok());
    StreamClient client(channel_);
    const auto opened = client.SendAndReceive(
        with_walls(k == 0 ? OpenWithCheckpoints(1) : Resume(checkpoint, token)));
    ASSERT_TRUE(opened.has_opened());
    EXPECT_THAT(opened.opened().parameters().walls(0).points(),
                ElementsAre(0, 0, 2, 0, 2, 2, 0, 2));
    token = opened.opened().stream_token();
    v1::ReconstructRequest request;
    wire::EncodeFrame(frame, *request.mutable_frame());
    request.mutable_frame()->set_sequence(k + 1);
    const auto answer = client.SendAndReceive(request);
    ASSERT_TRUE(answer.has_frame());
    wire::ReconstructedFrame received;
    ASSERT_TRUE(wire::DecodeResult(answer.frame(), received).ok());
    EXPECT_EQ(received.rings_digest, DigestRings(result.rings));
    EXPECT_FALSE(received.result.rings.wetted.empty());
    EXPECT_EQ(received.result.rings.wetted, result.rings.wetted);
    EXPECT_EQ(received.result.rings.contacts.size(), 2u);
    EXPECT_EQ(received.result.rings.contacts, result.rings.contacts);
    EXPECT_EQ(received.result.rings.contact_angles, result.rings.contact_angles);
    checkpoint = answer.checkpoint();
  }
  parameters.walls[0].points[2] = 3;
  ExpectMismatch(with_walls(Resume(checkpoint, token)), "other parameters");
}

TEST_P(ResumeProtocol, WrongWallsAreRefused) {
  for (const std::vector<double>& points :
       {std::vector<double>{}, {0, 0, 1}, {0, 0, 1, std::nan("")}, {0, 0, 1, 0, 1}}) {
    auto open = OpenWithCheckpoints(1);
    v1::Wall& wall = *open.mutable_open()->mutable_parameters()->add_walls();
    wall.mutable_points()->Assign(points.begin(), points.end());
    StreamClient client(channel_);
    client.Send(open);
    client.HalfClose();
    const grpc::Status status = client.Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr("parameters.walls[0].points"));
  }
}

TEST_P(ResumeProtocol, SectionsGoOnToo) {
  const auto with_sections = [](v1::ReconstructRequest open) {
    v1::ReconstructionParameters& parameters = *open.mutable_open()->mutable_parameters();
    for (const double isovalue : {0.3, 0.7}) parameters.add_sections()->set_isovalue(isovalue);
    return open;
  };
  const auto sections_of = [](const v1::ReconstructResponse& answer) {
    std::vector<std::pair<Digests, std::string>> sections;
    for (const v1::ReconstructedFrame& section : answer.frame().sections()) {
      EXPECT_GT(section.statistics().area(), 0);
      EXPECT_EQ(section.statistics().stages_size(), 0) << "times are the frame's";
      sections.emplace_back(Digests{section.rings_digest(), section.mesh_digest()},
                            section.rings().identities());
    }
    EXPECT_EQ(sections.size(), 2u);
    return sections;
  };
  StreamClient undisturbed(channel_);
  v1::ReconstructRequest other = with_sections(OpenWithCheckpoints(1));
  other.mutable_open()->set_stream_name("undisturbed");
  const auto own = undisturbed.SendAndReceive(other);
  ASSERT_TRUE(own.has_opened());
  EXPECT_EQ(own.opened().parameters().sections_size(), 2);
  std::string token, checkpoint;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    const auto expected = undisturbed.SendAndReceive(BlobRequest(k + 1, kSeed, k));
    StreamClient client(channel_);
    const auto opened = client.SendAndReceive(
        with_sections(k == 0 ? OpenWithCheckpoints(1) : Resume(checkpoint, token)));
    ASSERT_TRUE(opened.has_opened());
    token = opened.opened().stream_token();
    const auto answer = client.SendAndReceive(BlobRequest(k + 1, kSeed, k));
    ASSERT_TRUE(answer.has_frame());
    EXPECT_EQ(sections_of(answer), sections_of(expected));
    checkpoint = answer.checkpoint();
  }
  ExpectMismatch(Resume(checkpoint, token), "other parameters");
}

TEST_P(ResumeProtocol, WhoHasTheTokenTakesOverAtOnceAndTheOldCallEnds) {
  StreamClient old_call(channel_);
  const auto opened = old_call.SendAndReceive(OpenWithCheckpoints(1));
  ASSERT_TRUE(opened.has_opened());
  ExpectRefused(OpenWithCheckpoints(1), grpc::StatusCode::ALREADY_EXISTS, "NAME_IN_USE");
  ExpectRefused(Resume("", std::string(32, 'a')), grpc::StatusCode::ALREADY_EXISTS, "NAME_IN_USE");

  StreamClient new_call(channel_);
  EXPECT_TRUE(new_call.SendAndReceive(Resume("", opened.opened().stream_token())).has_opened());
  EXPECT_FALSE(old_call.Finish().ok());
  EXPECT_TRUE(new_call.SendAndReceive(BlobRequest(1, kSeed, 0)).has_frame());
}

TEST_P(ResumeProtocol, WhatDoesNotFitIsRefused) {
  StreamClient client(channel_);
  const auto opened = client.SendAndReceive(OpenWithCheckpoints(1));
  const std::string token = opened.opened().stream_token();
  const auto answer = client.SendAndReceive(BlobRequest(1, kSeed, 0));
  const std::string checkpoint = answer.checkpoint();

  ExpectRefused(Resume(checkpoint, "mine"), grpc::StatusCode::INVALID_ARGUMENT, "STREAM_TOKEN");
  ExpectRefused(Resume("nonsense", token), grpc::StatusCode::INVALID_ARGUMENT,
                "CORRUPT_CHECKPOINT");
  std::string damaged = checkpoint;
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  ExpectRefused(Resume(damaged, token), grpc::StatusCode::INVALID_ARGUMENT, "CORRUPT_STATE");

  EXPECT_TRUE(client.SendAndReceive(BlobRequest(2, kSeed, 1)).has_frame()) << "undisturbed";
}

TEST_P(ResumeProtocol, ACheckpointIsGoodForItsOwnStreamAndForEverythingThatOpenSaid) {
  const Stream stream = Start();
  const Stream other = Start("other");
  ExpectMismatch(Resume(other.checkpoint, stream.token), "another stream");

  auto open = Resume(stream.checkpoint, stream.token);
  open.mutable_open()->mutable_parameters()->set_kernel_radius(2);
  ExpectMismatch(open, "other parameters");
  open = Resume(stream.checkpoint, stream.token);
  open.mutable_open()->mutable_outputs()->set_rings(true);
  ExpectMismatch(open, "other outputs");
  open = Resume(stream.checkpoint, stream.token);
  open.mutable_open()->set_checkpoint_interval(2);
  ExpectMismatch(open, "another checkpoint_interval");
  open = Resume(stream.checkpoint, stream.token);
  (*open.mutable_open()->mutable_labels())["run"] = "7";
  ExpectMismatch(open, "other labels");
  open = Resume(stream.checkpoint, stream.token);
  open.mutable_open()->set_stream_name("tank-2");
  ExpectMismatch(open, "another stream_name");

  open = Resume(stream.checkpoint, stream.token);
  open.mutable_open()->mutable_outputs()->set_rings(true);  // The default of an absent message.
  open.mutable_open()->mutable_outputs()->set_mesh(true);
  StreamClient client(channel_);
  EXPECT_TRUE(client.SendAndReceive(open).has_opened());
}

TEST_P(ResumeProtocol, ServersWithOneKeyTakeEachOthersCheckpointsAndNoOthers) {
  ServerOptions options = TestOptions();
  const support::TemporaryFolder folder;
  options.checkpoint_key_file = folder.Write("a", "key-a-of-test-0123456789\n");
  server_ = StartServer(options);
  channel_ = Connect(*server_, GetParam());
  const auto brother = StartServer(options);
  options.checkpoint_key_file = folder.Write("b", "key-b-of-test-0123456789\n");
  const auto stranger = StartServer(options);
  const Stream stream = Start();

  StreamClient client(Connect(*brother, GetParam()));
  const auto opened = client.SendAndReceive(Resume(stream.checkpoint, stream.token));
  ASSERT_TRUE(opened.has_opened());
  EXPECT_EQ(opened.opened().next_sequence(), 2u);
  const auto answer = client.SendAndReceive(BlobRequest(2, kSeed, 1));
  EXPECT_EQ((Digests{answer.frame().rings_digest(), answer.frame().mesh_digest()}),
            LocalDigests(kSeed, 2).back());

  channel_ = Connect(*stranger, GetParam());
  ExpectRefused(Resume(stream.checkpoint, stream.token), grpc::StatusCode::FAILED_PRECONDITION,
                "CHECKPOINT_SIGNATURE");
  StreamClient anew(channel_);
  EXPECT_TRUE(anew.SendAndReceive(Resume("", stream.token)).has_opened())
      << "the beginning of a stream has no signature";
}

TEST_P(ResumeProtocol, ABrokenKeyFileFailsTheStartAndLaterKeepsTheOldKeys) {
  const support::TemporaryFolder folder;
  const auto write = [&](const std::string& keys) {  // Atomically.
    std::filesystem::rename(folder.Write("next", keys), folder.Path("keys"));
    return folder.Path("keys");
  };
  ServerOptions options = TestOptions();
  options.reload_interval = std::chrono::milliseconds(10);
  options.checkpoint_key_file = write("short-secret\n");
  const CapturedLog log;
  const auto refused = Server::Start(options);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(
      std::string(refused.status().message()),
      HasSubstr("--checkpoint-key-file " + folder.Path("keys") + ": line 1: must be a key"));

  write("key-a-secret-0123456789\n");
  server_ = StartServer(options);
  channel_ = Connect(*server_, GetParam());
  const Stream stream = Start();
  write("short-secret\n");
  EXPECT_TRUE(Eventually([&] { return log.Count("checkpoint keys not reloaded") == 1; }));
  StreamClient client(channel_);
  EXPECT_TRUE(client.SendAndReceive(Resume(stream.checkpoint, stream.token)).has_opened());

  write("key-b-secret-01234567");  // Half written.
  EXPECT_TRUE(Eventually([&] { return log.Count("must end with a newline") == 1; }));
  EXPECT_EQ(log.Count("checkpoint keys reloaded"), 0u);
  write("key-b-secret-0123456789\n");
  EXPECT_TRUE(Eventually([&] { return log.Count("checkpoint keys reloaded") >= 1; }));
  ExpectRefused(Resume(stream.checkpoint, stream.token), grpc::StatusCode::FAILED_PRECONDITION,
                "CHECKPOINT_SIGNATURE");
  server_.reset();
  EXPECT_EQ(log.Count("secret"), 0u) << log.Text();
}

TEST_P(ResumeProtocol, TooLargeACheckpointIsNeitherSentNorRead) {
  ServerOptions options = TestOptions();
  options.limits.max_frame_bytes = 10'000;
  server_ = StartServer(options);
  channel_ = Connect(*server_, GetParam());
  StreamClient client(channel_);
  const auto opened = client.SendAndReceive(OpenWithCheckpoints(1));
  // Particles far apart, each with its own outline.
  auto spray = BlobRequest(1, kSeed, 0);
  std::vector<float> positions;
  for (int k = 0; k < 500; ++k) positions.insert(positions.end(), {static_cast<float>(k), 0.0f});
  spray.mutable_frame()->set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  spray.mutable_frame()->set_positions(positions.data(), positions.size() * sizeof(float));
  const auto large = client.SendAndReceive(spray);
  ASSERT_TRUE(large.has_frame());
  EXPECT_EQ(large.frame().statistics().particles(), 500u);
  EXPECT_TRUE(large.checkpoint().empty());
  auto small = spray;
  small.mutable_frame()->set_sequence(2);
  small.mutable_frame()->mutable_positions()->resize(80);
  const auto answer = client.SendAndReceive(small);
  EXPECT_FALSE(answer.checkpoint().empty());
  EXPECT_LE(answer.checkpoint().size(), 10'000u);
  const std::string token = opened.opened().stream_token();
  ExpectRefused(Resume(std::string(10'001, 'x'), token), grpc::StatusCode::RESOURCE_EXHAUSTED,
                "CHECKPOINT_BYTES");
  ExpectRefused(Resume(std::string(10'000, 'x'), token), grpc::StatusCode::INVALID_ARGUMENT,
                "CORRUPT_CHECKPOINT");
}

TEST_P(ResumeProtocol, ANameThatTheServerMadeUpStaysTheStreamsOnEveryServer) {
  const auto other_server = StartServer(TestOptions());
  const auto other_channel = Connect(*other_server, GetParam());
  const Stream stream = Start("");
  const std::string name = ListedName(channel_);
  EXPECT_EQ(name.substr(0, 7), "stream-");
  for (const auto& given : {std::string(), name}) {
    auto open = Resume(stream.checkpoint, stream.token);
    open.mutable_open()->set_stream_name(given);
    StreamClient client(other_channel);
    ASSERT_TRUE(client.SendAndReceive(open).has_opened());
    EXPECT_EQ(ListedName(other_channel), name);
  }
}

}  // namespace
}  // namespace partiemc::server
