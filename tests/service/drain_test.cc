// SIGTERM at bad moments: while streams open, with full windows, with clients that never read,
// during frames longer than the grace time, twice. Clients receive complete data, and the server
// stops in time. Drains ten servers under load by default; `--drains 100` for more.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "grpc/health/v1/health.grpc.pb.h"
#include "service/process_clocks.h"
#include "service/server_process.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;
namespace health = grpc::health::v1;

std::uint64_t drains = 10;

// A timeout for hangs only, longer than any grace time here.
constexpr std::chrono::seconds kPatience(60);

class Drain : public ::testing::Test {
 protected:
  void Serve(const std::string& grace_seconds, std::vector<std::string> arguments = {}) {
    arguments.insert(arguments.end(), {"--threads", "2", "--grace-seconds", grace_seconds});
    server_ = std::make_unique<ServingProcess>(std::move(arguments));
  }
  std::shared_ptr<grpc::Channel> Channel() const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);
    return grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(),
                                     arguments);
  }
  void Terminate() { server_->process().Signal(SIGTERM); }
  void ExpectGoodEnd() {
    const auto code = server_->process().WaitFor(kPatience);
    ASSERT_TRUE(code.has_value()) << "it hangs";
    EXPECT_EQ(*code, 0) << server_->process().Output();
    EXPECT_THAT(server_->process().Output(), HasSubstr("stopped"));
  }

  std::unique_ptr<ServingProcess> server_;
};

// Checks what a client of a draining server receives: answers from the first frame on without gaps,
// one notice, the answers to all frames that were read, and UNAVAILABLE.
void StreamUntilTheEnd(const std::shared_ptr<grpc::Channel>& channel, unsigned seed,
                       std::atomic<int>& streaming) {
  const auto expected = LocalDigests(seed, 4);
  StreamClient client(channel);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  ++streaming;
  std::thread writer([&] {
    for (std::uint64_t i = 0; client.Send(BlobRequest(i + 1, seed, i % 4)); ++i) {
    }
  });
  std::uint64_t answers = 0;
  int notices = 0;
  for (;;) {
    const auto answer = client.Receive();
    if (answer.has_frame()) {
      EXPECT_EQ(answer.frame().sequence(), ++answers);
      if (answers <= 4) {
        EXPECT_EQ(answer.frame().rings_digest(), expected[answers - 1].rings);
      }
    } else if (answer.has_notice()) {
      ++notices;
    } else {
      EXPECT_FALSE(answer.has_error()) << answer.error().message();
      break;
    }
  }
  const auto status = client.Finish();
  writer.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
  EXPECT_EQ(client.reason(), "DRAINING") << status.error_message();
  EXPECT_EQ(notices, 1);
}

// The status of the server, of a closed port, or gRPC's for a call at the moment of the shutdown.
void ExpectTurnedAway(const grpc::Status& status) {
  EXPECT_THAT(status.error_code(),
              AnyOf(grpc::StatusCode::UNAVAILABLE, grpc::StatusCode::CANCELLED))
      << status.error_message();
}

TEST_F(Drain, UnderLoadEveryStreamGetsItsAnswersTheNoticeAndTheStatus) {
  constexpr unsigned kSeed = 5, kStreams = 8;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  for (std::uint64_t round = 0; round < drains; ++round) {
    Serve("30");
    std::vector<std::thread> clients;
    std::atomic<int> streaming = 0;
    for (unsigned i = 0; i < kStreams; ++i) {
      clients.emplace_back([&, i] { StreamUntilTheEnd(Channel(), i, streaming); });
    }
    while (streaming < static_cast<int>(kStreams)) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 50'000));
    Terminate();
    for (std::thread& client : clients) client.join();
    ExpectGoodEnd();
  }
}

TEST_F(Drain, WhileStreamsOpenEachIsServedOrToldToGoElsewhere) {
  Serve("30");
  std::vector<std::thread> clients;
  std::atomic<std::uint64_t> opened = 0;
  for (unsigned i = 0; i < 6; ++i) {
    clients.emplace_back([&] {
      const auto channel = Channel();
      for (;;) {
        StreamClient client(channel);
        const bool has_opened = client.SendAndReceive(OpenRequest()).has_opened();
        if (has_opened) ++opened;
        client.HalfClose();
        const auto status = client.Finish();
        if (status.ok()) continue;
        if (has_opened) {
          EXPECT_EQ(client.reason(), "DRAINING") << status.error_message();
        }
        ExpectTurnedAway(status);
        return;
      }
    });
  }
  while (opened < 50) std::this_thread::yield();
  Terminate();
  for (std::thread& client : clients) client.join();
  ExpectGoodEnd();
}

TEST_F(Drain, ACallThatHasNotOpenedIsToldToGoElsewhere) {
  Serve("30");
  StreamClient before(Channel());
  StreamClient other(Channel());
  ASSERT_TRUE(other.SendAndReceive(OpenRequest()).has_opened());
  Terminate();
  for (StreamClient* client : {&before, &other}) {
    EXPECT_EQ(client->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  }
  EXPECT_EQ(other.reason(), "DRAINING");
  ExpectGoodEnd();
}

// Streams are redirected one after the other, while new ones are served.
TEST_F(Drain, ADelaySendsStreamsAwayOneByOneAndServesOn) {
  constexpr unsigned kStreams = 5;
  Serve("30", {"--drain-delay", "3"});
  std::vector<std::unique_ptr<StreamClient>> clients;
  for (unsigned i = 0; i < kStreams; ++i) {
    clients.push_back(std::make_unique<StreamClient>(Channel()));
    ASSERT_TRUE(clients.back()->SendAndReceive(OpenRequest()).has_opened());
  }
  const auto health_stub = health::Health::NewStub(Channel());
  const auto is_serving = [&] {
    grpc::ClientContext context;
    health::HealthCheckResponse response;
    return health_stub->Check(&context, {}, &response).ok() &&
           response.status() == health::HealthCheckResponse::SERVING;
  };
  ASSERT_TRUE(is_serving());
  Terminate();
  while (is_serving()) std::this_thread::yield();
  // Not ready, but still serving.
  EXPECT_TRUE(clients.back()->SendAndReceive(BlobRequest(1, 3, 0)).has_frame());
  StreamClient late(Channel());
  for (const auto& client : clients) {
    EXPECT_TRUE(client->Receive().has_notice());
    EXPECT_EQ(client->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(client->reason(), "DRAINING");
    if (client == clients.front()) {
      EXPECT_TRUE(late.SendAndReceive(OpenRequest()).has_opened());
      EXPECT_TRUE(late.SendAndReceive(BlobRequest(1, 3, 0)).has_frame());
    }
  }
  EXPECT_TRUE(late.Receive().has_notice());
  EXPECT_EQ(late.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  ExpectGoodEnd();
}

// Clients with full windows that never read a response.
TEST_F(Drain, ClientsThatNeverReadAreCutInTime) {
  for (const char* budget : {"1GB", "1"}) {
    Serve("0.5", {"--memory-budget", budget});
    std::vector<std::unique_ptr<StreamClient>> clients;
    std::vector<std::thread> writers;
    std::atomic<std::uint64_t> sent = 0;
    for (unsigned i = 0; i < 4; ++i) {
      clients.push_back(std::make_unique<StreamClient>(Channel()));
      ASSERT_TRUE(clients.back()->SendAndReceive(OpenRequest()).has_opened());
      writers.emplace_back([&sent, &client = *clients.back(), i] {
        for (std::uint64_t k = 1; client.Send(BlobRequest(k, i, k % 3)); ++k) ++sent;
      });
    }
    // Counts as full when no more is accepted for a while. The test is valid in either case.
    for (std::uint64_t last = 0; last != sent || sent == 0;) {
      last = sent;
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
    Terminate();
    ExpectGoodEnd();
    for (std::thread& writer : writers) writer.join();
    for (const auto& client : clients) EXPECT_FALSE(client->Finish().ok());
  }
}

// A frame that takes long: each vertex is within reach of all its particles.
v1::ReconstructRequest LongFrame() {
  constexpr std::size_t kParticles = 4'000'000;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> anywhere(0, 1);
  std::vector<float> positions(2 * kParticles);
  for (float& coordinate : positions) coordinate = anywhere(random);
  v1::ReconstructRequest request;
  request.mutable_frame()->set_sequence(1);
  request.mutable_frame()->set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  request.mutable_frame()->set_positions(positions.data(), positions.size() * sizeof(float));
  return request;
}

v1::ReconstructRequest OpenForLongFrames() {
  auto open = OpenRequest("long");
  auto& parameters = *open.mutable_open()->mutable_parameters();
  parameters.set_spacing(1);
  parameters.set_kernel_radius(8);
  parameters.set_cell_size(0.25);
  return open;
}

// Neither this frame nor its client delays the server beyond the grace time.
TEST_F(Drain, AFrameThatOutlastsTheGraceTimeDoesNotHoldTheServer) {
  Serve("0.2", {"--max-particles", "4000000", "--max-frame-bytes", "100MB"});
  StreamClient client(Channel());
  ASSERT_TRUE(client.SendAndReceive(OpenForLongFrames()).has_opened());
  const auto frame = LongFrame();
  const double before_ms = ProcessCpuMs(server_->process().process());
  ASSERT_TRUE(client.Send(frame));
  // Ensures that it is being computed: reading it takes a tenth of a second.
  while (ProcessCpuMs(server_->process().process()) < before_ms + 500) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  Terminate();
  const auto code = server_->process().WaitFor(kPatience);
  ASSERT_TRUE(code.has_value()) << "it hangs";
  // 0 if the frame was cancelled in time, 1 if the process was cut off.
  if (*code != 0) {
    EXPECT_EQ(*code, 1);
    EXPECT_THAT(server_->process().Output(), HasSubstr("cut off"));
  }
  for (auto answer = client.Receive(); answer.response_case() != 0; answer = client.Receive()) {
    EXPECT_FALSE(answer.has_frame()) << "it is too short";
  }
}

TEST_F(Drain, ASecondSignalLeavesAtOnceWithItsNumber) {
  for (const int second : {SIGTERM, SIGINT}) {
    Serve("3600");
    StreamClient client(Channel());
    ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
    // Its response is not read, so the drain would wait for an hour.
    std::atomic<bool> stop = false;
    std::atomic<std::uint64_t> sent = 0;
    std::thread writer([&] {
      for (std::uint64_t k = 1; !stop && client.Send(BlobRequest(k, 1, k % 3)); ++k) sent = k;
    });
    // Until no frame is accepted, so that answers wait in the server.
    std::uint64_t before = 0;
    do {
      before = sent;
      std::this_thread::sleep_for(std::chrono::seconds(1));
    } while (sent == 0 || sent != before);
    Terminate();
    server_->process().Signal(SIGINT);  // At the same time, so it counts as the same signal.
    while (server_->process().Output().find("draining") == std::string::npos) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
    EXPECT_THAT(server_->process().Output(), Not(HasSubstr("cut off")));
    server_->process().Signal(second);
    EXPECT_EQ(server_->process().WaitFor(kPatience), 128 + second);
    EXPECT_THAT(server_->process().Output(), HasSubstr("cut off"));
    stop = true;
    writer.join();
  }
}

TEST_F(Drain, AHangupEndsNothing) {
  Serve("3600");
  server_->process().Signal(SIGHUP);
  while (server_->process().Output().find("Hangup") == std::string::npos) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  StreamClient client(Channel());
  EXPECT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
}

// Idle clients without a call.
TEST_F(Drain, IdleConnectionsAreNotWaitedFor) {
  Serve("3600");
  const auto idle = Channel();
  InfoOf(idle);
  Terminate();
  ExpectGoodEnd();
}

// Peers that send SETTINGS and do not read the acknowledgements, so that gRPC cannot write.
TEST_F(Drain, PeersThatReadNoAcknowledgementsAreNotWaitedFor) {
  Serve("4");
  const std::string address = server_->address();
  const auto port = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
  std::atomic<bool> stop = false;
  std::vector<std::thread> peers;
  for (int i = 0; i < 3; ++i) {
    peers.emplace_back([&] {
      const std::string header("\0\0\6\4\0\0\0\0\0", 9), setting("\0\3\0\0\0\x64", 6);
      std::string all = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + std::string("\0\0\0\4\0\0\0\0\0", 9);
      for (int k = 0; k < 200'000; ++k) all += header + setting;
      const int file = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      const int little = 4096;
      setsockopt(file, SOL_SOCKET, SO_RCVBUF, &little, sizeof(little));
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_port = htons(port);
      to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      connect(file, reinterpret_cast<const sockaddr*>(&to), sizeof(to));
      for (std::size_t sent = 0; !stop;) {
        const auto count =
            send(file, all.data() + sent, all.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (count > 0) sent += static_cast<std::size_t>(count);
        if (count <= 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
      close(file);
    });
  }
  std::this_thread::sleep_for(std::chrono::seconds(2));
  Terminate();
  ExpectGoodEnd();
  stop = true;
  for (auto& peer : peers) peer.join();
}

TEST_F(Drain, CallsOfOneFrameThatGoOnAreAnswered) {
  Serve("30");
  v1::ReconstructFrameRequest request;
  *request.mutable_parameters() = OpenRequest().open().parameters();
  *request.mutable_frame() = BlobRequest(0, 1, 0).frame();
  const auto expected = LocalDigests(1, 1);
  std::vector<std::thread> clients;
  std::atomic<std::uint64_t> answered = 0;
  for (unsigned i = 0; i < 4; ++i) {
    clients.emplace_back([&] {
      const auto stub = v1::ReconstructionService::NewStub(Channel());
      for (;;) {
        TimedContext context;
        v1::ReconstructFrameResponse response;
        const auto status = stub->ReconstructFrame(&context, request, &response);
        if (!status.ok()) {
          ExpectTurnedAway(status);
          return;
        }
        ++answered;
        EXPECT_EQ(response.frame().rings_digest(), expected[0].rings);
      }
    });
  }
  while (answered < 20) std::this_thread::yield();
  Terminate();
  for (std::thread& client : clients) client.join();
  ExpectGoodEnd();
}

}  // namespace
}  // namespace partiemc::server

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  CLI::App app("Drains servers at bad moments.");
  app.add_option("--drains", partiemc::server::drains, "Servers to drain under load")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return RUN_ALL_TESTS();
}
