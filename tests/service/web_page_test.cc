// The page's files through the gateway, and restrictions for pages of other hosts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "service/web_testing.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

class WebPage : public WebGatewayTest {
 protected:
  WebPage() {
    std::filesystem::create_directories(folder_.Path("page/assets"));
    folder_.Write("secret.txt", "secret");
    folder_.Write("page/index.html", "<html>the page</html>");
    folder_.Write("page/.hidden", "secret");
    folder_.Write("page/assets/app.js", "plain();");
    folder_.Write("page/assets/app.js.gz", "packed, as far as the server knows");
    folder_.Write("page/large.bin", large_);
    options_.web->root = folder_.Path("page");
  }

  const support::TemporaryFolder folder_;
  const std::string large_ = std::string(1'000'000, 'x') + "end";
};

TEST_F(WebPage, FilesComeWithTheirTypeAndWhatKeepsAPageSafe) {
  Serve();
  const HttpReply index = Ask(web(), "GET", "/");
  EXPECT_EQ(index.status, 200u);
  EXPECT_EQ(index.body, "<html>the page</html>");
  EXPECT_EQ(index.headers.at("content-type"), "text/html; charset=utf-8");
  EXPECT_EQ(index.headers.at("cache-control"), "no-cache");
  EXPECT_EQ(index.headers.at("x-content-type-options"), "nosniff");
  EXPECT_THAT(
      index.headers.at("content-security-policy"),
      HasSubstr("default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'"));
  EXPECT_EQ(Ask(web(), "GET", "/index.html?stream=tank").body, index.body);
  EXPECT_EQ(Ask(web(), "GET", "/large.bin").body, large_);
  WebPipe pipe(web());
  const HttpReply head = Ask(pipe, "HEAD", "/large.bin");
  EXPECT_EQ(head.headers.at("content-length"), std::to_string(large_.size()));
  EXPECT_EQ(Ask(pipe, "GET", "/assets/app.js").body, "plain();");  // On the same connection.
  EXPECT_EQ(Ask(web(), "GET", "/nothing.js").status, 404u);
  EXPECT_EQ(Ask(web(), "POST", "/").status, 405u);
  EXPECT_EQ(Ask(web(), "GET", "/v1/nothing").status, 404u);
  EXPECT_EQ(Ask(web(), "GET", "/v1/info").headers.at("allow"), "POST");
}

TEST_F(WebPage, FrameAncestorsAreItselfAndThoseOfTheOptions) {
  options_.web->frame_ancestors = {"HTTPS://Lab.example:443", "http://localhost:8888"};
  Serve();
  EXPECT_THAT(Ask(web(), "GET", "/").headers.at("content-security-policy"),
              EndsWith("; frame-ancestors 'self' https://lab.example http://localhost:8888"));
  server_.reset();
  options_.web->frame_ancestors.clear();
  Serve();
  EXPECT_THAT(Ask(web(), "GET", "/").headers.at("content-security-policy"),
              EndsWith("; frame-ancestors 'self'"));
}

TEST_F(WebPage, PackedFilesComeToThoseWhoTakeThem) {
  Serve();
  const HttpReply plain = Ask(web(), "GET", "/assets/app.js");
  EXPECT_EQ(plain.body, "plain();");
  EXPECT_EQ(plain.headers.at("vary"), "Accept-Encoding");
  const HttpReply packed = Ask(web(), "GET", "/assets/app.js", "Accept-Encoding: br, gzip\r\n");
  EXPECT_EQ(packed.body, "packed, as far as the server knows");
  EXPECT_EQ(packed.headers.at("content-encoding"), "gzip");
  EXPECT_EQ(packed.headers.at("content-type"), "text/javascript; charset=utf-8");
  EXPECT_NE(packed.headers.at("etag"), plain.headers.at("etag"));
  EXPECT_EQ(Ask(web(), "GET", "/assets/app.js", "Accept-Encoding: gzip;q=0\r\n").body, "plain();");
}

TEST_F(WebPage, AFileThatHasNotChangedIsNotSentAgain) {
  Serve();
  const HttpReply first = Ask(web(), "GET", "/");
  const std::string tag = "If-None-Match: " + first.headers.at("etag") + "\r\n";
  WebPipe pipe(web());
  EXPECT_EQ(Ask(pipe, "GET", "/", tag).status, 304u);
  folder_.Write("page/index.html", "<html>another one</html>");
  const HttpReply second = Ask(pipe, "GET", "/", tag);
  EXPECT_EQ(second.status, 200u);
  EXPECT_EQ(second.body, "<html>another one</html>");
}

TEST_F(WebPage, NothingOutsideOfTheFolderIsReached) {
  std::filesystem::create_symlink(folder_.Path("secret.txt"), folder_.Path("page/link.txt"));
  std::filesystem::create_directory_symlink(folder_.Path(""), folder_.Path("page/up"));
  ASSERT_EQ(mkfifo(folder_.Path("page/pipe").c_str(), 0600), 0);
  Serve();
  for (const char* path :
       {"/../secret.txt", "/assets/../../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt",
        "/assets/%2E%2E/%2E%2E/secret.txt", "/.hidden", "//secret.txt", "/link.txt",
        "/up/secret.txt", "/assets", "/assets/", "/pipe", "/index.html%00.js", "/%", "/%zz",
        "/..\\secret.txt", "/./index.html"}) {
    const HttpReply reply = Ask(web(), "GET", path);
    EXPECT_EQ(reply.status, 404u) << path;
    EXPECT_THAT(reply.body, Not(HasSubstr("secret"))) << path;
  }
}

TEST_F(WebGatewayTest, WithoutAPageTheServerSaysHowToGetOne) {
  options_.web->root = "/nowhere";
  Serve();
  const HttpReply reply = Ask(web(), "GET", "/");
  EXPECT_EQ(reply.status, 200u);
  EXPECT_EQ(reply.headers.at("content-type"), "text/plain; charset=utf-8");
  EXPECT_THAT(reply.body, HasSubstr("--web-root"));
}

TEST_F(WebPage, APageOfAnotherHostMayNotCallUnlessItIsAllowed) {
  options_.web->origins = {"https://viewer.example"};
  Serve();
  for (const char* origin : {"http://evil.example", "null", "https://viewer.example.evil.example",
                             "http://viewer.example", "file://"}) {
    const std::string header = std::string("Origin: ") + origin + "\r\n";
    EXPECT_EQ(WebSocketClient(web(), "/v1/watch", header).handshake().status, 403u) << origin;
    EXPECT_EQ(Post(web(), "/v1/info", "", header).status, 403u) << origin;
  }
  EXPECT_EQ(Refusals("origin"), 10);
  // A foreign name that resolves to this machine: it is the same in both headers.
  const std::string pointed = "Host: evil.example:1\r\nOrigin: http://evil.example:1\r\n";
  EXPECT_EQ(WebSocketClient(web(), "/v1/watch", pointed).handshake().status, 421u);
  const std::string twice = OwnOrigin() + "Origin: http://evil.example\r\n";
  EXPECT_EQ(WebSocketClient(web(), "/v1/watch", twice).handshake().status, 403u);

  EXPECT_EQ(WebSocketClient(web(), "/v1/watch", OwnOrigin()).handshake().status, 101u);
  const std::string allowed = "Origin: https://viewer.example\r\n";
  EXPECT_EQ(WebSocketClient(web(), "/v1/watch", allowed).handshake().status, 101u);
  const HttpReply reply = Post(web(), "/v1/info", "", allowed);
  EXPECT_EQ(reply.status, 200u);
  EXPECT_EQ(reply.headers.at("access-control-allow-origin"), "https://viewer.example");
  const HttpReply asked = Ask(web(), "OPTIONS", "/v1/info", allowed);
  EXPECT_EQ(asked.status, 204u);
  EXPECT_EQ(asked.headers.at("access-control-allow-methods"), "POST");
  // Requests that any page can send without a preflight are refused.
  EXPECT_EQ(Ask(web(), "POST", "/v1/info", "Content-Type: text/plain\r\n").status, 415u);
}

}  // namespace
}  // namespace partiemc::server
