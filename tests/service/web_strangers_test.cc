// Gateway clients without a token: they block no other client, and their data is not read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "service/web_testing.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr char kOther[] = "127.0.0.2";

class WebStrangers : public WebGatewayTest {
 protected:
  // Requests over a new connection from the address `from`.
  HttpReply AskFrom(const char* from, const std::string& target) {
    WebPipe pipe(web(), nullptr, from);
    return Ask(pipe, "GET", target);
  }
  std::unique_ptr<WebSocketClient> OpenWatcher() {
    auto watcher = std::make_unique<WebSocketClient>(web(), "/v1/watch");
    watcher->SendMessage(OpenWatch(v1::WATCH_MODE_EVERY, 99));
    EXPECT_TRUE(watcher->Receive<v1::WatchStreamResponse>().has_opened());
    return watcher;
  }
  // Receives until the server closes.
  std::string Exchange(const std::string& bytes) {
    WebPipe pipe(web());
    pipe.Send(bytes);
    return pipe.ReceiveAll();
  }
  static std::size_t Responses(std::string_view text) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find("HTTP/1.1 ", at)) != std::string_view::npos; ++at) {
      ++count;
    }
    return count;
  }
};

TEST_F(WebStrangers, MuteHandshakesKeepNobodyOut) {
  Serve();
  std::vector<std::unique_ptr<WebSocketClient>> mute;
  for (int i = 0; i < 256; ++i) {
    mute.push_back(std::make_unique<WebSocketClient>(web(), "/v1/watch"));
    ASSERT_EQ(mute.back()->handshake().status, 101u);
  }
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(AskFrom(kOther, "/v1/healthz").body, "ok\n");
    EXPECT_EQ(AskFrom("127.0.0.1", "/v1/healthz").body, "ok\n");
    EXPECT_EQ(Post(web(), "/v1/info", "").status, 200u);
  }
  OpenProducer();
  EXPECT_NE(OpenWatcher(), nullptr);
}

TEST_F(WebStrangers, OneAddressIsLimitedAndKeepsItsHealthChecks) {
  options_.web->max_connections = 8;
  Serve();
  OpenProducer();
  std::vector<std::unique_ptr<WebSocketClient>> watchers;
  for (int i = 0; i < 4; ++i) watchers.push_back(OpenWatcher());
  const HttpReply refused = Ask(web(), "GET", "/");
  EXPECT_EQ(refused.status, 503u);
  EXPECT_THAT(refused.body, HasSubstr("all connections"));
  EXPECT_EQ(AskFrom(kOther, "/").status, 200u);
  EXPECT_EQ(Refusals("full"), 1);
  // Silent connections above the limit block no health check.
  std::vector<std::unique_ptr<WebPipe>> silent;
  for (int i = 0; i < 40; ++i) silent.push_back(std::make_unique<WebPipe>(web()));
  for (const char* from : {"127.0.0.1", kOther}) {
    EXPECT_EQ(AskFrom(from, "/v1/healthz").body, "ok\n") << from;
  }
  watchers.pop_back();
  EXPECT_TRUE(Eventually([&] { return Ask(web(), "GET", "/").status == 200; }));
}

TEST_F(WebStrangers, ABodyIsFramedByChunkedAloneOrByItsLength) {
  Serve();
  const std::string inner = "GET /v1/healthz HTTP/1.1\r\nHost: localhost\r\n\r\n";
  for (const char* encoding :
       {"gzip", "identity", "gzip, chunked", "chunked, chunked", "chunked;q=1", "Chunked",
        "chunked\r\nTransfer-Encoding: gzip", "gzip\r\nTransfer-Encoding: chunked"}) {
    for (const char* target : {"GET /v1/healthz", "GET /", "POST /v1/info"}) {
      const std::string all = Exchange(absl::StrCat(
          target, " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-protobuf\r\n",
          "Transfer-Encoding: ", encoding, "\r\n\r\n", inner));
      EXPECT_THAT(all, StartsWith("HTTP/1.1 400 ")) << encoding;
      EXPECT_THAT(all, HasSubstr("Connection: close\r\n")) << encoding;
      EXPECT_EQ(Responses(all), 1u) << target << ", " << encoding;
    }
  }
  EXPECT_GE(Refusals("malformed"), 24);
}

TEST_F(WebStrangers, ARequestBeforeHttp11HasNoTransferEncoding) {
  Serve();
  const std::string inner = "GET /v1/healthz HTTP/1.1\r\nHost: localhost\r\n\r\n";
  for (const char* target : {"GET /v1/healthz", "GET /", "POST /v1/info"}) {
    const std::string head =
        absl::StrCat(target, " HTTP/1.0\r\nHost: localhost\r\nConnection: keep-alive\r\n",
                     "Content-Type: application/x-protobuf\r\n");
    const std::string all = Exchange(head + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n" + inner);
    EXPECT_THAT(all, StartsWith("HTTP/1.1 400 ")) << target;
    EXPECT_THAT(all, HasSubstr("Connection: close\r\n")) << target;
    EXPECT_EQ(Responses(all), 1u) << target;
    WebPipe plain(web());
    plain.Send(head + "Content-Length: 0\r\n\r\n");
    EXPECT_THAT(plain.ReceiveUntil("\r\n"), StartsWith("HTTP/1.1 200 ")) << target;
  }
}

TEST_F(WebStrangers, AChunkBeyondTheLimitIsRefusedWhenItIsAnnounced) {
  Serve();
  for (const char* size : {"ffffffffffffffff", "10001"}) {
    const std::string all = Exchange(absl::StrCat(
        "POST /v1/info HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-protobuf\r\n"
        "Transfer-Encoding: chunked\r\n\r\n",
        size, "\r\nsome"));
    EXPECT_THAT(all, StartsWith("HTTP/1.1 413 ")) << size;
    EXPECT_THAT(all, HasSubstr("must be at most 65536")) << size;
  }
  EXPECT_EQ(Refusals("too_large"), 2);
}

TEST_F(WebStrangers, OnLoopbackAForeignHostIsMisdirected) {
  options_.web->hosts = {"Viewer.example"};
  options_.web->origins = {"https://lab.example:8443"};
  Serve();
  const auto status = [&](const std::string& host, const std::string& target = "/") {
    return Ask(web(), "GET", target, "Host: " + host + "\r\n").status;
  };
  for (const char* host : {"evil.example", "evil.example:8080", "192.0.2.1",
                           "localhost.evil.example", "127.0.0.1.evil.example", "[2001:db8::1]",
                           "viewer.example.evil.example", "", "localhost@evil.example"}) {
    EXPECT_EQ(status(host), 421u) << host;
    EXPECT_EQ(Post(web(), "/v1/info", "", absl::StrCat("Host: ", host, "\r\n")).status, 421u);
  }
  EXPECT_EQ(Refusals("host"), 18);
  for (const char* host : {"localhost", "LOCALHOST:1", "127.0.0.1:8080", "[::1]", "a.localhost",
                           "viewer.example", "VIEWER.example:80", "lab.example"}) {
    EXPECT_EQ(status(host), 200u) << host;
  }
  const std::string own = "Host: viewer.example\r\nOrigin: https://viewer.example\r\n";
  EXPECT_EQ(Post(web(), "/v1/info", "", own).status, 200u);
  EXPECT_EQ(status("evil.example", "/v1/healthz"), 200u);
}

// DNS rebinding: a page under a name that resolves to the server's address.
TEST_F(WebStrangers, ElsewhereAForeignHostIsMisdirectedToo) {
  const support::TemporaryFolder folder;
  const auto status = [&](const char* host, const std::string& target = "/") {
    return Ask(web(), "GET", target, absl::StrCat("Host: ", host, "\r\n")).status;
  };
  options_.insecure = true;
  options_.web->address.host = "0.0.0.0";
  Serve();
  EXPECT_EQ(status("evil.example"), 421u);
  EXPECT_EQ(
      Post(web(), "/v1/info", "", "Host: evil.example\r\nOrigin: http://evil.example\r\n").status,
      421u);
  for (const char* host : {"localhost:8080", "127.0.0.1", "192.0.2.1", "[2001:db8::1]:8080"}) {
    EXPECT_EQ(status(host), 200u) << host;
  }
  EXPECT_EQ(status("evil.example", "/v1/healthz"), 200u);

  options_.token_file = folder.Write("tokens", "0123456789abcdef0123456789abcdef lab\n");
  Serve();
  EXPECT_EQ(status("viewer.example"), 200u);
  options_.web->hosts = {"viewer.example"};
  Serve();
  EXPECT_EQ(status("viewer.example"), 200u);
  EXPECT_EQ(status("192.0.2.1"), 200u);
  EXPECT_EQ(status("evil.example"), 421u);
  EXPECT_EQ(status("evil.example", "/v1/healthz"), 200u);
}

TEST_F(WebStrangers, WhatIsNoHostNameIsNoOption) {
  for (const char* host : {"viewer.example:80", "https://viewer.example", "", "a b"}) {
    options_.web->hosts = {host};
    EXPECT_THAT(std::string(Server::Start(options_).status().message()),
                StartsWith("--web-host \""))
        << host;
  }
  options_.web->hosts.clear();
  options_.web->frame_ancestors = {"lab.example; script-src *"};
  EXPECT_THAT(std::string(Server::Start(options_).status().message()),
              StartsWith("--web-frame-ancestors \""));
}

// The system's buffers accept a few megabytes.
TEST_F(WebStrangers, TheBodyOfACallWithoutATokenIsNotRead) {
  const support::TemporaryFolder folder;
  folder.Write("tokens", "0123456789abcdef0123456789abcdef lab\n");
  options_.token_file = folder.Path("tokens");
  Serve();
  const std::string body(64 << 20, 'x');
  for (const char* expect : {"", "Expect: 100-continue\r\n"}) {
    WebPipe pipe(web());
    pipe.Send(absl::StrCat(
        "POST /v1/frame HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-protobuf\r\n",
        expect, "Content-Length: ", body.size(), "\r\n\r\n"));
    EXPECT_THAT(pipe.ReceiveUntil("}\n"), StartsWith("HTTP/1.1 401 "));
    EXPECT_FALSE(pipe.Send(body));
  }
  EXPECT_TRUE(Eventually([&] { return Connections() == 0; }));
}

}  // namespace
}  // namespace partiemc::server
