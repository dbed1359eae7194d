// TLS, certificates and tokens of the client library, against the real server.
#include "partiemc/client/credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "partiemc/client/server_info.h"
#include "partiemc/client/stream.h"
#include "server/server.h"
#include "support/certificates.h"
#include "support/temporary_folder.h"

namespace partiemc::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kToken[] = "alice-secret-0123456789";
constexpr std::chrono::milliseconds kDeadline{60'000};
// For connections that fail.
constexpr std::chrono::milliseconds kShortDeadline{500};

class ClientCredentials : public ::testing::Test {
 protected:
  ClientCredentials() {
    const auto write = [this](const std::string& name, const std::string& text) {
      folder_.Write(name, text);
    };
    const IssuedCertificate server = authority_.Issue("server"), own = authority_.Issue("client");
    write("ca.pem", authority_.certificate());
    write("stranger.pem", CertificateAuthority("stranger").certificate());
    write("server.pem", server.certificate);
    write("server.key", server.key);
    write("client.pem", own.certificate);
    write("client.key", own.key);
    write("tokens", std::string("# tokens\n") + kToken + " alice\n");
    server::ServerOptions options{.address = {.host = "127.0.0.1", .port = 0}};
    options.tls = {Path("server.pem"), Path("server.key"), Path("ca.pem")};
    options.token_file = Path("tokens");
    auto started = server::Server::Start(options);
    EXPECT_TRUE(started.ok()) << started.status();
    server_ = *std::move(started);
    address_ = server_->address().ToString();
    good_ = {.tls = true,
             .ca_file = Path("ca.pem"),
             .cert_file = Path("client.pem"),
             .key_file = Path("client.key"),
             .token_file = Path("tokens")};
  }

  std::string Path(const std::string& name) const { return folder_.Path(name); }
  absl::Status Ask(const Credentials& credentials,
                   std::chrono::milliseconds deadline = kDeadline) const {
    return GetServerInfo(address_, deadline, credentials).status();
  }

  const support::TemporaryFolder folder_;
  CertificateAuthority authority_{"authority"};
  std::unique_ptr<server::Server> server_;
  std::string address_;
  Credentials good_;
};

TEST_F(ClientCredentials, LetAStreamThrough) {
  const auto stream = Stream::Open(
      address_, {.parameters = {.spacing = 1}, .credentials = good_, .deadline = kDeadline});
  ASSERT_TRUE(stream.ok()) << stream.status();
  std::vector<float> positions;
  for (int k = 0; k < 100; ++k) {
    positions.push_back(static_cast<float>(k % 10));
    positions.push_back(static_cast<float>(k / 10));
  }
  ASSERT_TRUE((*stream)->Send({.positions = std::span<const float>(positions)}, 0).ok());
  ASSERT_TRUE((*stream)->FinishSending().ok());
  Event event;
  ASSERT_EQ(*(*stream)->Receive(event), Received::kEvent);
  EXPECT_EQ(event.kind, Event::Kind::kResult);
  EXPECT_EQ(*(*stream)->Receive(event), Received::kEnd);
}

TEST_F(ClientCredentials, ATokenMayBeGivenInPlaceOfItsFile) {
  Credentials credentials = good_;
  credentials.token_file.clear();
  credentials.token = kToken;
  EXPECT_TRUE(Ask(credentials).ok()) << Ask(credentials);
}

TEST_F(ClientCredentials, AServerThatRefusesThemSaysWhy) {
  Credentials credentials = good_;
  credentials.token_file.clear();
  EXPECT_EQ(Ask(credentials).code(), absl::StatusCode::kUnauthenticated);
  credentials.token = "another-secret-0123456789";
  const absl::Status unknown = Ask(credentials);
  EXPECT_EQ(unknown.code(), absl::StatusCode::kUnauthenticated);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("authorization"));
  EXPECT_THAT(std::string(unknown.message()), Not(HasSubstr("secret")));
}

TEST_F(ClientCredentials, AConnectionThatIsNotTrustedIsUnavailableAndSaysWhatToLookAt) {
  Credentials credentials = good_;
  credentials.ca_file = Path("stranger.pem");
  absl::Status status = Ask(credentials, kShortDeadline);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("invalid certificate"));

  status = Ask({}, kShortDeadline);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("TLS"));

  credentials = good_;
  credentials.cert_file.clear();
  credentials.key_file.clear();
  status = Ask(credentials, kShortDeadline);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
}

TEST_F(ClientCredentials, ThatDoNotHoldAreRefusedByFieldBeforeAnythingIsSent) {
  const auto refused = [this](Credentials credentials, const std::string& address) {
    const auto status = GetServerInfo(address, kShortDeadline, credentials).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("secret")));
    return std::string(status.message());
  };
  Credentials credentials = good_;
  credentials.ca_file = Path("none");
  EXPECT_THAT(refused(credentials, address_), HasSubstr("ca_file: " + Path("none")));
  credentials = good_;
  credentials.key_file = Path("tokens");
  EXPECT_THAT(refused(credentials, address_), HasSubstr("key_file: " + Path("tokens")));
  credentials = good_;
  credentials.key_file.clear();
  EXPECT_THAT(refused(credentials, address_), HasSubstr("cert_file"));
  credentials = good_;
  credentials.tls = false;
  EXPECT_THAT(refused(credentials, address_), HasSubstr("ca_file"));
  credentials = good_;
  credentials.token_file = Path("none");
  EXPECT_THAT(refused(credentials, address_), HasSubstr("token_file: " + Path("none")));
  credentials = good_;
  credentials.token = "secret with blanks";
  EXPECT_THAT(refused(credentials, address_), HasSubstr("token: (not shown)"));
}

TEST_F(ClientCredentials, ATokenLeavesThisMachineOverTlsOnly) {
  for (const char* address :
       {"192.0.2.1:1", "example.org:1", "[2001:db8::1]:1", "127.evil.org:1"}) {
    const auto status = GetServerInfo(address, kShortDeadline, {.token = kToken}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << address;
    EXPECT_THAT(std::string(status.message()), HasSubstr("in the clear")) << address;
  }
  for (const char* address : {"127.0.0.1:1", "localhost:1", "[::1]:1", "unix:/no/such/socket"}) {
    EXPECT_EQ(GetServerInfo(address, kShortDeadline, {.token = kToken}).status().code(),
              absl::StatusCode::kUnavailable)
        << address;
  }
}

// Sets environment variables during a test.
class Environment {
 public:
  void Set(const char* name, const std::string& value) {
    names_.push_back(name);
    setenv(name, value.c_str(), 1);
  }
  ~Environment() {
    for (const char* name : names_) unsetenv(name);
  }

 private:
  std::vector<const char*> names_;
};

TEST_F(ClientCredentials, OfTheEnvironmentLetAQuestionThrough) {
  EXPECT_EQ(ServerFromEnvironment(), "127.0.0.1:50051");
  EXPECT_FALSE(CredentialsFromEnvironment().tls);
  Environment environment;
  environment.Set("PARTIEMC_SERVER", address_);
  environment.Set("PARTIEMC_TLS_CA", good_.ca_file);
  environment.Set("PARTIEMC_TLS_CERT", good_.cert_file);
  environment.Set("PARTIEMC_TLS_KEY", good_.key_file);
  environment.Set("PARTIEMC_TOKEN_FILE", good_.token_file);
  EXPECT_TRUE(CredentialsFromEnvironment().tls);
  const auto info = GetServerInfo(ServerFromEnvironment(), kDeadline, CredentialsFromEnvironment());
  EXPECT_TRUE(info.ok()) << info.status();
}

TEST(EnvironmentOfTheClient, TlsIsOffOnlyWhereItSaysSo) {
  Environment environment;
  for (const char* no : {"", "0", "false", "No", "OFF"}) {
    environment.Set("PARTIEMC_TLS", no);
    EXPECT_FALSE(CredentialsFromEnvironment().tls) << no;
  }
  for (const char* yes : {"1", "true", "yes", "on", "enabled", "?"}) {
    environment.Set("PARTIEMC_TLS", yes);
    EXPECT_TRUE(CredentialsFromEnvironment().tls) << yes;
  }
}

}  // namespace
}  // namespace partiemc::client
