// How the client handles a loss, step by step, against scripted servers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

#include "client/library/fake_server.h"
#include "partiemc/client/stream.h"

namespace partiemc::client {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr milliseconds kShort(200);
const std::string kToken(32, '7');
const std::vector<double> kPositions = {1, 2};
const Frame kFrame{.positions = std::span<const double>(kPositions)};

// Accepts a resumable stream with the changes of `change`; returns the request.
v1::OpenStream AcceptResumable(
    FakeServer::Rpc& rpc, std::uint64_t next_sequence,
    const std::function<void(v1::StreamOpened&)>& change = [](v1::StreamOpened&) {}) {
  v1::ReconstructRequest request;
  rpc.Read(&request);
  v1::ReconstructResponse response;
  v1::StreamOpened& opened = *response.mutable_opened();
  opened.set_stream_token(kToken);
  *opened.mutable_parameters() = request.open().parameters();
  opened.set_frames_in_flight(2);
  opened.mutable_limits()->set_max_frame_bytes(1 << 20);
  opened.set_next_sequence(next_sequence);
  opened.set_frame_boxes(true);
  change(opened);
  rpc.Write(response);
  return request.open();
}

// Answers the next `count` frames, with a checkpoint "after N" in every `interval`-th answer.
void AnswerSome(FakeServer::Rpc& rpc, int count, std::uint64_t interval) {
  v1::ParticleFrame frame;
  for (int k = 0; k < count && ReadFrame(rpc, frame); ++k) {
    auto answer = TriangleAt(frame);
    if (frame.sequence() % interval == 0) {
      answer.set_checkpoint("after " + std::to_string(frame.sequence()));
    }
    rpc.Write(answer);
  }
}

StreamOptions Options(const FakeServer* other = nullptr) {
  StreamOptions options{.name = "tank", .checkpoint_interval = 2};
  if (other != nullptr) options.fallback_addresses = {other->address()};
  options.reconnect.give_up_after = milliseconds(20000);
  return options;
}

// Sends frames, each after the previous answer; returns the numbers of the answers.
std::vector<std::uint64_t> Exchange(FrameStream& stream, int count, const Frame& frame = kFrame) {
  std::vector<std::uint64_t> answered;
  Event event;
  for (int k = 0; k < count; ++k) {
    if (!stream.Send(frame, k).ok() || !stream.Receive(event).ok()) break;
    answered.push_back(event.sequence);
  }
  return answered;
}

grpc::Status Lost(grpc::StatusCode code) { return grpc::Status(code, "as told"); }

class WorthRetrying : public testing::TestWithParam<grpc::StatusCode> {};

INSTANTIATE_TEST_SUITE_P(Status, WorthRetrying,
                         testing::Values(grpc::StatusCode::OK, grpc::StatusCode::UNAVAILABLE,
                                         grpc::StatusCode::INTERNAL, grpc::StatusCode::UNKNOWN,
                                         grpc::StatusCode::CANCELLED));

TEST_P(WorthRetrying, GoesOnElsewhereFromTheCheckpointAndDeliversEachAnswerOnce) {
  FakeServer first([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    const auto set_id = [](v1::StreamOpened& opened) { opened.set_stream_id("first"); };
    EXPECT_EQ(AcceptResumable(rpc, 1, set_id).checkpoint_interval(), 2u);
    AnswerSome(rpc, 3, 2);
    return Lost(GetParam());
  });
  v1::OpenStream resumed;
  std::vector<std::uint64_t> sent_again;
  FakeServer second([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    const auto set_id = [](v1::StreamOpened& opened) { opened.set_stream_id("second"); };
    resumed = AcceptResumable(rpc, 3, set_id);
    v1::ParticleFrame frame;
    while (ReadFrame(rpc, frame)) {
      sent_again.push_back(frame.sequence());
      rpc.Write(TriangleAt(frame));
    }
    return grpc::Status::OK;
  });
  const auto stream = Stream::Open(first.address(), Options(&second));
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_EQ((*stream)->CurrentId(), "first");
  EXPECT_THAT(Exchange(**stream, 6), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_EQ((*stream)->CurrentId(), "second");
  EXPECT_EQ((*stream)->info().stream_id, "first");
  ASSERT_TRUE((*stream)->FinishSending().ok());
  Event event;
  EXPECT_EQ(*(*stream)->Receive(event), Received::kEnd);
  EXPECT_EQ(resumed.stream_name(), "tank");
  EXPECT_EQ(resumed.resume().checkpoint(), "after 2");
  EXPECT_EQ(resumed.resume().stream_token(), kToken);
  EXPECT_THAT(sent_again, ElementsAre(3, 4, 5, 6)) << "3 was answered before, by a dropped answer";
}

class NotWorthRetrying : public testing::TestWithParam<grpc::StatusCode> {};

INSTANTIATE_TEST_SUITE_P(Status, NotWorthRetrying,
                         testing::Values(grpc::StatusCode::INVALID_ARGUMENT,
                                         grpc::StatusCode::RESOURCE_EXHAUSTED,
                                         grpc::StatusCode::UNAUTHENTICATED,
                                         grpc::StatusCode::DEADLINE_EXCEEDED,
                                         grpc::StatusCode::ABORTED));

TEST_P(NotWorthRetrying, EndsTheStream) {
  std::atomic<int> calls = 0;
  FakeServer server([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    ++calls;
    AcceptResumable(rpc, 1);
    return Lost(GetParam());
  });
  const auto stream = Stream::Open(server.address(), Options());
  ASSERT_TRUE(stream.ok()) << stream.status();
  Event event;
  EXPECT_EQ(static_cast<int>((*stream)->Receive(event).status().code()),
            static_cast<int>(GetParam()));
  EXPECT_EQ(calls, 1);
}

TEST(Resume, AVerdictOfTheServerIsNoLostConnectionWhateverItsCode) {
  std::atomic<int> calls = 0;
  FakeServer server([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    ++calls;
    AcceptResumable(rpc, 1);
    context.AddTrailingMetadata("partiemc-reason", "TAKEN_OVER");
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  const auto stream = Stream::Open(server.address(), Options());
  ASSERT_TRUE(stream.ok()) << stream.status();
  Event event;
  EXPECT_FALSE((*stream)->Receive(event).ok());
  EXPECT_EQ(calls, 1);
}

class MayPassElsewhere : public testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Reason, MayPassElsewhere,
                         testing::Values("NAME_IN_USE", "TOO_MANY_STREAMS", "CHECKPOINT_MISMATCH",
                                         "CHECKPOINT_SIGNATURE", "MEMORY_BUDGET"));

TEST_P(MayPassElsewhere, IsNoVerdictWhileAStreamResumes) {
  FakeServer first([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  FakeServer strange([&](grpc::ServerContext& context, FakeServer::Rpc&) {
    context.AddTrailingMetadata("partiemc-reason", GetParam());
    return Lost(grpc::StatusCode::FAILED_PRECONDITION);
  });
  FakeServer good([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    AnswerSome(rpc, 100, 2);
    return grpc::Status::OK;
  });
  StreamOptions options = Options(&strange);
  options.fallback_addresses.push_back(good.address());
  const auto stream = Stream::Open(first.address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_THAT(Exchange(**stream, 2), ElementsAre(1, 2));
}

TEST(Resume, ADrainingServerIsLeftWithoutAWordToTheCaller) {
  FakeServer first([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    AnswerSome(rpc, 1, 2);
    v1::ReconstructResponse notice;
    notice.mutable_notice()->set_kind(v1::StreamNotice::KIND_DRAINING);
    rpc.Write(notice);
    context.AddTrailingMetadata("partiemc-reason", "DRAINING");
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  FakeServer second([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    EXPECT_TRUE(AcceptResumable(rpc, 1).resume().checkpoint().empty()) << "none had come yet";
    AnswerSome(rpc, 100, 2);
    return grpc::Status::OK;
  });
  const auto stream = Stream::Open(first.address(), Options(&second));
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_THAT(Exchange(**stream, 4), ElementsAre(1, 2, 3, 4));
}

TEST(Resume, GoesWhereTheDrainingServerSaysWithoutATokenInClearText) {
  FakeServer second([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    EXPECT_EQ(context.client_metadata().count("authorization"), 1u);
    AcceptResumable(rpc, 1);
    AnswerSome(rpc, 100, 2);
    return grpc::Status::OK;
  });
  FakeServer first([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    AnswerSome(rpc, 1, 2);
    v1::ReconstructResponse response;
    v1::StreamNotice& notice = *response.mutable_notice();
    notice.set_kind(v1::StreamNotice::KIND_DRAINING);
    for (const std::string& address :
         {std::string("198.51.100.1:50051"), std::string("unix:/no/such/socket"),
          std::string("a;b"), second.address()}) {
      notice.add_addresses(address);
    }
    rpc.Write(response);
    context.AddTrailingMetadata("partiemc-reason", "DRAINING");
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  StreamOptions options = Options();
  options.credentials.token = "alice-secret-0123456789";
  options.reconnect.announce = true;
  const auto stream = Stream::Open(first.address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_THAT(Exchange(**stream, 1), ElementsAre(1));
  ASSERT_TRUE((*stream)->Send(kFrame, 1).ok());
  Event event;
  ASSERT_TRUE((*stream)->Receive(event).ok());
  ASSERT_EQ(event.kind, Event::Kind::kReconnected);
  // At no other address in between.
  EXPECT_THAT(event.message, HasSubstr("continued at " + second.address()));
  ASSERT_TRUE((*stream)->Receive(event).ok());
  EXPECT_EQ(event.sequence, 2u);
}

TEST(Resume, AReconnectionIsToldToACallerWhoWantsToKnow) {
  std::atomic<int> calls = 0;
  FakeServer server([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    if (++calls == 1) return Lost(grpc::StatusCode::UNAVAILABLE);
    AnswerSome(rpc, 100, 2);
    return grpc::Status::OK;
  });
  StreamOptions options = Options();
  options.reconnect.announce = true;
  const auto stream = Stream::Open(server.address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  Event event;
  ASSERT_EQ(*(*stream)->Receive(event), Received::kEvent);
  EXPECT_EQ(event.kind, Event::Kind::kReconnected);
  EXPECT_THAT(event.message, HasSubstr("continued at " + server.address()));
  ASSERT_EQ(*(*stream)->Receive(event), Received::kEvent);
  EXPECT_EQ(event.sequence, 1u);
}

// Expects that a replica with these differences is skipped.
void ExpectPassedOver(const std::function<void(v1::StreamOpened&)>& otherwise,
                      const ReconstructionParameters& parameters = {},
                      const Frame& frame = kFrame) {
  FakeServer first([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  FakeServer other([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1, otherwise);
    v1::ParticleFrame message;
    EXPECT_FALSE(ReadFrame(rpc, message)) << "a frame of a stream that it cannot go on with";
    return WaitForCancel(context);
  });
  FakeServer good([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    AnswerSome(rpc, 100, 2);
    return grpc::Status::OK;
  });
  StreamOptions options = Options(&other);
  options.fallback_addresses.push_back(good.address());
  options.parameters = parameters;
  const auto stream = Stream::Open(first.address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_THAT(Exchange(**stream, 2, frame), ElementsAre(1, 2));
}

TEST(Resume, AReplicaWithSmallerLimitsIsPassedOver) {
  ExpectPassedOver(
      [](v1::StreamOpened& opened) { opened.mutable_limits()->set_max_frame_bytes(100); });
}

TEST(Resume, AReplicaThatResolvesTheParametersOtherwiseIsPassedOver) {
  ExpectPassedOver(
      [](v1::StreamOpened& opened) { opened.mutable_parameters()->set_kernel_radius(4); });
}

TEST(Resume, AReplicaWithoutSurfacesIsPassedOver) {
  ExpectPassedOver([](v1::StreamOpened& opened) { opened.mutable_parameters()->clear_output(); },
                   {.output = Output::kSurface, .spacing = 1});
}

TEST(Resume, AReplicaThatIgnoresBoxesOfFramesIsPassedOver) {
  Frame frame = kFrame;
  frame.box = PeriodicBox{.axes = {PeriodicAxis{0, 100}}};
  ExpectPassedOver([](v1::StreamOpened& opened) { opened.clear_frame_boxes(); }, {}, frame);
}

TEST(Resume, AnOlderServerGetsNoBoxAfterALoss) {
  FakeServer first([](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    AnswerSome(rpc, 1, 1);
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  FakeServer older([](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 2, [](v1::StreamOpened& opened) { opened.clear_frame_boxes(); });
    AnswerSome(rpc, 100, 2);
    return grpc::Status::OK;
  });
  const auto stream = Stream::Open(first.address(), Options(&older));
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_THAT(Exchange(**stream, 2), ElementsAre(1, 2));
  Frame frame = kFrame;
  frame.box = PeriodicBox{.axes = {PeriodicAxis{0, 100}}};
  EXPECT_EQ((*stream)->Send(frame, 2).status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_TRUE((*stream)->Send(kFrame, 2).ok());
}

TEST(Resume, GivesUpInTimeWithTheLastError) {
  std::optional<FakeServer> server;
  server.emplace([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  StreamOptions options = Options();
  options.reconnect.give_up_after = kShort;
  const auto stream = Stream::Open(server->address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  Event event;
  const auto received = (*stream)->Receive(event);
  EXPECT_EQ(received.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(received.status().message()),
              HasSubstr("could not continue within 0.2 s"));
  EXPECT_EQ((*stream)->Send(kFrame, 1).status().code(), absl::StatusCode::kUnavailable);
}

TEST(Resume, AnAttemptThatIsCutShortByGivingUpLeavesTheErrorBeforeIt) {
  std::atomic<int> calls = 0;
  FakeServer server([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    if (++calls > 1) return WaitForCancel(context);
    AcceptResumable(rpc, 1);
    return grpc::Status(grpc::StatusCode::UNAVAILABLE, "out for lunch");
  });
  StreamOptions options = Options();
  options.reconnect.give_up_after = kShort;
  const auto stream = Stream::Open(server.address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  Event event;
  const auto received = (*stream)->Receive(event);
  EXPECT_EQ(received.status().code(), absl::StatusCode::kUnavailable) << received.status();
  EXPECT_THAT(std::string(received.status().message()), HasSubstr("out for lunch"));
}

TEST(Resume, ACallThatIsOnlyAcceptedAgainAndAgainIsNoProgress) {
  std::atomic<int> calls = 0;
  FakeServer server([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    ++calls;
    AcceptResumable(rpc, 1);
    return Lost(grpc::StatusCode::UNAVAILABLE);  // Like a server that crashes on a frame.
  });
  StreamOptions options = Options();
  options.reconnect = {.give_up_after = milliseconds(1500), .first_pause = milliseconds(20)};
  const auto stream = Stream::Open(server.address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  Event event;
  EXPECT_FALSE((*stream)->Receive(event).ok());
  EXPECT_GT(calls, 2);
}

TEST(Resume, SendWaitsNoLongerThanItsTimeoutAlsoWhileAServerIsLookedFor) {
  std::atomic<int> calls = 0;
  FakeServer server([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    if (++calls > 1) return WaitForCancel(context);
    AcceptResumable(rpc, 1);
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  StreamOptions options = Options();
  options.send_timeout = kShort;
  const auto stream = Stream::Open(server.address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  std::thread receiver([&] {
    Event event;
    while ((*stream)->Receive(event).ok()) continue;
  });
  absl::Status refused;
  int taken = 0;
  for (; refused.ok() && taken < 100; taken += refused.ok() ? 1 : 0) {
    refused = (*stream)->Send(kFrame, taken).status();
  }
  EXPECT_EQ(refused.code(), absl::StatusCode::kDeadlineExceeded) << refused;
  ASSERT_TRUE(FindViolation(refused)) << refused;
  EXPECT_EQ(FindViolation(refused)->reason, "SEND_TIMEOUT");
  EXPECT_EQ((*stream)->InFlight(), static_cast<std::size_t>(taken));  // The stream continues.
  (*stream)->Cancel();
  receiver.join();
}

TEST(Resume, CancelEndsTheSearchForAServer) {
  std::atomic<int> calls = 0;
  FakeServer server([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    if (++calls > 1) return WaitForCancel(context);
    AcceptResumable(rpc, 1);
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  const auto stream = Stream::Open(server.address(), Options());
  ASSERT_TRUE(stream.ok()) << stream.status();
  absl::Status status;
  std::thread receiver([&] {
    Event event;
    status = (*stream)->Receive(event).status();
  });
  while (calls < 2) std::this_thread::sleep_for(milliseconds(1));
  (*stream)->Cancel();
  receiver.join();
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled) << status;
}

TEST(Resume, ReceiveKeepsItsWaitWhileThereIsNoServer) {
  std::atomic<int> calls = 0;
  FakeServer server([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    if (++calls > 1) return WaitForCancel(context);
    AcceptResumable(rpc, 1);
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  const auto stream = Stream::Open(server.address(), Options());
  ASSERT_TRUE(stream.ok()) << stream.status();
  Event event;
  while (calls < 2) ASSERT_EQ(*(*stream)->Receive(event, milliseconds(1)), Received::kNothingYet);
  EXPECT_TRUE((*stream)->Send(kFrame, 0).ok()) << "a loss is no concern of the sender";
  EXPECT_EQ((*stream)->InFlight(), 1u);
}

TEST(Resume, AFrameThatCannotBeHeldIsRefusedAndTheStreamGoesOn) {
  FakeServer server([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptResumable(rpc, 1);
    AnswerSome(rpc, 100, 2);
    return grpc::Status::OK;
  });
  StreamOptions options = Options();
  options.max_held_bytes = 1000;
  const auto stream = Stream::Open(server.address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  const std::vector<double> many(1000, 1.0);
  const auto refused = (*stream)->Send({.positions = std::span<const double>(many)}, 0);
  ASSERT_TRUE(FindViolation(refused.status())) << refused.status();
  EXPECT_EQ(FindViolation(refused.status())->reason, "HELD_BYTES");
  EXPECT_THAT(Exchange(**stream, 50).size(), 50u) << "checkpoints make room";
}

TEST(Resume, WithoutCheckpointsALossEndsTheStream) {
  FakeServer server([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    EXPECT_EQ(AcceptResumable(rpc, 1).checkpoint_interval(), 0u);
    return Lost(grpc::StatusCode::UNAVAILABLE);
  });
  StreamOptions options = Options();
  options.checkpoint_interval = 0;
  const auto stream = Stream::Open(server.address(), options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  Event event;
  EXPECT_EQ((*stream)->Receive(event).status().code(), absl::StatusCode::kUnavailable);
}

TEST(Resume, AnotherAddressServesWhereTheFirstHasNobody) {
  FakeServer server(AnswerAll);
  StreamOptions options = Options(&server);
  const auto stream = Stream::Open("127.0.0.1:1", options);
  EXPECT_TRUE(stream.ok()) << stream.status();
}

}  // namespace
}  // namespace partiemc::client
