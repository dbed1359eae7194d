// The log of the server process: it contains no secrets, and nothing waits for it.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <string>

#include "service/server_process.h"
#include "service/service_testing.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kToken[] = "alice-secret-0123456789";

// A timeout for hangs only.
constexpr std::chrono::seconds kPatience(60);

std::shared_ptr<grpc::Channel> Channel(const ServingProcess& server) {
  return grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials());
}

// Opens a stream with the token, answers a frame, resumes by the stream token; returns that token.
std::string Stream(const ServingProcess& server, const char* token) {
  const auto stub = v1::ReconstructionService::NewStub(Channel(server));
  std::string stream_token;
  for (int call = 0; call < 2; ++call) {
    TimedContext context;
    context.AddMetadata("authorization", std::string("Bearer ") + token);
    const auto stream = stub->Reconstruct(&context);
    v1::ReconstructRequest open = OpenRequest("tank");
    if (call > 0) open.mutable_open()->mutable_resume()->set_stream_token(stream_token);
    v1::ReconstructResponse answer;
    EXPECT_TRUE(stream->Write(open) && stream->Read(&answer) && answer.has_opened());
    stream_token = answer.opened().stream_token();
    EXPECT_TRUE(stream->Write(BlobRequest(1, 1, 0)) && stream->Read(&answer));
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
  }
  return stream_token;
}

// gRPC prints metadata and bytes as text and in hexadecimal.
TEST(Log, HasNoTokenAlthoughEveryTraceOfGrpcIsAskedFor) {
  const support::TemporaryFolder folder;
  const std::string tokens = folder.Write("tokens", std::string(kToken) + "\n");
  for (const char* level : {"debug", "trace"}) {
    ServingProcess server({"--token-file", tokens, "--log-level", level},
                          {.environment = {"GRPC_TRACE=all", "GRPC_VERBOSITY=debug"}});
    const std::string stream_token = Stream(server, kToken);
    ASSERT_EQ(stream_token.size(), 32u);
    server.process().Signal(SIGTERM);
    ASSERT_EQ(server.process().WaitFor(kPatience), 0);
    const std::string log = server.process().Output();
    EXPECT_THAT(log, AllOf(HasSubstr("stream opened"), HasSubstr("GRPC_TRACE ignored")));
    for (const std::string& secret : {std::string(kToken), stream_token}) {
      EXPECT_THAT(log, Not(HasSubstr(secret)));
      std::string bytes;  // In gRPC's format: "61 6c 69 ".
      for (const char c : secret) {
        for (const int half : {c >> 4, c & 15}) bytes += "0123456789abcdef"[half];
        bytes += ' ';
      }
      EXPECT_THAT(log, Not(HasSubstr(bytes.substr(0, 24))));
    }
    EXPECT_LT(log.size(), 5'000u);  // Contains no traces.
  }
}

TEST(Log, NamesVariablesThatSetNoOption) {
  ServingProcess server(
      {}, {.environment = {"PARTIEMC_VERSION=value-of-it", "PARTIEMC_SERVICE_HOST=10.0.0.11"}});
  server.process().Signal(SIGTERM);
  ASSERT_EQ(server.process().WaitFor(kPatience), 0);
  EXPECT_THAT(server.process().Output(),
              AllOf(HasSubstr("variable ignored name=PARTIEMC_VERSION"),
                    Not(HasSubstr("value-of-it")), Not(HasSubstr("PARTIEMC_SERVICE_HOST"))));
}

class LogPipe : public ::testing::Test {
 protected:
  LogPipe() {
    EXPECT_EQ(pipe2(ends_, O_CLOEXEC), 0);
    EXPECT_GE(fcntl(ends_[1], F_SETPIPE_SZ, 4096), 4096);
  }
  ~LogPipe() override {
    close(ends_[0]);
    close(ends_[1]);
  }

  int ends_[2] = {-1, -1};
};

// A hundred lines of more than a hundred bytes, into a pipe of 4 KiB.
TEST_F(LogPipe, ThatNobodyReadsHoldsUpNeitherStreamsNorTheDrain) {
  ServingProcess server({"--grace-seconds", "60"}, {.standard_error = ends_[1]});
  const auto channel = Channel(server);
  for (int k = 0; k < 50; ++k) {
    StreamClient client(channel);
    ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
    client.HalfClose();
    ASSERT_TRUE(client.Finish().ok());
  }
  server.process().Signal(SIGTERM);
  EXPECT_EQ(server.process().WaitFor(kPatience), 0);
}

TEST_F(LogPipe, WhoseReaderHasGoneIsNoEnd) {
  ServingProcess server({}, {.standard_error = ends_[1]});
  close(ends_[1]);
  close(ends_[0]);
  ends_[0] = ends_[1] = -1;
  StreamClient client(Channel(server));
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  ASSERT_TRUE(client.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
  server.process().Signal(SIGTERM);
  EXPECT_EQ(server.process().WaitFor(kPatience), 0);
}

}  // namespace
}  // namespace partiemc::server
