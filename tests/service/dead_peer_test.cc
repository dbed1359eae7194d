// Clients that disappear without closing their connection: their resources are freed.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <thread>

#include "service/service_testing.h"
#include "support/chaos_proxy.h"

namespace partiemc::server {
namespace {

std::shared_ptr<grpc::Channel> Through(const support::ChaosProxy& proxy) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(proxy.address(), grpc::InsecureChannelCredentials(), arguments);
}

std::uint32_t OpenStreams(Server& server) {
  const v1::GetServerInfoResponse info = InfoOf(Connect(server, Transport::kTcp));
  return info.open_streams() + info.load().watchers();
}

TEST(DeadPeer, TheNameOfAProducerThatVanishedIsFree) {
  EXPECT_LE(Keepalive().interval + Keepalive().timeout, std::chrono::seconds(30));
  ServerOptions options = TestOptions();
  options.keepalive = {.interval = std::chrono::milliseconds(200),
                       .timeout = std::chrono::milliseconds(300)};
  const auto server = StartServer(options);
  support::ChaosProxy proxy(server->address().ToString());
  StreamClient vanishing(Through(proxy));
  ASSERT_TRUE(vanishing.SendAndReceive(OpenRequest("tank")).has_opened());
  WatchClient watcher(Through(proxy), "tank", v1::WATCH_MODE_LATEST, 1);
  ASSERT_TRUE(watcher.Receive().has_opened());
  ASSERT_EQ(OpenStreams(*server), 2u);
  proxy.HalfOpen();
  EXPECT_TRUE(Eventually([&] { return OpenStreams(*server) == 0; }));
  StreamClient next(Connect(*server, Transport::kTcp));
  EXPECT_TRUE(next.SendAndReceive(OpenRequest("tank")).has_opened());
  vanishing.Cancel();
  watcher.Cancel();
}

// A live client is kept, however long it is idle.
TEST(DeadPeer, AnIdleProducerGoesOn) {
  ServerOptions options = TestOptions();
  options.keepalive = {.interval = std::chrono::milliseconds(50),
                       .timeout = std::chrono::seconds(60)};
  const auto server = StartServer(options);
  StreamClient client(Connect(*server, Transport::kTcp));
  ASSERT_TRUE(client.SendAndReceive(OpenRequest("tank")).has_opened());
  std::this_thread::sleep_for(std::chrono::seconds(2));
  EXPECT_TRUE(client.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
}

}  // namespace
}  // namespace partiemc::server
