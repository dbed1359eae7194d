// The methods through the gateway: the same bytes, limits, tokens and ends as over gRPC.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "service/security_testing.h"
#include "service/web_testing.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;

constexpr std::chrono::milliseconds kGrace{60'000};

TEST_F(WebGatewayTest, AWatcherGetsTheSameBytesOverBothDoors) {
  Serve();
  OpenProducer();
  WebSocketClient web_watcher(web(), "/v1/watch");
  ASSERT_EQ(web_watcher.handshake().status, 101u);
  EXPECT_EQ(web_watcher.handshake().headers.at("sec-websocket-accept"),
            "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  EXPECT_EQ(web_watcher.handshake().headers.at("sec-websocket-protocol"), "partiemc.v1");
  EXPECT_FALSE(web_watcher.handshake().headers.contains("sec-websocket-extensions"));
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_EVERY, 3);
  web_watcher.SendMessage(OpenWatch(v1::WATCH_MODE_EVERY, 3));
  const auto opened = web_watcher.Receive<v1::WatchStreamResponse>();
  EXPECT_EQ(opened.SerializeAsString(), watcher.Receive().SerializeAsString());
  for (std::uint64_t i = 0; i < 12; ++i) {
    const v1::ReconstructedFrame made = Produce(i);
    const auto bytes = web_watcher.Receive();
    ASSERT_TRUE(bytes.has_value());
    EXPECT_NE(bytes->find(made.SerializeAsString()), std::string::npos);
    v1::WatchStreamResponse seen;
    ASSERT_TRUE(seen.ParseFromString(*bytes));
    EXPECT_EQ(seen.SerializeAsString(), watcher.Receive().SerializeAsString());
    web_watcher.SendMessage(Credit(1));
    watcher.Credit(1);
  }
  EXPECT_EQ(Connections(), 1);
  producer_->HalfClose();
  EXPECT_TRUE(producer_->Finish().ok());
  EXPECT_EQ(web_watcher.Receive<v1::WatchStreamResponse>().ended().reason(), "FINISHED");
  const WebEnd end = web_watcher.Finish();
  EXPECT_EQ(end.text, "{\"code\": 0, \"status\": \"OK\"}");
  EXPECT_EQ(end.close_code, 1000u);
  EXPECT_TRUE(Eventually([&] { return Connections() == 0; }));
}

// One frame at a time; fails unless each answer is a result.
std::vector<Digests> DigestsOverWeb(WebSocketClient& client, unsigned seed, std::uint64_t frames) {
  client.SendMessage(OpenRequest());
  EXPECT_TRUE(client.Receive<v1::ReconstructResponse>().has_opened());
  std::vector<Digests> digests;
  for (std::uint64_t i = 0; i < frames; ++i) {
    client.SendMessage(BlobRequest(i + 1, seed, i));
    const auto answer = client.Receive<v1::ReconstructResponse>();
    EXPECT_EQ(answer.frame().sequence(), i + 1);
    digests.push_back({answer.frame().rings_digest(), answer.frame().mesh_digest()});
  }
  client.HalfClose();
  EXPECT_EQ(client.Finish().close_code, 1000u);
  return digests;
}

TEST_F(WebGatewayTest, AProducerGetsTheDigestsThatItGetsOverGrpc) {
  Serve();
  WebSocketClient client(web(), "/v1/reconstruct");
  const auto digests = DigestsOverWeb(client, 5, 8);
  EXPECT_EQ(digests, LocalDigests(5, 8));
  EXPECT_EQ(digests, StreamedDigests(channel_, 5, 8));
}

TEST_F(WebGatewayTest, AMessageInPiecesIsTheSameMessage) {
  Serve();
  WebSocketClient client(web(), "/v1/reconstruct");
  const auto expected = LocalDigests(2, 3);
  client.SendMessage(OpenRequest());
  ASSERT_TRUE(client.Receive<v1::ReconstructResponse>().has_opened());
  for (std::uint64_t i = 0; i < 3; ++i) {
    const std::string message = BlobRequest(i + 1, 2, i).SerializeAsString();
    const std::size_t piece = i == 0 ? 997 : 1 + message.size() / (3 * i);
    for (std::size_t at = 0; at < message.size(); at += piece) {
      const bool last = at + piece >= message.size();
      client.pipe().Send(ClientFrame(at == 0 ? 2 : 0, message.substr(at, piece), last));
      // A ping between two pieces is answered separately.
      if (at == piece) client.pipe().Send(ClientFrame(9, "between"));
    }
    const auto answer = client.Receive<v1::ReconstructResponse>();
    EXPECT_EQ(answer.frame().rings_digest(), expected[i].rings);
  }
  client.pipe().Send(ClientFrame(1, "e", false) + ClientFrame(0, "nd"));
  EXPECT_EQ(client.Finish().code, 0);
}

TEST_F(WebGatewayTest, AFrameThatIsTooLargeIsAnsweredAndTheStreamGoesOn) {
  options_.limits.max_frame_bytes = 20'000;
  Serve();
  WebSocketClient client(web(), "/v1/reconstruct");
  client.SendMessage(OpenRequest());
  ASSERT_TRUE(client.Receive<v1::ReconstructResponse>().has_opened());
  auto request = BlobRequest(1, 1, 0);
  request.mutable_frame()->set_velocities(std::string(22'000 - request.ByteSizeLong(), 'x'));
  client.SendMessage(request);
  EXPECT_EQ(client.Receive<v1::ReconstructResponse>().error().reason(), "FRAME_BYTES");
  client.HalfClose();
  EXPECT_EQ(client.Finish().code, 0);
}

TEST_F(WebGatewayTest, AHalfClosedWatchGoesOnForAsLongAsItHasCredit) {
  Serve();
  OpenProducer();
  WebSocketClient watcher(web(), "/v1/watch");
  watcher.SendMessage(OpenWatch(v1::WATCH_MODE_LATEST, 2));
  watcher.HalfClose();
  ASSERT_TRUE(watcher.Receive<v1::WatchStreamResponse>().has_opened());
  Produce(0);
  EXPECT_TRUE(watcher.Receive<v1::WatchStreamResponse>().has_frame());
  Produce(1);
  EXPECT_TRUE(watcher.Receive<v1::WatchStreamResponse>().has_frame());
  EXPECT_EQ(watcher.Receive<v1::WatchStreamResponse>().ended().reason(), "CREDIT_USED");
  EXPECT_EQ(watcher.Finish().code, 0);
}

TEST_F(WebGatewayTest, PostsAnswerInformationAndFramesOneAfterTheOtherInAConnection) {
  Serve();
  OpenProducer();
  WebPipe pipe(web());
  const WebHeaders type = "Content-Type: application/x-protobuf\r\n";
  for (int round = 0; round < 3; ++round) {
    const HttpReply info = Ask(pipe, "POST", "/v1/info", type);
    EXPECT_EQ(info.status, 200u);
    EXPECT_EQ(info.headers.at("content-type"), "application/x-protobuf");
    v1::GetServerInfoResponse server;
    ASSERT_TRUE(server.ParseFromString(info.body));
    EXPECT_EQ(server.open_streams(), 1u);

    v1::ListStreamsResponse streams;
    ASSERT_TRUE(streams.ParseFromString(Ask(pipe, "POST", "/v1/streams", type).body));
    ASSERT_EQ(streams.streams_size(), 1);
    EXPECT_EQ(streams.streams(0).stream_name(), "tank");

    v1::ReconstructFrameRequest request;
    *request.mutable_parameters() = OpenRequest().open().parameters();
    *request.mutable_frame() = BlobRequest(0, 7, 0).frame();
    v1::ReconstructFrameResponse response;
    ASSERT_TRUE(response.ParseFromString(
        Ask(pipe, "POST", "/v1/frame", type, request.SerializeAsString()).body));
    EXPECT_EQ(response.frame().rings_digest(), LocalDigests(7, 1)[0].rings);
  }
  const std::string started = "grpc_server_started_total{grpc_method=\"GetServerInfo\",";
  EXPECT_THAT(Ask(*server_->metrics_address(), "GET", "/metrics").body, HasSubstr(started));
}

TEST_F(WebGatewayTest, ABodyMayComeInChunksAndAfterItWasAskedFor) {
  Serve();
  const WebHeaders type = "Content-Type: application/x-protobuf\r\n";
  v1::ListStreamsRequest request;
  request.set_page_size(-1);
  const std::string body = request.SerializeAsString();
  WebPipe chunked(web());
  chunked.Send("POST /v1/streams HTTP/1.1\r\nHost: localhost\r\n" + type +
               "Transfer-Encoding: chunked\r\n\r\n");
  for (const char byte : body) chunked.Send(std::string("1\r\n") + byte + "\r\n");
  chunked.Send("0\r\n\r\n");
  EXPECT_THAT(chunked.ReceiveUntil("}\n"), HasSubstr("400 Bad Request"));
  WebPipe asked(web());
  asked.Send("POST /v1/info HTTP/1.1\r\nHost: localhost\r\n" + type +
             "Expect: 100-continue\r\nContent-Length: 0\r\n\r\n");
  EXPECT_EQ(asked.ReceiveUntil("\r\n\r\n"), "HTTP/1.1 100 Continue\r\n\r\n");
  EXPECT_THAT(asked.ReceiveUntil("\r\n\r\n"), HasSubstr("200 OK"));
}

TEST_F(WebGatewayTest, ErrorsAreToldWithTheirReasonOverEitherWay) {
  Serve();
  const HttpReply bad = Post(web(), "/v1/frame", "xx");
  EXPECT_EQ(bad.status, 400u);
  EXPECT_EQ(bad.headers.at("content-type"), "application/json");
  EXPECT_EQ(ParseStatus(bad.body).reason, "UNSUPPORTED");
  EXPECT_EQ(ParseStatus(bad.body).code, 3);
  EXPECT_EQ(ParseStatus(Post(web(), "/v1/info", std::string(5000, '\n')).body).reason, "MALFORMED");

  WebSocketClient watcher(web(), "/v1/watch");
  watcher.SendMessage(OpenWatch(v1::WATCH_MODE_LATEST, 1));
  const WebEnd end = watcher.Finish();
  EXPECT_EQ(end.code, 5);
  EXPECT_EQ(end.reason, "NO_SUCH_STREAM");
  EXPECT_EQ(end.close_code, 4005u);
  EXPECT_THAT(end.text, HasSubstr("\"field\": \"open.stream_name\""));
  EXPECT_THAT(end.text, HasSubstr("\"rule\": \"must be the name of an open stream"));
}

TEST_F(WebGatewayTest, OneStreamTooManyIsRefused) {
  options_.limits.max_streams = 1;
  Serve();
  OpenProducer();
  WebSocketClient refused(web(), "/v1/reconstruct");
  refused.SendMessage(OpenRequest());
  const WebEnd end = refused.Finish();
  EXPECT_EQ(end.reason, "TOO_MANY_STREAMS");
  EXPECT_EQ(end.close_code, 4008u);
}

TEST_F(WebGatewayTest, WhoStaysSilentIsEndedAndTold) {
  options_.limits.idle.opening = std::chrono::milliseconds(20);
  options_.limits.unary.request = std::chrono::milliseconds(20);
  Serve();
  WebSocketClient silent(web(), "/v1/reconstruct");
  const WebEnd end = silent.Finish();
  EXPECT_EQ(end.reason, "IDLE");
  EXPECT_EQ(end.close_code, 4004u);
  WebPipe pipe(web());
  pipe.Send(
      "POST /v1/info HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-protobuf\r\n"
      "Content-Length: 9\r\n\r\nhalf");
  EXPECT_THAT(pipe.ReceiveAll(), HasSubstr("IDLE"));
}

TEST_F(WebGatewayTest, AProducerThatIsGoneLeavesItsStreamAndItsWatchersAreTold) {
  Serve();
  auto producer = std::make_unique<WebSocketClient>(web(), "/v1/reconstruct");
  producer->SendMessage(OpenRequest("tank"));
  ASSERT_TRUE(producer->Receive<v1::ReconstructResponse>().has_opened());
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_LATEST, 1);
  ASSERT_TRUE(watcher.Receive().has_opened());
  producer->pipe().Reset();
  EXPECT_EQ(watcher.Receive().ended().reason(), "PRODUCER_LOST");
  // A client that closes without `end` has left, too.
  producer = std::make_unique<WebSocketClient>(web(), "/v1/reconstruct");
  producer->SendMessage(OpenRequest("tank"));
  ASSERT_TRUE(producer->Receive<v1::ReconstructResponse>().has_opened());
  producer->pipe().Send(ClientFrame(8, std::string("\x03\xe8", 2)));
  EXPECT_TRUE(producer->pipe().IsClosedWithin(60'000));
  EXPECT_TRUE(Eventually([&] {
    v1::GetServerInfoResponse info;
    return info.ParseFromString(Post(web(), "/v1/info", "").body) && info.open_streams() == 0;
  }));
}

TEST_F(WebGatewayTest, ASilentClientIsAskedForASignOfLifeAndEndedWithoutOne) {
  options_.keepalive = {std::chrono::milliseconds(100), std::chrono::milliseconds(200)};
  Serve();
  OpenProducer();
  WebSocketClient alive(web(), "/v1/watch"), dead(web(), "/v1/watch");
  for (WebSocketClient* watcher : {&alive, &dead}) {
    watcher->SendMessage(OpenWatch(v1::WATCH_MODE_LATEST, 9));
    ASSERT_TRUE(watcher->Receive<v1::WatchStreamResponse>().has_opened());
  }
  std::thread silent([&] { EXPECT_TRUE(dead.pipe().IsClosedWithin(60'000)); });
  std::thread producer([&] {
    silent.join();
    Produce(0);  // The other client receives only pings until now.
  });
  EXPECT_TRUE(alive.Receive<v1::WatchStreamResponse>().has_frame());
  EXPECT_GE(alive.pings(), 1u);
  producer.join();
  EXPECT_EQ(Refusals("timeout"), 1);
}

TEST_F(WebGatewayTest, ADrainDeliversWhatIsDoneAndSaysGoodbye) {
  Serve();
  OpenProducer();
  WebSocketClient watcher(web(), "/v1/watch"), stream(web(), "/v1/reconstruct");
  watcher.SendMessage(OpenWatch(v1::WATCH_MODE_EVERY, 9));
  ASSERT_TRUE(watcher.Receive<v1::WatchStreamResponse>().has_opened());
  stream.SendMessage(OpenRequest("pond"));
  ASSERT_TRUE(stream.Receive<v1::ReconstructResponse>().has_opened());
  EXPECT_EQ(Ask(web(), "GET", "/v1/healthz").body, "ok\n");
  Produce(0);
  std::thread producer([&] { producer_->Finish(); });
  std::thread drain([&] { server_->Drain(kGrace); });
  EXPECT_TRUE(watcher.Receive<v1::WatchStreamResponse>().has_frame());
  EXPECT_EQ(watcher.Receive<v1::WatchStreamResponse>().ended().reason(), "DRAINING");
  for (WebSocketClient* client : {&watcher, &stream}) {
    const WebEnd end = client->Finish();
    EXPECT_EQ(end.reason, "DRAINING");
    EXPECT_EQ(end.close_code, 4014u);
  }
  producer.join();
  drain.join();
  EXPECT_FALSE(WebPipe(web()).is_open());
}

TEST_F(WebGatewayTest, AServerThatStopsAtOnceEndsItsCalls) {
  Serve();
  OpenProducer();
  std::vector<std::unique_ptr<WebSocketClient>> watchers;
  for (int i = 0; i < 8; ++i) {
    watchers.push_back(std::make_unique<WebSocketClient>(web(), "/v1/watch"));
    watchers.back()->SendMessage(OpenWatch(v1::WATCH_MODE_EVERY, 9));
    ASSERT_TRUE(watchers.back()->Receive<v1::WatchStreamResponse>().has_opened());
  }
  WebPipe half_open(web());
  producer_.reset();
  server_.reset();
  for (const auto& watcher : watchers) EXPECT_TRUE(watcher->pipe().IsClosedWithin(60'000));
  EXPECT_TRUE(half_open.IsClosedWithin(60'000));
}

class WebSecurity : public Security {
 protected:
  void Serve(bool tls, bool client_ca, bool tokens) {
    ServerOptions options = Options(tls, client_ca, tokens);
    options.web.emplace().address = {.host = "127.0.0.1", .port = 0, .unix_path = {}};
    server_ = StartServer(options);
  }
  Address web() const { return *server_->web_address(); }
  std::string OwnOrigin() const {
    return "Host: " + web().ToString() + "\r\nOrigin: http://" + web().ToString() + "\r\n";
  }
  static std::string Bearer(const std::string& token) {
    return "Authorization: Bearer " + token + "\r\n";
  }
};

TEST_F(WebSecurity, ATokenComesInAHeaderOrAsASubprotocolAndIsNeverEchoed) {
  Write("tokens", std::string(kToken) + " alice may=watch,list\n");
  Serve(false, false, true);
  EXPECT_EQ(Post(web(), "/v1/info", "").status, 401u);
  EXPECT_EQ(ParseStatus(Post(web(), "/v1/info", "").body).reason, "TOKEN_MISSING");
  EXPECT_EQ(ParseStatus(Post(web(), "/v1/info", "", Bearer(kOtherToken)).body).reason,
            "TOKEN_UNKNOWN");
  EXPECT_EQ(Post(web(), "/v1/info", "", Bearer(kToken) + Bearer(kToken)).status, 401u);
  EXPECT_EQ(Post(web(), "/v1/info", "", Bearer(kToken)).status, 200u);
  EXPECT_EQ(server::Ask(web(), "GET", "/v1/healthz").status, 200u);

  const std::string offered = "partiemc.v1, bearer." + Base64Url(kToken);
  for (const auto& [headers, protocols] :
       {std::pair(Bearer(kToken), std::string("partiemc.v1")), std::pair(std::string(), offered),
        std::pair(OwnOrigin(), offered)}) {
    WebSocketClient watcher(web(), "/v1/watch", headers, protocols);
    EXPECT_EQ(watcher.handshake().status, 101u);
    EXPECT_EQ(watcher.handshake().headers.at("sec-websocket-protocol"), "partiemc.v1");
    watcher.HalfClose();
    EXPECT_EQ(watcher.Finish().reason, "PROTOCOL");
  }
}

TEST_F(WebSecurity, AWrongTokenIsToldByHttpAndToAPageAfterTheHandshake) {
  Write("tokens", std::string(kToken) + " alice may=watch,list\n");
  Serve(false, false, true);
  const std::string wrong = "partiemc.v1, bearer." + Base64Url(kOtherToken);
  const std::string right = "partiemc.v1, bearer." + Base64Url(kToken);
  const WebSocketClient missing(web(), "/v1/watch");
  EXPECT_EQ(missing.handshake().status, 401u);
  EXPECT_EQ(missing.handshake().headers.at("www-authenticate"), "Bearer");
  const WebSocketClient unknown(web(), "/v1/watch", "", wrong);
  EXPECT_EQ(ParseStatus(unknown.handshake().body).reason, "TOKEN_UNKNOWN");
  const WebSocketClient both(web(), "/v1/watch", Bearer(kToken), right);
  EXPECT_EQ(ParseStatus(both.handshake().body).reason, "TOKEN_MISSING");
  const WebSocketClient forbidden(web(), "/v1/reconstruct", "", right);
  EXPECT_EQ(forbidden.handshake().status, 403u);
  EXPECT_EQ(ParseStatus(forbidden.handshake().body).reason, "NOT_PERMITTED");

  WebSocketClient page(web(), "/v1/watch", OwnOrigin(), wrong);
  EXPECT_EQ(page.handshake().status, 101u);
  const WebEnd end = page.Finish();
  EXPECT_EQ(end.reason, "TOKEN_UNKNOWN");
  EXPECT_EQ(end.close_code, 4016u);
}

TEST_F(WebSecurity, WhoHasAllItsCallsIsRefusedBeforeTheHandshake) {
  Write("tokens", std::string(kToken) + " alice calls=1\n");
  Serve(false, false, true);
  WebSocketClient first(web(), "/v1/watch", Bearer(kToken));
  ASSERT_EQ(first.handshake().status, 101u);
  const WebSocketClient second(web(), "/v1/watch", Bearer(kToken));
  EXPECT_EQ(second.handshake().status, 429u);
  EXPECT_EQ(ParseStatus(second.handshake().body).reason, "CALLER_CALLS");
  EXPECT_EQ(Post(web(), "/v1/info", "", Bearer(kToken)).status, 429u);
  first.HalfClose();
  EXPECT_EQ(first.Finish().code, 3);
  EXPECT_EQ(Post(web(), "/v1/info", "", Bearer(kToken)).status, 200u);
}

TEST_F(WebSecurity, OverTlsTheSameAndWithTheSameIdentityWhichMayChange) {
  WriteIdentity(authority_.Issue("server"));
  Serve(true, false, false);
  const WebTls tls{.authority = authority_.certificate()};
  WebSocketClient client(web(), "/v1/reconstruct", "", "partiemc.v1", &tls);
  EXPECT_EQ(DigestsOverWeb(client, 5, 6), LocalDigests(5, 6));
  EXPECT_EQ(Post(web(), "/v1/info", "", "", &tls).status, 200u);
  EXPECT_EQ(Post(web(), "/v1/info", "").status, 0u);
  const WebTls stranger{.authority = stranger_.certificate()};
  EXPECT_FALSE(WebPipe(web(), &stranger).is_open());
  WebPipe before(web(), &tls);
  WriteIdentity(stranger_.Issue("server"));
  EXPECT_TRUE(Eventually([&] { return WebPipe(web(), &stranger).is_open(); }));
  EXPECT_EQ(server::Ask(before, "GET", "/v1/healthz").status, 200u);
}

TEST_F(WebSecurity, AClientNeedsACertificateWhereOneIsAskedFor) {
  WriteIdentity(stranger_.Issue("server"));
  Write("clients.pem", authority_.certificate());
  Serve(true, true, false);
  const auto status = [&](const IssuedCertificate& own) {
    const WebTls tls{.authority = stranger_.certificate(), .own = own};
    return Post(web(), "/v1/info", "", "", &tls).status;
  };
  EXPECT_EQ(status(authority_.Issue("client")), 200u);
  EXPECT_EQ(status({}), 0u);
  EXPECT_EQ(status(stranger_.Issue("client")), 0u);
}

TEST(WebAddress, AGatewayThatOthersReachNeedsTlsOrToBeWanted) {
  ServerOptions options = TestOptions();
  options.web.emplace().address = {.host = "0.0.0.0", .port = 0, .unix_path = {}};
  const auto open = Server::Start(options);
  ASSERT_FALSE(open.ok());
  EXPECT_THAT(std::string(open.status().message()), HasSubstr("can be reached from other"));
  options.insecure = true;
  EXPECT_TRUE(Server::Start(options).ok());
  options.web->origins = {"localhost"};
  EXPECT_THAT(std::string(Server::Start(options).status().message()), HasSubstr("is no origin"));
}

TEST(WebAddress, AnAddressThatIsTakenIsToldAndAllOfANameAreListenedOn) {
  ServerOptions options = TestOptions();
  options.web.emplace().address = {.host = "localhost", .port = 0, .unix_path = {}};
  const auto server = StartServer(options);
  EXPECT_EQ(Ask(*server->web_address(), "GET", "/v1/healthz").status, 200u);
  options.web->address = *server->web_address();
  const auto second = Server::Start(options);
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("cannot listen on --web"));
}

}  // namespace
}  // namespace partiemc::server
