// Streams to a server that is missing, silent or violates the protocol: a one-line error, in time.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "client/library/fake_server.h"
#include "partiemc/client/server_info.h"
#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"

namespace partiemc::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

constexpr std::chrono::milliseconds kShort(200);

const std::vector<double> kPositions = {1, 2};
const Frame kFrame{.positions = std::span<const double>(kPositions)};

// A loopback port without a listener; bound, so that no other process gets it.
class DeafPort {
 public:
  DeafPort() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    ::bind(socket_, reinterpret_cast<sockaddr*>(&address), size);
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
  }
  ~DeafPort() { ::close(socket_); }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  int socket_;
  int port_ = 0;
};

void ExpectOneLine(const absl::Status& status) {
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr("\n")));
}

TEST(StreamFailure, AnAddressThatIsNoneIsNamedWithTheFormsThatAre) {
  for (const char* address :
       {"", "localhost", "localhost:", ":50051", "localhost:http", "localhost:0", "localhost:70000",
        "unix:", "::1:50051", "http://localhost:50051", "a b:1"}) {
    const auto stream = Stream::Open(address, {.connect_timeout = kShort});
    EXPECT_EQ(stream.status().code(), absl::StatusCode::kInvalidArgument) << address;
    EXPECT_THAT(std::string(stream.status().message()), HasSubstr("must be HOST:PORT"));
  }
}

TEST(StreamFailure, NoServerThereIsOneLineThatSaysWhatToDo) {
  const DeafPort port;
  for (const absl::Status& status :
       {Stream::Open(port.address(), {.connect_timeout = kShort}).status(),
        GetServerInfo(port.address(), kShort).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
    ExpectOneLine(status);
    // On a busy machine an attempt may time out before it is refused.
    EXPECT_THAT(std::string(status.message()),
                MatchesRegex("no server at " + port.address() +
                             " .(Connection refused|tcp handshaker shutdown).: start one with "
                             "`partiemc-server --address " +
                             port.address() + "`"));
  }
}

TEST(StreamFailure, AMissingUnixSocketIsNoServerEither) {
  const auto stream = Stream::Open("unix:/nonexistent/socket", {.connect_timeout = kShort});
  EXPECT_EQ(stream.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(stream.status().message()),
              HasSubstr("no server at unix:/nonexistent/socket (No such file or directory)"));
}

TEST(StreamFailure, ParametersOutOfRangeAreRefusedWithoutAsking) {
  const auto stream = Stream::Open("127.0.0.1:1", {.parameters = {.kernel_radius = 99}});
  EXPECT_EQ(stream.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(StreamFailure, AServerThatRefusesTheStreamIsQuoted) {
  FakeServer server([](grpc::ServerContext&, FakeServer::Rpc&) {
    return grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "32 streams are open");
  });
  const auto stream = Stream::Open(server.address(), {});
  EXPECT_EQ(stream.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(stream.status().message()), HasSubstr("32 streams are open"));
}

TEST(StreamFailure, AServerThatNeverAcceptsIsGivenUpAtTheDeadline) {
  FakeServer server(
      [](grpc::ServerContext& context, FakeServer::Rpc&) { return WaitForCancel(context); });
  const auto stream = Stream::Open(server.address(), {.deadline = kShort});
  EXPECT_EQ(stream.status().code(), absl::StatusCode::kDeadlineExceeded);
  ExpectOneLine(stream.status());
}

TEST(StreamFailure, AServerThatBeginsWithAFrameBreaksTheProtocol) {
  FakeServer server([](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    v1::ReconstructResponse response;
    response.mutable_frame()->set_sequence(1);
    rpc.Write(response);
    return WaitForCancel(context);
  });
  EXPECT_EQ(Stream::Open(server.address(), {}).status().code(), absl::StatusCode::kDataLoss);
}

TEST(StreamFailure, AFrameThatIsNeverAnsweredEndsBothDirectionsAtTheDeadline) {
  FakeServer server([](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    Accept(rpc, 1);
    return WaitForCancel(context);
  });
  const auto stream = Stream::Open(server.address(), {.deadline = kShort});
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  absl::Status sender_status;
  std::thread sender([&] { sender_status = (*stream)->Send(kFrame, 1).status(); });
  Event event;
  const auto received = (*stream)->Receive(event);
  sender.join();
  EXPECT_EQ(received.status().code(), absl::StatusCode::kDeadlineExceeded) << received.status();
  EXPECT_EQ(sender_status.code(), absl::StatusCode::kDeadlineExceeded) << sender_status;
  EXPECT_EQ((*stream)->Receive(event).status().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST(StreamFailure, AServerThatStopsReadingDoesNotHoldTheSenderForever) {
  FakeServer server([](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    Accept(rpc, 64, std::uint64_t{1} << 30);
    return WaitForCancel(context);
  });
  const auto stream = Stream::Open(server.address(), {.deadline = kShort});
  ASSERT_TRUE(stream.ok()) << stream.status();
  const std::vector<double> many(2'000'000, 1.0);  // 16 MB: more than gRPC queues.
  absl::Status status;
  for (int k = 0; k < 64 && status.ok(); ++k) {
    status = (*stream)->Send({.positions = std::span<const double>(many)}, k).status();
  }
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded) << status;
}

TEST(StreamFailure, ASenderWithoutAReceiverIsToldToReceive) {
  FakeServer server(AnswerAll);
  const auto stream = Stream::Open(server.address(), {.deadline = kShort});
  ASSERT_TRUE(stream.ok()) << stream.status();
  absl::Status status;
  for (int k = 0; k < 3; ++k) status = (*stream)->Send(kFrame, k).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_THAT(std::string(status.message()), HasSubstr("call Receive before or beside Send"));
}

TEST(StreamFailure, AnAnswerOutOfOrderIsDataLoss) {
  FakeServer server([](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    Accept(rpc, 2);
    v1::ParticleFrame frame;
    ReadFrame(rpc, frame);
    frame.set_sequence(2);
    rpc.Write(TriangleAt(frame));
    return WaitForCancel(context);
  });
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  Event event;
  const auto received = (*stream)->Receive(event);
  EXPECT_EQ(received.status().code(), absl::StatusCode::kDataLoss) << received.status();
  EXPECT_THAT(std::string(received.status().message()),
              HasSubstr("answered frame 2 where frame 1 was due"));
}

TEST(StreamFailure, AnAnswerWhoseCountsDoNotFitIsDataLoss) {
  FakeServer server([](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    Accept(rpc, 2);
    v1::ParticleFrame frame;
    ReadFrame(rpc, frame);
    v1::ReconstructResponse response = TriangleAt(frame);
    response.mutable_frame()->mutable_rings()->mutable_points()->resize(17);
    rpc.Write(response);
    return WaitForCancel(context);
  });
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  Event event;
  const auto received = (*stream)->Receive(event);
  EXPECT_EQ(received.status().code(), absl::StatusCode::kDataLoss) << received.status();
  ExpectOneLine(received.status());
}

TEST(StreamFailure, AServerThatClosesEarlyLeavesNoFrameSilentlyUnanswered) {
  FakeServer server([](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    Accept(rpc, 2);
    v1::ParticleFrame frame;
    ReadFrame(rpc, frame);
    return grpc::Status::OK;
  });
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  Event event;
  const auto received = (*stream)->Receive(event);
  EXPECT_EQ(received.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(received.status().message()), HasSubstr("1 frames unanswered"));
  EXPECT_EQ((*stream)->Send(kFrame, 1).status().code(), absl::StatusCode::kUnavailable);
}

TEST(StreamFailure, CancelWakesAWaitingReceiver) {
  FakeServer server(AnswerAll);
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  absl::Status status;
  std::thread receiver([&] {
    Event event;
    status = (*stream)->Receive(event).status();
  });
  (*stream)->Cancel();
  receiver.join();
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
}

TEST(StreamFailure, AStreamThatIsDroppedInTheMiddleIsCleanedUp) {
  FakeServer server(AnswerAll);
  for (int k = 0; k < 20; ++k) {
    const auto stream = Stream::Open(server.address(), {});
    ASSERT_TRUE(stream.ok()) << stream.status();
    for (int sent = 0; sent < k % 3; ++sent) ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  }
}

// Servers of before there were surfaces ignore the output.
TEST(StreamFailure, ServerWithoutSurfacesIsRefused) {
  FakeServer server([](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    v1::ReconstructRequest request;
    rpc.Read(&request);
    v1::ReconstructResponse response;
    *response.mutable_opened()->mutable_parameters() = request.open().parameters();
    response.mutable_opened()->mutable_parameters()->clear_output();
    rpc.Write(response);
    return WaitForCancel(context);
  });
  const auto stream =
      Stream::Open(server.address(), {.parameters = {.output = Output::kSurface, .spacing = 1}});
  EXPECT_EQ(stream.status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(std::string(stream.status().message()), HasSubstr("does not support surfaces"));
  ExpectOneLine(stream.status());
}

// Opens a stream to a server that ignores a parameter.
void ExpectRefused(const ReconstructionParameters& parameters,
                   void (*ignore)(v1::ReconstructionParameters&), const std::string& named) {
  FakeServer server([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    v1::ReconstructRequest request;
    rpc.Read(&request);
    v1::ReconstructResponse response;
    auto& opened = *response.mutable_opened()->mutable_parameters();
    opened = request.open().parameters();
    ignore(opened);
    rpc.Write(response);
    return WaitForCancel(context);
  });
  const auto stream = Stream::Open(server.address(), {.parameters = parameters});
  EXPECT_EQ(stream.status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(std::string(stream.status().message()), HasSubstr(named));
  ExpectOneLine(stream.status());
}

TEST(StreamFailure, ServersThatIgnoreAParameterAreRefused) {
  using Message = v1::ReconstructionParameters;
  const PeriodicBox box{.axes = {PeriodicAxis{0, 100}}, .wraps = true};
  ExpectRefused(
      {.spacing = 1, .box = box}, [](Message& m) { m.clear_box(); }, "periodic boxes");
  ExpectRefused(
      {.spacing = 1, .box = box}, [](Message& m) { m.mutable_box()->clear_wraps(); },
      "periodic boxes");
  ExpectRefused(
      {.spacing = 1, .noise_filter = .5}, [](Message& m) { m.clear_noise_filter(); },
      "noise filters");
  ExpectRefused(
      {.sizes = Sizes::kOwn}, [](Message& m) { m.clear_sizes(); }, "own sizes");
  ExpectRefused(
      {.sections = {{.phase = 1}}}, [](Message& m) { m.mutable_sections(0)->clear_phase(); },
      "phases");
  ExpectRefused(
      {.sizes = Sizes::kOwn, .boundary = Boundary::kGrains}, [](Message& m) { m.clear_boundary(); },
      "grains");
  const std::vector<Wall> walls = {{.points = {0, 0, 1, 0}}};
  ExpectRefused(
      {.walls = walls}, [](Message& m) { m.clear_walls(); }, "walls");
  ExpectRefused(
      {.walls = walls}, [](Message& m) { m.mutable_walls(0)->set_points(1, 2); }, "walls");
}

TEST(StreamFailure, AServerWithoutFrameBoxesGetsNone) {
  FakeServer server(AnswerAll);
  const PeriodicBox box{.axes = {PeriodicAxis{0, 100}}};
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_FALSE((*stream)->info().frame_boxes);
  const std::vector<double> positions = {0, 0, 1, 0};
  const auto refused = (*stream)->Send({.positions = std::span(positions), .box = box}, 0);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(std::string(refused.status().message()),
              AllOf(HasSubstr("frame.box"), HasSubstr("newer one"), HasSubstr("frame-boxes")));
  ExpectOneLine(refused.status());
  const auto sent = (*stream)->Send({.positions = std::span(positions)}, 0);
  EXPECT_EQ(sent.value(), 1u) << "the stream continues";
}

TEST(WatchFailure, WaitsOnceForTheStatusAfterTheEnd) {
  constexpr std::chrono::milliseconds kWait(2000), kUntilTheEnd(1500);
  const FakeServer server(AnswerAll, [&](grpc::ServerContext& context, FakeServer::WatchRpc& rpc) {
    v1::WatchStreamResponse response;
    response.mutable_opened()->set_stream_id("fake");
    rpc.Write(response);
    std::this_thread::sleep_for(kUntilTheEnd);
    response.mutable_ended()->set_reason("FINISHED");
    rpc.Write(response);
    return WaitForCancel(context);
  });
  const auto watcher = Watcher::Open(server.address(), "fake", {});
  ASSERT_TRUE(watcher.ok()) << watcher.status();
  const auto start = std::chrono::steady_clock::now();
  WatchedFrame frame;
  const auto received = (*watcher)->Receive(frame, kWait);
  EXPECT_LT(std::chrono::steady_clock::now() - start, kWait + kUntilTheEnd);
  ASSERT_TRUE(received.ok()) << received.status();
  EXPECT_EQ(*received, Received::kNothingYet);
}

TEST(WatchFailure, AServerThatIgnoresCreditsIsCutOff) {
  std::atomic<bool> was_cut_off = false;
  const FakeServer server(AnswerAll, [&](grpc::ServerContext&, FakeServer::WatchRpc& rpc) {
    v1::WatchStreamResponse response;
    response.mutable_opened()->set_stream_id("fake");
    rpc.Write(response);
    v1::ReconstructedFrame& frame = *response.mutable_frame()->mutable_frame();
    frame.set_particles(std::string(1 << 20, 'a'));
    for (int k = 0; k < 1500 && !was_cut_off; ++k) was_cut_off = !rpc.Write(response);
    return grpc::Status::OK;
  });
  const auto watcher = Watcher::Open(server.address(), "fake", {.credits = 3});
  ASSERT_TRUE(watcher.ok()) << watcher.status();
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!was_cut_off && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_TRUE(was_cut_off);
}

TEST(WatchFailure, FramesWithoutCreditBreakTheProtocol) {
  const FakeServer server(AnswerAll, [&](grpc::ServerContext& context, FakeServer::WatchRpc& rpc) {
    v1::WatchStreamResponse response;
    response.mutable_opened()->set_stream_id("fake");
    rpc.Write(response);
    response.mutable_frame();
    for (int k = 0; k < 100 && rpc.Write(response); ++k) {
    }
    return WaitForCancel(context);
  });
  const auto watcher = Watcher::Open(server.address(), "fake", {.credits = 1});
  ASSERT_TRUE(watcher.ok()) << watcher.status();
  std::this_thread::sleep_for(kShort);  // The frames arrive.
  WatchedFrame frame;
  absl::StatusOr<Received> received = Received::kEvent;
  int frames = -1;
  for (; received.ok() && *received == Received::kEvent; ++frames) {
    received = (*watcher)->Receive(frame, std::chrono::seconds(30));
  }
  EXPECT_LE(frames, 3);
  EXPECT_EQ(received.status().code(), absl::StatusCode::kDataLoss) << received.status();
  EXPECT_THAT(std::string(received.status().message()),
              HasSubstr("sent frames without credit: it breaks the protocol"));
}

// Some proxies reset a call instead of delivering its last message or its status.
TEST(WatchFailure, TheReasonEndsTheWatchEvenIfTheStatusIsLost) {
  for (const char* reason : {"FINISHED", "IDLE"}) {
    const FakeServer server(AnswerAll, [&](grpc::ServerContext&, FakeServer::WatchRpc& rpc) {
      v1::WatchStreamResponse response;
      response.mutable_opened()->set_lineage("of the tank");
      rpc.Write(response);
      response.mutable_ended()->set_reason(reason);
      rpc.Write(response);
      return grpc::Status(grpc::StatusCode::CANCELLED, "Received RST_STREAM with error code 8");
    });
    const auto watcher = Watcher::Open(server.address(), "tank", {});
    ASSERT_TRUE(watcher.ok()) << watcher.status();
    WatchedFrame frame;
    const auto received = (*watcher)->Receive(frame);
    ASSERT_TRUE(received.ok()) << received.status();
    EXPECT_EQ(*received, Received::kEnd);
    EXPECT_EQ((*watcher)->end().reason, reason);
  }
}

TEST(WatchFailure, AWatchThatLostTheEndAsksForItAndCountsWhatItMissed) {
  std::atomic<int> calls = 0;
  const FakeServer server(AnswerAll, [&](grpc::ServerContext&, FakeServer::WatchRpc& rpc) {
    v1::WatchStreamRequest request;
    rpc.Read(&request);
    v1::WatchStreamResponse response;
    response.mutable_opened()->set_lineage("of the tank");
    if (calls++ == 0) {
      rpc.Write(response);
      response.mutable_frame()->mutable_frame()->set_sequence(2);
      rpc.Write(response);
      return grpc::Status(grpc::StatusCode::CANCELLED, "Received RST_STREAM with error code 8");
    }
    EXPECT_EQ(request.open().lineage(), "of the tank");
    response.mutable_opened()->set_has_frames(true);
    response.mutable_opened()->set_newest_sequence(5);
    rpc.Write(response);
    // The second call reports the same missed frames as the third one.
    response.mutable_ended()->set_reason(calls == 2 ? "PRODUCER_LOST" : "FINISHED");
    response.mutable_ended()->set_dropped(calls == 2 ? 3 : 0);
    rpc.Write(response);
    return grpc::Status::OK;
  });
  const auto watcher = Watcher::Open(server.address(), "tank", {});
  ASSERT_TRUE(watcher.ok()) << watcher.status();
  WatchedFrame frame;
  ASSERT_EQ((*watcher)->Receive(frame).value(), Received::kEvent);
  ASSERT_EQ(frame.sequence, 2u);
  const auto received = (*watcher)->Receive(frame);
  ASSERT_TRUE(received.ok()) << received.status();
  EXPECT_EQ(*received, Received::kEnd);
  EXPECT_EQ((*watcher)->end().reason, "FINISHED");
  EXPECT_EQ((*watcher)->end().dropped, 3u);
}

TEST(StreamFailure, NoticesDoNotPostponeTheDeadline) {
  FakeServer server([](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    Accept(rpc, 1);
    v1::ReconstructResponse response;
    response.mutable_notice()->set_message("wait");
    while (!context.IsCancelled() && rpc.Write(response)) {
      std::this_thread::sleep_for(kShort / 10);
    }
    return grpc::Status::CANCELLED;
  });
  const auto stream = Stream::Open(server.address(), {.deadline = kShort});
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->Send(kFrame, 0).ok());
  const auto start = std::chrono::steady_clock::now();
  absl::StatusOr<Received> received = Received::kEvent;
  while (received.ok() && std::chrono::steady_clock::now() - start < 50 * kShort) {
    Event event;
    received = (*stream)->Receive(event);
  }
  EXPECT_EQ(received.status().code(), absl::StatusCode::kDeadlineExceeded) << received.status();
}

}  // namespace
}  // namespace partiemc::client
