// Interpreting requests to the gateway, including forbidden ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "partiemc/status.h"
#include "server/web/requests.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(FilePathOf, NamesAFileBelowTheFolderOrNothing) {
  EXPECT_EQ(FilePathOf("/"), "index.html");
  EXPECT_EQ(FilePathOf("/?stream=tank"), "index.html");
  EXPECT_EQ(FilePathOf("/assets/app-1.2.js"), "assets/app-1.2.js");
  EXPECT_EQ(FilePathOf("/assets%2Fapp.js"), "assets/app.js");
  for (const char* target :
       {"", "x", "/..", "/a/../b", "/a/./b", "/.a", "/a//b", "/a/", "//a", "/%2e%2e/a", "/a%00",
        "/%", "/%4", "/%zz", "/a b", "/a\\b", "/a:b", "/*", "http://a/b"}) {
    EXPECT_EQ(FilePathOf(target), std::nullopt) << target;
  }
  EXPECT_EQ(FilePathOf("/" + std::string(2000, 'a')), std::nullopt);
}

TEST(DecodeBase64Url, TakesOneWayOfWritingOnly) {
  EXPECT_EQ(DecodeBase64Url(""), "");
  EXPECT_EQ(DecodeBase64Url("YQ"), "a");
  EXPECT_EQ(DecodeBase64Url("YWI"), "ab");
  EXPECT_EQ(DecodeBase64Url("YWJj"), "abc");
  EXPECT_EQ(DecodeBase64Url("-_-_"), "\xfb\xff\xbf");
  for (const char* text : {"Y", "YQ==", "YR", "YWJ", "+/+/", "YW Jj", "YWJjZ"}) {
    EXPECT_EQ(DecodeBase64Url(text), std::nullopt) << text;
  }
}

TEST(ParseProtocols, FindsOursAndTheToken) {
  EXPECT_TRUE(ParseProtocols({"partiemc.v1"}).ours);
  EXPECT_TRUE(ParseProtocols({"chat", " partiemc.v1 ,x"}).ours);
  EXPECT_FALSE(ParseProtocols({"partiemc.v10", "PARTIEMC.V1"}).ours);
  EXPECT_FALSE(ParseProtocols({}).ours);
  const auto offered = ParseProtocols({"partiemc.v1, bearer.YWJj"});
  EXPECT_EQ(offered.tokens, std::vector<std::string>{"abc"});
  EXPECT_FALSE(offered.is_malformed);
  EXPECT_TRUE(ParseProtocols({"partiemc.v1, bearer."}).is_malformed);
  EXPECT_TRUE(ParseProtocols({"partiemc.v1, bearer.Y"}).is_malformed);
  EXPECT_TRUE(ParseProtocols({"bearer.YWJj", "bearer.YWJj"}).is_malformed);
}

TEST(AcceptsGzip, LooksAtItsWeight) {
  for (const char* header : {"gzip", "br, GZIP", "gzip;q=0.1", "gzip; q=1.0, br"}) {
    EXPECT_TRUE(AcceptsGzip(header)) << header;
  }
  for (const char* header : {"", "br", "gzip;q=0", "gzip; q=0.000", "xgzip", "*"}) {
    EXPECT_FALSE(AcceptsGzip(header)) << header;
  }
}

TEST(NormalOrigin, HasOneForm) {
  EXPECT_EQ(*NormalOrigin("HTTPS://Viewer.Example:443"), "https://viewer.example");
  EXPECT_EQ(*NormalOrigin("http://localhost:8080"), "http://localhost:8080");
  EXPECT_EQ(*NormalOrigin("http://[::1]:80"), "http://[::1]");
  for (const char* origin :
       {"", "null", "http://", "ftp://a", "http://a/", "http://a:", "http://a:b", "http://a:123456",
        "http://a@b", "http://a b", "http://[::1", "http://::1", "viewer.example", "http://:80"}) {
    EXPECT_FALSE(NormalOrigin(origin).ok()) << origin;
  }
}

TEST(IsOriginAllowed, TakesThePagesOfThisServerAndThoseThatAreNamed) {
  const WebRules local{.origins = {"https://viewer.example"}, .is_local = true};
  const WebRules open{.origins = {}, .is_local = false, .any_host = true};
  EXPECT_TRUE(IsOriginAllowed("http://localhost:8080", "localhost:8080", local));
  EXPECT_TRUE(IsOriginAllowed("http://127.0.0.1:8080", "127.0.0.1:8080", local));
  EXPECT_TRUE(IsOriginAllowed("http://[::1]:8080", "[::1]:8080", local));
  EXPECT_TRUE(IsOriginAllowed("http://lab.localhost", "lab.localhost:80", local));
  EXPECT_TRUE(IsOriginAllowed("https://viewer.example", "127.0.0.1:8080", local));
  EXPECT_TRUE(IsOriginAllowed("https://lab.example", "lab.example", open));
  EXPECT_FALSE(IsOriginAllowed("http://lab.example:8080", "lab.example:8080", local));
  EXPECT_FALSE(IsOriginAllowed("http://localhost:8081", "localhost:8080", local));
  EXPECT_FALSE(IsOriginAllowed("http://localhost.evil.example", "localhost", open));
  EXPECT_FALSE(IsOriginAllowed("http://evil.example", "lab.example", open));
  EXPECT_FALSE(IsOriginAllowed("null", "null", open));
  EXPECT_FALSE(IsOriginAllowed("", "", open));
}

TEST(IsHostAllowed, OnLoopbackAcceptsThisMachineAndTheRules) {
  const WebRules local{
      .origins = {"https://lab.example:8443"}, .hosts = {"viewer.example"}, .is_local = true};
  for (const char* host : {"localhost", "Localhost:8080", "lab.localhost", "127.0.0.1",
                           "127.8.8.8:1", "[::1]", "[::1]:80", "viewer.example:1", "LAB.example"}) {
    EXPECT_TRUE(IsHostAllowed(host, local)) << host;
  }
  for (const char* host :
       {"", ":80", "evil.example", "viewer.example.evil.example", "192.0.2.1", "[2001:db8::1]",
        "evil.example:localhost", "localhost:x", "127.0.0.1x"}) {
    EXPECT_FALSE(IsHostAllowed(host, local)) << host;
    EXPECT_TRUE(IsHostAllowed(host, {.is_local = false, .any_host = true})) << host;
  }
}

TEST(IsHostAllowed, ElsewhereAcceptsAlsoAddresses) {
  const WebRules open{
      .origins = {"https://lab.example:8443"}, .hosts = {"viewer.example"}, .is_local = false};
  for (const char* host :
       {"localhost:8080", "127.0.0.1", "192.0.2.1", "192.0.2.1:8080", "[2001:db8::1]",
        "[2001:DB8::1]:8080", "[::1]", "viewer.example:1", "LAB.example"}) {
    EXPECT_TRUE(IsHostAllowed(host, open)) << host;
  }
  for (const char* host : {"", ":80", "evil.example", "viewer.example.evil.example", "192.0.2.1x",
                           "192.0.2.1.evil.example", "192.0.2", "2001:db8::1", "[192.0.2.1]",
                           "[2001:db8::1", "beef", "0x7f.1"}) {
    EXPECT_FALSE(IsHostAllowed(host, open)) << host;
  }
}

TEST(NormalHostName, IsANameWithoutAPort) {
  EXPECT_EQ(*NormalHostName("Viewer.Example"), "viewer.example");
  EXPECT_EQ(*NormalHostName("192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(*NormalHostName("[2001:DB8::1]"), "[2001:db8::1]");
  for (const char* text : {"", "a:80", "[::1]:80", "http://a", "a/b", "a b", "*"}) {
    EXPECT_FALSE(NormalHostName(text).ok()) << text;
  }
}

TEST(Understand, RefusesATransferEncodingBeforeHttp11) {
  WebRequest request{.method = "GET",
                     .target = "/v1/healthz",
                     .hosts = {"localhost"},
                     .transfer_encodings = {"chunked"}};
  EXPECT_TRUE(std::holds_alternative<WebHealth>(Understand(request, {}).what));
  request.is_before_1_1 = true;
  EXPECT_EQ(std::get<WebRefused>(Understand(request, {}).what).http_status, 400u);
  request.transfer_encodings = {};
  EXPECT_TRUE(std::holds_alternative<WebHealth>(Understand(request, {}).what));
}

TEST(Understand, KnowsWhatIsAskedFor) {
  WebRequest request{.method = "GET", .target = "/v1/watch", .hosts = {"localhost"}};
  const auto refused = [&] {
    const auto refusal = std::get<WebRefused>(Understand(request, {}).what);
    EXPECT_TRUE(refusal.rule.starts_with("the ")) << "a whole sentence: " << refusal.rule;
    return refusal.http_status;
  };
  EXPECT_EQ(refused(), 426u);
  request.is_upgrade = true;
  EXPECT_EQ(refused(), 400u);
  request.protocols = {"partiemc.v1"};
  request.authorizations = {"Bearer abc"};
  const WebCall call = std::get<WebCall>(Understand(request, {}).what);
  EXPECT_EQ(call.method, WebMethod::kWatch);
  EXPECT_EQ(call.authorization, "Bearer abc");
  EXPECT_FALSE(call.from_page);
  request.protocols = {"partiemc.v1, bearer.YWJj"};
  EXPECT_EQ(std::get<WebCall>(Understand(request, {}).what).authorization, std::nullopt);
  request.authorizations = {};
  EXPECT_EQ(std::get<WebCall>(Understand(request, {}).what).authorization, "Bearer abc");
  request.origins = {"http://evil.example"};
  EXPECT_EQ(refused(), 403u);
  request.origins = {"http://localhost"};
  EXPECT_TRUE(std::get<WebCall>(Understand(request, {}).what).from_page);
  request.method = "POST";
  EXPECT_EQ(refused(), 405u);
  request.target = "/v1/frame";
  EXPECT_EQ(refused(), 415u);
  request.content_type = "Application/X-Protobuf; messageType=x";
  const WebAnswer post = Understand(request, {});
  EXPECT_EQ(std::get<WebCall>(post.what).method, WebMethod::kFrame);
  EXPECT_EQ(post.allowed_origin, "http://localhost");
  request.transfer_encodings = {"chunked"};
  EXPECT_EQ(std::get<WebCall>(Understand(request, {}).what).method, WebMethod::kFrame);
  for (const std::string_view encoding : {"gzip", "Chunked", "gzip, chunked", "chunked,", ""}) {
    request.transfer_encodings = {encoding};
    EXPECT_EQ(refused(), 400u) << encoding;
  }
  request.transfer_encodings = {"chunked", "chunked"};
  EXPECT_EQ(refused(), 400u);
  request.transfer_encodings = {};
  request.hosts = {"evil.example"};
  EXPECT_EQ(refused(), 421u);
  request.hosts = {"localhost", "localhost"};
  EXPECT_EQ(refused(), 400u);
}

// The field and value of a refusal, as they are in the log.
std::string Shown(const WebRequest& request) {
  const auto refused = std::get<WebRefused>(Understand(request, {}).what);
  return std::string(
      ToStatus(refused).message().substr(0, refused.field.size() + 2 + refused.value.size() + 2));
}

TEST(WebRefused, NamesFieldAndValue) {
  const WebRequest good{.method = "GET", .target = "/v1/watch", .hosts = {"localhost"}};
  const auto shown = [&](auto change) {
    WebRequest request = good;
    change(request);
    return Shown(request);
  };
  EXPECT_EQ(shown([](auto& r) { r.hosts = {"evil.example:1"}; }), "Host: evil.example:1; ");
  EXPECT_EQ(shown([](auto& r) { r.hosts = {}; }), "Host: 0 headers; ");
  EXPECT_EQ(shown([](auto& r) { r.origins = {"http://evil.example"}; }),
            "Origin: http://evil.example; ");
  EXPECT_EQ(shown([](auto& r) { r.target = "/v1/nothing"; }), "path: /v1/nothing; ");
  EXPECT_EQ(shown([](auto& r) { r.target = "/.git/config"; }), "path: /.git/config; ");
  EXPECT_EQ(shown([](auto& r) { r.method = "PUT"; }), "method: PUT; ");
  EXPECT_EQ(shown([](auto&) {}), "Upgrade: none; ");
  EXPECT_EQ(shown([](auto& r) { r.transfer_encodings = {"gzip"}; }), "Transfer-Encoding: gzip; ");
  EXPECT_EQ(shown([](auto& r) { r.method = "POST", r.target = "/v1/info"; }),
            "Content-Type: empty; ");
  EXPECT_EQ(FindViolation(ToStatus(std::get<WebRefused>(Understand(good, {}).what)))->reason,
            "malformed");
}

TEST(WebRefused, ValueIsShortAndPrintable) {
  const std::string name(100, 'a');
  EXPECT_EQ(Shown({.method = "GET", .target = "/", .hosts = {name + "b"}}),
            "Host: " + name + "...; ");
  EXPECT_EQ(Shown({.method = "GET", .target = "/", .hosts = {"a\x1b[2J\xff"}}),
            "Host: a\\u001b[2J\\xff; ");
}

TEST(WebRefused, ValueHasNoSecret) {
  for (const char* target :
       {"/v1/x?token=secret", "/.x?token=secret", "http://user:secret@host/"}) {
    EXPECT_THAT(Shown({.method = "GET", .target = target, .hosts = {"localhost"}}),
                Not(HasSubstr("secret")));
  }
  WebRequest request{.method = "GET",
                     .target = "/v1/watch",
                     .hosts = {"localhost"},
                     .authorizations = {"Bearer secret"},
                     .protocols = {"bearer.secret, bearer.secret, partiemc.v1"},
                     .is_upgrade = true};
  EXPECT_EQ(Shown(request), "Sec-WebSocket-Protocol: a wrong token, or several; ");
  request.protocols = {"bearer.c2VjcmV0"};
  EXPECT_EQ(Shown(request), "Sec-WebSocket-Protocol: without partiemc.v1; ");
  request.origins = {"https://user:secret@evil.example"};
  EXPECT_THAT(Shown(request), Not(HasSubstr("secret")));
}

}  // namespace
}  // namespace partiemc::server
