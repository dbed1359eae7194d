// Excess that the server refuses: too many streams, calls and bytes, and clients that keep it
// waiting.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;

// A silent period, longer than a busy machine delays a client.
constexpr milliseconds kIdle(500);
using ::testing::HasSubstr;

class Overload : public ::testing::TestWithParam<Transport> {
 protected:
  // Starts the server with these limits.
  void Serve(const ServerLimits& limits) {
    ServerOptions options = TestOptions();
    options.limits = limits;
    server_ = StartServer(options);
    channel_ = Connect(*server_, GetParam());
  }
  v1::GetServerInfoResponse Info() { return InfoOf(channel_); }

  ServerLimits limits_ = TestOptions().limits;
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

INSTANTIATE_TEST_SUITE_P(Over, Overload, ::testing::Values(Transport::kInProcess, Transport::kTcp),
                         [](const auto& test) { return TransportName(test.param); });

TEST_P(Overload, ACallThatNeverOpensIsEndedAndToldWhy) {
  limits_.idle = {.opening = kIdle, .streaming = {}};
  Serve(limits_);
  StreamClient client(channel_);
  const auto status = client.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(client.reason(), "IDLE");
  EXPECT_THAT(status.error_message(), HasSubstr("sends no `open` for 0.5 s"));
}

TEST_P(Overload, AStreamWithoutAFrameIsEndedAndToldWhyAndItsNameIsFree) {
  limits_.idle = {.opening = {}, .streaming = kIdle};
  Serve(limits_);
  for (int i = 0; i < 2; ++i) {
    StreamClient client(channel_);
    const auto answer = client.SendAndReceive(OpenRequest("idle"));
    ASSERT_TRUE(answer.has_opened());
    EXPECT_EQ(answer.opened().limits().idle_timeout_seconds(), 1u) << "rounded up";
    const auto status = client.Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    EXPECT_EQ(client.reason(), "IDLE");
    EXPECT_THAT(status.error_message(), HasSubstr("sends no frame for 0.5 s"));
  }
  EXPECT_EQ(Info().open_streams(), 0u);
}

TEST_P(Overload, AClientThatTakesNoAnswersIsCut) {
  limits_.idle = {.opening = {}, .streaming = 2 * kIdle};
  Serve(limits_);
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  // Sends until no buffer accepts more, and then until the server ends the stream.
  for (std::uint64_t i = 1; client.Send(BlobRequest(i, 1, i % 3)); ++i) {
  }
  EXPECT_EQ(client.Finish().error_code(), grpc::StatusCode::CANCELLED);
  // The client may see the end before the server has finished it.
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (Info().open_streams() > 0) ASSERT_LT(std::chrono::steady_clock::now(), give_up);
}

TEST_P(Overload, WithoutAnyBudgetStreamsGoOnFrameByFrameWithTheSameResults) {
  limits_.memory_budget = 1;
  Serve(limits_);
  const auto expected = LocalDigests(2, 10);
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&] { EXPECT_EQ(StreamedDigests(channel_, 2, 10), expected); });
  }
  for (std::thread& client : clients) client.join();
}

TEST_P(Overload, ACallThatTheBudgetHasNoRoomForIsRefusedAtOnceWithTheWayOut) {
  limits_.memory_budget = 100;
  limits_.history_bytes = 0;  // It shares the budget.
  Serve(limits_);
  v1::ReconstructFrameRequest request;
  *request.mutable_parameters() = OpenRequest().open().parameters();
  *request.mutable_frame() = BlobRequest(0, 1, 0).frame();
  TimedContext context;
  v1::ReconstructFrameResponse response;
  const auto status =
      v1::ReconstructionService::NewStub(channel_)->ReconstructFrame(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(context), "MEMORY_BUDGET");
  EXPECT_THAT(status.error_message(), HasSubstr("100 bytes"));
  EXPECT_THAT(status.error_message(), HasSubstr("--memory-budget"));
}

// Begins calls of both kinds of streams and cancels them at once, several at a time.
void BeginAndCancel(const std::shared_ptr<grpc::Channel>& channel, int calls) {
  std::vector<std::thread> clients;
  for (int k = 0; k < 4; ++k) {
    clients.emplace_back([&] {
      for (int i = 0; i < calls; ++i) {
        StreamClient stream(channel);
        WatchClient watch(channel);
        stream.Cancel();
        watch.Cancel();
      }
    });
  }
  for (std::thread& client : clients) client.join();
}

// A refusal and a cancellation once both ended the call; gRPC aborts the process at the second end.
TEST_P(Overload, CallsThatAreCancelledWhileTheyGiveWayEndOnce) {
  limits_.max_streams = 1;
  limits_.max_watchers = 0;
  Serve(limits_);
  // Takes all slots of calls without a request, so that each new call evicts another.
  std::vector<std::unique_ptr<StreamClient>> opening(limits_.MaxOpeningCalls());
  for (auto& client : opening) client = std::make_unique<StreamClient>(channel_);
  BeginAndCancel(channel_, 500);
  for (const auto& client : opening) client->Cancel();
  EXPECT_TRUE(Eventually([&] {
    StreamClient client(channel_);
    return client.SendAndReceive(OpenRequest()).has_opened();
  }));
}

TEST_P(Overload, CallsThatAreCancelledWhileTheServerDrainsEndOnce) {
  Serve(limits_);
  StreamClient held(channel_);
  ASSERT_TRUE(held.SendAndReceive(OpenRequest()).has_opened());
  // gRPC's in-process channel does not survive calls after its server was destroyed.
  const auto calling = Connect(*server_, Transport::kTcp);
  std::atomic<bool> stop = false;
  std::thread caller([&] {
    while (!stop) BeginAndCancel(calling, 20);
  });
  server_->Drain(std::chrono::seconds(10));
  stop = true;
  caller.join();
  EXPECT_EQ(held.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

}  // namespace
}  // namespace partiemc::server
