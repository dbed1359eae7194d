// What a server does not take: streams, calls and bytes too many, clients that keep it waiting.
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

// A time in which nothing comes. Longer than a busy machine keeps a client from its turn.
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
  v1::GetServerInfoResponse Info() {
    grpc::ClientContext context;
    SetDeadline(context);
    v1::GetServerInfoResponse info;
    EXPECT_TRUE(
        v1::ReconstructionService::NewStub(channel_)->GetServerInfo(&context, {}, &info).ok());
    return info;
  }

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
  // Until no buffer takes any more, and then until the server has had enough.
  for (std::uint64_t i = 1; client.Send(BlobRequest(i, 1, i % 3)); ++i) {
  }
  EXPECT_EQ(client.Finish().error_code(), grpc::StatusCode::CANCELLED);
  // It may see that before the server has seen it through.
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
  Serve(limits_);
  v1::ReconstructFrameRequest request;
  *request.mutable_parameters() = OpenRequest().open().parameters();
  *request.mutable_frame() = BlobRequest(0, 1, 0).frame();
  grpc::ClientContext context;
  SetDeadline(context);
  v1::ReconstructFrameResponse response;
  const auto status =
      v1::ReconstructionService::NewStub(channel_)->ReconstructFrame(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(context), "MEMORY_BUDGET");
  EXPECT_THAT(status.error_message(), HasSubstr("100 bytes"));
  EXPECT_THAT(status.error_message(), HasSubstr("--memory-budget"));
}

TEST_P(Overload, AsManyCallsAsStreamsMayBeOpeningAndOneMoreIsRefusedAtOnce) {
  limits_.max_streams = 2;
  limits_.idle = {};
  Serve(limits_);
  // Which of them comes last is the network's choice; that one ends, the others wait for `open`.
  std::vector<std::unique_ptr<StreamClient>> clients;
  std::vector<std::thread> waiting;
  std::atomic<int> refused = 0;
  std::promise<void> one_was;
  for (int i = 0; i < 3; ++i) clients.push_back(std::make_unique<StreamClient>(channel_));
  for (const auto& client : clients) {
    waiting.emplace_back([&] {
      const auto status = client->Finish();
      if (status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED) return;
      EXPECT_EQ(client->reason(), "TOO_MANY_STREAMS");
      EXPECT_THAT(status.error_message(), HasSubstr("2 opening"));
      if (++refused == 1) one_was.set_value();
    });
  }
  EXPECT_EQ(one_was.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  for (const auto& client : clients) client->Cancel();
  for (std::thread& thread : waiting) thread.join();
  EXPECT_EQ(refused, 1);
}

}  // namespace
}  // namespace partiemc::server
