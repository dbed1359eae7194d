// SIGTERM at bad moments: while streams open, with full windows, with clients that never read, more
// than once. The server leaves with 0 each time, and what clients got is whole. Ten servers are
// drained under load by default, `--drains 100` for more.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "service/server_process.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

std::uint64_t drains = 10;

// Only against hanging: far beyond any grace time here.
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

// What a client of a server that goes away has to get: answers from the first frame on, none left
// out, the notice once, the answers to what had been read, and UNAVAILABLE.
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

// The server's own word, or that nobody listens any more, or gRPC's for a call that comes in the
// moment in which it stops.
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
  Serve("3");  // A connection that its client does not look after takes that long to close.
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

// Clients whose windows are full and who never read an answer.
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
    // Full once nothing more is taken for a while; the test is good whether it is or not.
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

TEST_F(Drain, FurtherSignalsChangeNothing) {
  Serve("30");
  std::atomic<int> streaming = 0;
  std::thread client([&] { StreamUntilTheEnd(Channel(), 1, streaming); });
  while (streaming == 0) std::this_thread::yield();
  Terminate();
  for (const int signal : {SIGTERM, SIGINT, SIGTERM}) server_->process().Signal(signal);
  client.join();
  ExpectGoodEnd();
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
        grpc::ClientContext context;
        SetDeadline(context);
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
