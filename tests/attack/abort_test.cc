// Calls that end at the moment of their refusal. gRPC aborts the process if a call is finished
// twice.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "attack/attacked_server.h"
#include "attack/http2_client.h"
#include "attack/requests.h"

namespace partiemc::attack {
namespace {

constexpr std::chrono::seconds kAbortPatience(20);

// A call that is begun and cancelled in the same packet as its neighbours.
void QueueCancelled(Http2Client& client, const char* method, const Headers& more = {}) {
  client.Reset(client.Call(CallHeaders(method, more)));
}

// An open stream; it holds its name and slot while the client is connected.
void HoldStream(Http2Client& client, const std::string& name) {
  bool opened = false;
  client.OnFrame([&](const ReceivedFrame& frame) { opened |= frame.type == FrameType::kData; });
  client.Data(client.Call(CallHeaders(kReconstruct)), Prefixed(Open(name).SerializeAsString()));
  client.Flush(kAbortPatience);
  EXPECT_TRUE(client.Read(kAbortPatience, [&] { return opened; })) << "no stream to hold";
  client.OnFrame(nullptr);
}

// Cancels calls, `at_once` per packet, until `calls` were made or the server has died.
std::uint64_t CancelCalls(AttackedServer& server, const char* method, std::uint64_t calls,
                          std::uint64_t at_once) {
  std::uint64_t begun = 0;
  std::unique_ptr<Http2Client> client;
  while (begun < calls && server.Lives()) {
    if (!client || client->closed()) client = std::make_unique<Http2Client>(server.address());
    for (std::uint64_t k = 0; k < at_once; ++k, ++begun) QueueCancelled(*client, method);
    client->Flush(kAbortPatience);
    client->Read(std::chrono::milliseconds(1));
  }
  return begun;
}

class FullServer : public ::testing::TestWithParam<const char*> {
 protected:
  FullServer() {
    HoldStream(held_, "one");
    HoldStream(held_, "two");
    // Watchers above the limit are refused, too.
    held_.Data(held_.Call(CallHeaders(kWatchStream)),
               Prefixed(Watch("one", 1).SerializeAsString()));
    held_.Flush(kAbortPatience);
  }

  AttackedServer server_{{"--max-streams", "2", "--max-watchers", "1", "--grace-seconds", "0.5"}};
  Http2Client held_{server_.address()};
};

TEST_P(FullServer, OneCallAfterTheOther) {
  const std::uint64_t begun = CancelCalls(server_, GetParam(), 500, 1);
  EXPECT_TRUE(server_.Lives()) << "dead after " << begun << " calls: " << server_.Output();
  EXPECT_EQ(server_.Terminate(), 0);
}

TEST_P(FullServer, FiveInOnePacket) {
  for (int k = 0; k < 20 && server_.Lives(); ++k) CancelCalls(server_, GetParam(), 5, 5);
  EXPECT_TRUE(server_.Lives()) << server_.Output();
  EXPECT_EQ(server_.Terminate(), 0);
}

class DrainingServer : public ::testing::TestWithParam<const char*> {};

TEST_P(DrainingServer, RefusesAndCancelsAtOnce) {
  for (int drain = 0; drain < 4; ++drain) {
    AttackedServer server({"--grace-seconds", "1"});
    Http2Client client(server.address());
    HoldStream(client, "held");
    server.process().Signal(SIGTERM);
    for (int k = 0; k < 400 && !client.closed(); ++k) {
      QueueCancelled(client, GetParam());
      client.Flush(kAbortPatience);
      client.Read(std::chrono::milliseconds(1));
    }
    // Not by a second signal, which would end it at once.
    EXPECT_EQ(server.process().WaitFor(kAbortPatience), 0) << server.Output();
  }
}

class DefaultLimits : public ::testing::TestWithParam<const char*> {};

TEST_P(DefaultLimits, AHundredAtATime) {
  AttackedServer server;
  const std::uint64_t begun = CancelCalls(server, GetParam(), 8'000, 100);
  EXPECT_TRUE(server.Lives()) << "dead after " << begun << " calls: " << server.Output();
  EXPECT_EQ(server.GaugesNotAtZero(kAbortPatience), "");
  EXPECT_EQ(server.Terminate(), 0);
}

std::string MethodName(const ::testing::TestParamInfo<const char*>& method) {
  const std::string path = method.param;
  const std::string name = path.substr(path.rfind('/') + 1);
  return name == "Watch" ? "HealthWatch" : name;
}

INSTANTIATE_TEST_SUITE_P(Methods, FullServer,
                         ::testing::Values(kReconstruct, kReconstructFrame, kWatchStream),
                         MethodName);
INSTANTIATE_TEST_SUITE_P(Methods, DrainingServer,
                         ::testing::Values(kReconstruct, kReconstructFrame, kWatchStream),
                         MethodName);
INSTANTIATE_TEST_SUITE_P(Methods, DefaultLimits,
                         ::testing::Values(kReconstruct, kReconstructFrame, kWatchStream,
                                           kListStreams, kHealthWatch),
                         MethodName);

}  // namespace
}  // namespace partiemc::attack
