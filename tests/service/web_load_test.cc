// Worst-case memory of the gateway, in a separate server process: clients hold half-open sockets,
// announce bytes that they never send, or stop reading.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "service/server_process.h"
#include "service/service_testing.h"
#include "service/web_client.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

// A server with a gateway, as a process.
class WebLoad : public ::testing::Test {
 protected:
  WebLoad() {
    rlimit limit{};
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
  }

  void Serve(std::vector<std::string> arguments = {}) {
    arguments.insert(arguments.end(), {"--threads", "2", "--web", "127.0.0.1:0", "--web-port-file",
                                       folder_.Path("web")});
    server_ = std::make_unique<ServingProcess>(std::move(arguments));
    ASSERT_TRUE(Eventually([&] { return !FileText(folder_.Path("web")).empty(); }));
    const std::string text = FileText(folder_.Path("web"));
    web_ = *ParseAddress(text.substr(0, text.find('\n')));
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
  }
  double Mib() const { return server_->process().ResidentMib(); }

  const support::TemporaryFolder folder_;
  std::unique_ptr<ServingProcess> server_;
  Address web_;
  std::shared_ptr<grpc::Channel> channel_;
};

v1::WatchStreamRequest OpenWatch(v1::WatchMode mode, std::uint32_t credits) {
  v1::WatchStreamRequest request;
  request.mutable_open()->set_stream_name("tank");
  request.mutable_open()->set_mode(mode);
  request.mutable_open()->set_credits(credits);
  return request;
}

TEST_F(WebLoad, TwoThousandHalfOpenSocketsTakeLittleAndDisturbNobody) {
  Serve();
  StreamClient producer(channel_);
  ASSERT_TRUE(producer.SendAndReceive(OpenRequest("tank")).has_opened());
  WebSocketClient watcher(web_, "/v1/watch");
  watcher.SendMessage(OpenWatch(v1::WATCH_MODE_EVERY, 100'000));
  ASSERT_TRUE(watcher.Receive<v1::WatchStreamResponse>().has_opened());
  ASSERT_TRUE(producer.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
  ASSERT_TRUE(watcher.Receive<v1::WatchStreamResponse>().has_frame());
  const double before = Mib();
  double most = before;
  std::vector<std::unique_ptr<WebPipe>> silent;
  // Half a header of the maximum size.
  const std::string half = "GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(16'000, 'x');
  for (std::uint64_t i = 0; i < 2000; ++i) {
    silent.push_back(std::make_unique<WebPipe>(web_));
    if (i % 2 == 0) silent.back()->Send(half);
    if (i % 50 != 0) continue;
    most = std::max(most, Mib());
    ASSERT_TRUE(producer.SendAndReceive(BlobRequest(2 + i / 50, 1, i % 7)).has_frame());
    ASSERT_TRUE(watcher.Receive<v1::WatchStreamResponse>().has_frame());
    EXPECT_EQ(Ask(web_, "GET", "/v1/healthz").body, "ok\n");
    EXPECT_EQ(Post(web_, "/v1/info", "").status, 200u);
  }
  most = std::max(most, Mib());
  RecordProperty("mib", std::to_string(most - before));
  // 128 connections of one address, each with a header and its own memory.
  EXPECT_LT(most - before, 16);
  EXPECT_LT(server_->process().OpenFileCount(), 350u);
}

TEST_F(WebLoad, WhatIsAnnouncedTakesNoMemory) {
  Serve();
  const double before = Mib();
  std::vector<std::unique_ptr<WebSocketClient>> clients;
  const std::string head =
      std::string("\x82\xff\0\0\0\0", 6) + "\x3b\x9a\xca" + std::string(1, '\0');
  for (int i = 0; i < 30; ++i) {
    clients.push_back(std::make_unique<WebSocketClient>(web_, "/v1/reconstruct"));
    ASSERT_EQ(clients.back()->handshake().status, 101u);
    clients.back()->pipe().Send(head + "mask" + (i % 2 == 0 ? "some of it" : ""));
  }
  for (int i = 0; i < 30; i += 2) EXPECT_EQ(clients[i]->Finish().code, 8);
  // 40 MB are allowed; the announced length takes no memory.
  const std::string allowed =
      std::string("\x82\xff\0\0\0\0", 6) + "\x02\x62\x5a" + std::string(1, '\0');
  for (int i = 0; i < 30; ++i) {
    clients.push_back(std::make_unique<WebSocketClient>(web_, "/v1/reconstruct"));
    clients.back()->pipe().Send(allowed + "mask" + std::string(10'000, 'x'));
  }
  EXPECT_EQ(Post(web_, "/v1/info", "").status, 200u);
  RecordProperty("mib", std::to_string(Mib() - before));
  EXPECT_LT(Mib() - before, 16);
}

TEST_F(WebLoad, AReaderThatStopsHoldsWhatItMayAndTheProducerGoesOn) {
  Serve({"--history-bytes", "0"});  // Histories would hold results of their own.
  StreamClient producer(channel_);
  ASSERT_TRUE(producer.SendAndReceive(OpenRequest("tank")).has_opened());
  ASSERT_TRUE(producer.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
  std::vector<std::unique_ptr<WebSocketClient>> stopped;
  for (const auto mode : {v1::WATCH_MODE_LATEST, v1::WATCH_MODE_EVERY}) {
    stopped.push_back(std::make_unique<WebSocketClient>(web_, "/v1/watch"));
    stopped.back()->pipe().TakeLittle();
    stopped.back()->SendMessage(OpenWatch(mode, 1'000'000));
    ASSERT_TRUE(stopped.back()->Receive<v1::WatchStreamResponse>().has_opened());
  }
  WebSocketClient reader(web_, "/v1/watch");
  reader.SendMessage(OpenWatch(v1::WATCH_MODE_EVERY, 1'000'000));
  ASSERT_TRUE(reader.Receive<v1::WatchStreamResponse>().has_opened());
  ASSERT_TRUE(reader.Receive<v1::WatchStreamResponse>().has_frame());  // The kept result.
  const double before = Mib();
  double most = before;
  std::uint64_t bytes = 0;
  for (std::uint64_t i = 1; i <= 4000; ++i) {
    const auto answer = producer.SendAndReceive(BlobRequest(i + 1, 1, i % 7));
    ASSERT_TRUE(answer.has_frame());
    bytes += answer.ByteSizeLong();
    ASSERT_EQ(reader.Receive<v1::WatchStreamResponse>().frame().frame().sequence(), i + 1);
    if (i % 100 == 0) most = std::max(most, Mib());
  }
  RecordProperty("mib", std::to_string(most - before));
  RecordProperty("mib_sent", std::to_string(static_cast<double>(bytes) / (1 << 20)));
  ASSERT_GT(bytes, 36u << 20) << "not more than everybody may hold";
  // Each holds at most 16 MiB, mostly shared, plus messages on the way.
  EXPECT_LT(most - before, 32);
  // The watcher in mode `every` has fallen behind.
  EXPECT_TRUE(Eventually([&] {
    v1::GetServerInfoResponse info;
    return info.ParseFromString(Post(web_, "/v1/info", "").body) &&
           info.load().watched_bytes() <= 2 * (16u << 20);
  }));
}

}  // namespace
}  // namespace partiemc::server
