// Malformed and hostile requests to the gateway: refused, counted, and harmless to others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "service/captured_log.h"
#include "service/web_testing.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// The head of a client frame that announces `bytes` without sending them.
std::string Announcement(std::uint64_t bytes) {
  std::string head = "\x82";
  head += static_cast<char>(0x80 | 127);
  for (int i = 7; i >= 0; --i) head += static_cast<char>(bytes >> 8 * i);
  return head + "mask";
}

TEST_F(WebGatewayTest, GarbageInsteadOfAMessageEndsTheCallWithItsReason) {
  Serve();
  for (const char* path : {"/v1/watch", "/v1/reconstruct"}) {
    WebSocketClient text(web(), path), binary(web(), path), after_end(web(), path);
    text.pipe().Send(ClientFrame(1, "hello"));
    EXPECT_EQ(text.Finish().reason, "MALFORMED");
    binary.Send(std::string(1000, '\xff'));
    const WebEnd end = binary.Finish();
    EXPECT_EQ(end.reason, "PROTOCOL");
    EXPECT_EQ(end.close_code, 4003u);
    // The stream is finished by then, or its client is informed of the error.
    after_end.SendMessage(OpenRequest());
    after_end.pipe().Send(ClientFrame(1, "end") + ClientFrame(2, "more"));
    EXPECT_THAT(after_end.Finish().text, HasSubstr("\"code\""));
  }
  EXPECT_GE(Refusals("bad_message"), 2);
}

TEST_F(WebGatewayTest, WhatIsNoWebSocketIsCut) {
  Serve();
  const std::vector<std::pair<const char*, std::string>> all = {
      {"not masked", std::string("\x82\x05hello", 7)},
      {"reserved bits", std::string("\xf2\x80mask", 6)},
      {"unknown opcode", std::string("\x83\x80mask", 6)},
      {"a long ping", "\x89\xfe\x01\x01mask" + std::string(257, 'p')},
      {"a ping in pieces", std::string("\x09\x80mask", 6)},
      {"nothing to go on with", ClientFrame(0, "piece")},
      {"a message within another", ClientFrame(2, "one", false) + ClientFrame(2, "two")},
      {"no UTF-8", ClientFrame(1, "\xc3\x28")}};
  for (const auto& [what, bytes] : all) {
    WebSocketClient client(web(), "/v1/watch");
    ASSERT_EQ(client.handshake().status, 101u) << what;
    client.pipe().Send(bytes);
    EXPECT_TRUE(client.pipe().IsClosedWithin(60'000)) << what;
  }
  // The connection is closed before its end is counted.
  EXPECT_TRUE(
      Eventually([&] { return Refusals("bad_message") == static_cast<double>(all.size()); }));
  EXPECT_TRUE(Eventually([&] { return Connections() == 0; }));
}

TEST_F(WebGatewayTest, AMessageThatIsAnnouncedTooLargeIsRefusedBeforeItComes) {
  Serve();
  for (const std::uint64_t bytes : {std::uint64_t{1'000'000'000}, std::uint64_t{1} << 62}) {
    for (const char* path : {"/v1/watch", "/v1/reconstruct"}) {
      WebSocketClient client(web(), path);
      client.pipe().Send(Announcement(bytes) + "some");
      const WebEnd end = client.Finish();
      EXPECT_EQ(end.code, 8) << end.text;
      EXPECT_THAT(end.text, HasSubstr("a message of at least "));
      EXPECT_EQ(end.close_code, 4008u);
    }
  }
  // In pieces; none exceeds the limit.
  WebSocketClient pieces(web(), "/v1/reconstruct");
  const std::string piece(100'000, 'x');
  pieces.pipe().Send(ClientFrame(2, piece, false));
  for (int i = 0; i < 20 && pieces.pipe().Send(ClientFrame(0, piece, false)); ++i) {
  }
  EXPECT_EQ(pieces.Finish().code, 8);
  EXPECT_EQ(Refusals("too_large"), 5);
}

TEST_F(WebGatewayTest, ABodyThatIsAnnouncedOrBecomesTooLargeIsRefused) {
  Serve();
  WebPipe announced(web());
  announced.Send(
      "POST /v1/frame HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-protobuf\r\n"
      "Content-Length: 1000000000\r\n\r\nsome");
  EXPECT_THAT(announced.ReceiveAll(), HasSubstr("413 Payload Too Large"));
  WebPipe chunked(web());
  chunked.Send(
      "POST /v1/info HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-protobuf\r\n"
      "Transfer-Encoding: chunked\r\n\r\n");
  // One byte too many. More would still be unread when the server closes, and its reset may discard
  // the answer.
  const std::string chunk = "4000\r\n" + std::string(0x4000, 'x') + "\r\n";
  for (int i = 0; i < 4; ++i) chunked.Send(chunk);
  chunked.Send("1\r\nx\r\n");
  EXPECT_THAT(chunked.ReceiveUntil("}\n"), HasSubstr("413 Payload Too Large"));
  EXPECT_EQ(Refusals("too_large"), 2);
}

TEST_F(WebGatewayTest, RefusedValuesAreLoggedWithoutSecrets) {
  const CapturedLog log;
  Serve();
  // Repeats the request, because the log holds back refusals above its rate.
  const auto is_logged = [&](const std::string& head, const std::string& part) {
    return Eventually([&] {
      WebPipe pipe(web());
      pipe.Send(head + "\r\n\r\n");
      pipe.ReceiveUntil("\r\n");
      return log.Count(part) > 0;
    });
  };
  EXPECT_TRUE(is_logged("GET / HTTP/1.1\r\nHost: evil.example",
                        "reason=host error=\"Host: evil.example; the request must name"));
  EXPECT_TRUE(is_logged("GET /v1/watch HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example",
                        "reason=origin error=\"Origin: http://evil.example; the method"));
  EXPECT_TRUE(is_logged(
      "GET /v1/none?token=secret HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer secret",
      "reason=malformed error=\"path: /v1/none; there is"));
  EXPECT_TRUE(is_logged(
      "GET /v1/watch HTTP/1.1\r\nHost: localhost\r\nConnection: upgrade\r\nUpgrade: websocket\r\n"
      "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
      "Sec-WebSocket-Protocol: partiemc.v1, bearer.secret, bearer.secret",
      "error=\"Sec-WebSocket-Protocol: a wrong token, or several; the request"));
  EXPECT_TRUE(is_logged("hello", "error=\"request: "));
  EXPECT_THAT(log.Text(), Not(HasSubstr("secret")));
}

TEST_F(WebGatewayTest, WhatIsNoRequestOfOursIsRefusedAndCounted) {
  Serve();
  const auto answer = [&](const std::string& bytes) {
    WebPipe pipe(web());
    pipe.Send(bytes);
    const std::string reply = pipe.ReceiveUntil("\r\n");
    return reply.size() < 12 ? std::string() : reply.substr(9, 3);
  };
  EXPECT_EQ(answer("hello\r\n\r\n"), "400");
  EXPECT_EQ(answer("GET / HTTP/9.9\r\n\r\n"), "400");
  EXPECT_EQ(answer("GET / HTTP/1.1\r\n\r\n"), "400");  // No host.
  EXPECT_EQ(answer("GET / HTTP/1.1\r\nHost: localhost\r\nHost: b\r\n\r\n"), "400");
  EXPECT_EQ(answer("GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n"), "400");
  EXPECT_EQ(
      answer("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n"),
      "431");
  EXPECT_EQ(answer("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"), "400");
  EXPECT_EQ(answer("GET /v1/watch HTTP/1.1\r\nHost: localhost\r\n\r\n"), "426");
  const double before = Refusals("malformed");
  EXPECT_GE(before, 7);
  for (const char* protocols :
       {"chat", "partiemc.v2", "partiemc.v1, bearer.", "partiemc.v1, bearer.a=b",
        "partiemc.v1, bearer.YWJj, bearer.YWJj"}) {
    const WebSocketClient client(web(), "/v1/watch", "", protocols);
    EXPECT_EQ(client.handshake().status, 400u) << protocols;
  }
  EXPECT_EQ(Refusals("malformed"), before + 5);
}

TEST_F(WebGatewayTest, ClosingAnIdleConnectionIsNoRefusal) {
  Serve();
  WebPipe page(web()), call(web()), slow(web());
  EXPECT_EQ(Ask(page, "GET", "/v1/healthz").status, 200u);
  const std::string type = "Content-Type: application/x-protobuf\r\n";
  EXPECT_EQ(Ask(call, "POST", "/v1/info", type).status, 200u);
  EXPECT_EQ(Ask(slow, "GET", "/v1/healthz").status, 200u);
  slow.Send("GET /v1/healthz");  // The rest does not follow.
  for (WebPipe* pipe : {&page, &call, &slow}) EXPECT_TRUE(pipe->IsClosedWithin(60'000));
  EXPECT_TRUE(Eventually([&] { return Connections() == 0; }));
  EXPECT_EQ(Refusals("timeout"), 1);
}

TEST_F(WebGatewayTest, OfSocketsThatSayNothingTheOldestGiveWayAndCallsStay) {
  options_.web->max_connections = options_.web->max_per_address = 8;
  Serve();
  OpenProducer();
  std::vector<std::unique_ptr<WebSocketClient>> watchers;
  for (int i = 0; i < 4; ++i) {
    watchers.push_back(std::make_unique<WebSocketClient>(web(), "/v1/watch"));
    watchers.back()->SendMessage(OpenWatch(v1::WATCH_MODE_EVERY, 99));
    ASSERT_TRUE(watchers.back()->Receive<v1::WatchStreamResponse>().has_opened());
  }
  std::vector<std::unique_ptr<WebPipe>> silent;
  for (int i = 0; i < 20; ++i) silent.push_back(std::make_unique<WebPipe>(web()));
  EXPECT_TRUE(silent.front()->IsClosedWithin(60'000));
  EXPECT_EQ(Post(web(), "/v1/info", "").status, 200u);
  EXPECT_GE(Refusals("full"), 16);
  for (std::uint64_t i = 0; i < 3; ++i) {
    Produce(i);
    for (const auto& watcher : watchers) {
      EXPECT_TRUE(watcher->Receive<v1::WatchStreamResponse>().has_frame());
    }
  }
  // If all connections have calls, another one may only make a health check.
  silent.clear();
  while (watchers.size() < 8) {
    watchers.push_back(std::make_unique<WebSocketClient>(web(), "/v1/watch"));
    watchers.back()->SendMessage(OpenWatch(v1::WATCH_MODE_EVERY, 99));
    ASSERT_TRUE(watchers.back()->Receive<v1::WatchStreamResponse>().has_opened());
  }
  EXPECT_EQ(Ask(web(), "GET", "/").status, 503u);
  EXPECT_EQ(Ask(web(), "GET", "/v1/healthz").status, 200u);
}

// PARTIEMC_CANCELS=20000 for more.
int Cancels() {
  const char* const text = std::getenv("PARTIEMC_CANCELS");
  return text == nullptr ? 6000 : std::atoi(text);
}

// A client that makes some steps and disconnects during one of them.
void ComeAndGo(const Address& web, std::mt19937& random, const std::string& frame) {
  const auto below = [&](unsigned count) { return static_cast<unsigned>(random() % count); };
  const std::string open = OpenRequest().SerializeAsString();
  v1::WatchStreamRequest watch;
  watch.mutable_open()->set_stream_name("tank");
  watch.mutable_open()->set_mode(below(2) == 0 ? v1::WATCH_MODE_EVERY : v1::WATCH_MODE_LATEST);
  watch.mutable_open()->set_credits(1 + below(20));
  std::string all;
  const unsigned kind = below(3);
  if (kind == 2) {
    all =
        "POST /v1/frame HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-protobuf\r\n"
        "Content-Length: " +
        std::to_string(frame.size()) + "\r\n\r\n" + frame;
    WebPipe pipe(web);
    pipe.Send(std::string_view(all).substr(0, below(static_cast<unsigned>(all.size() + 1))));
    if (below(2) == 0) pipe.IsClosedWithin(static_cast<int>(below(4)));
    if (below(2) == 0) pipe.Reset();
    return;
  }
  WebSocketClient client(web, kind == 0 ? "/v1/watch" : "/v1/reconstruct");
  all = ClientFrame(2, kind == 0 ? watch.SerializeAsString() : open);
  for (unsigned i = below(4); kind == 1 && i > 0; --i) all += ClientFrame(2, frame);
  if (below(3) == 0) all += ClientFrame(1, "end");
  if (below(3) == 0) all += ClientFrame(8, std::string("\x03\xe8", 2));
  if (below(2) == 0) all.resize(below(static_cast<unsigned>(all.size() + 1)));
  client.pipe().Send(all);
  if (below(2) == 0) client.pipe().IsClosedWithin(static_cast<int>(below(4)));
  if (below(2) == 0) client.pipe().Reset();
}

TEST_F(WebGatewayTest, WhoeverGoesAtWhicheverPointLeavesNothingBehind) {
  options_.limits.max_watchers = 500;
  Serve();
  OpenProducer();
  std::atomic<bool> over = false;
  std::thread producer([&] {
    for (std::uint64_t i = 0; !over; ++i) {
      ASSERT_TRUE(producer_->SendAndReceive(BlobRequest(i + 1, 1, i % 7)).has_frame());
    }
  });
  std::vector<std::thread> clients;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    clients.emplace_back([this, seed] {
      std::mt19937 random(seed);
      const std::string frame = BlobRequest(1, seed, 0).SerializeAsString();
      for (int i = 0; i < Cancels() / 4; ++i) ComeAndGo(web(), random, frame);
    });
  }
  for (auto& client : clients) client.join();
  over = true;
  producer.join();
  EXPECT_TRUE(Eventually([&] { return Connections() == 0; }));
  EXPECT_TRUE(Eventually([&] {
    v1::GetServerInfoResponse info;
    return info.ParseFromString(Post(web(), "/v1/info", "").body) && info.open_streams() == 1 &&
           info.load().watchers() == 0 && info.load().memory_held() == 0;
  }));
  // Each call except the producer's was counted once, at its end.
  EXPECT_TRUE(Eventually(
      [&] { return Sum("grpc_server_started_total") == Sum("grpc_server_handled_total") + 1; }));
  EXPECT_GT(Sum("grpc_server_started_total"), Cancels() / 2);
}

}  // namespace
}  // namespace partiemc::server
