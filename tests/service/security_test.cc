// Who may speak to a server, and how: TLS, certificates of clients, tokens; all of it replaced
// while the server runs.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/health_check.h"
#include "service/captured_log.h"
#include "service/service_testing.h"
#include "support/certificates.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kToken[] = "alice-secret-0123456789";
constexpr char kOtherToken[] = "bob-secret-0123456789ab";
constexpr std::chrono::seconds kHealthTimeout{30};
// Against hanging: a change of files counts some milliseconds after it.
constexpr std::chrono::seconds kEventually{120};

bool Eventually(const std::function<bool()>& holds) {
  const auto deadline = std::chrono::steady_clock::now() + kEventually;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

// What a client brings along.
struct Client {
  bool tls = true;
  std::string authority;  // That it trusts.
  IssuedCertificate own = {};
  std::string token = {};
};

class Security : public ::testing::Test {
 protected:
  Security() { std::filesystem::create_directories(folder_); }
  ~Security() override {
    server_.reset();
    std::filesystem::remove_all(folder_);
  }

  std::string Path(const std::string& name) const { return folder_ + "/" + name; }
  // As a careful operator does it: whole or not at all.
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(Path(name + ".part")) << text;
    std::filesystem::rename(Path(name + ".part"), Path(name));
  }
  void WriteIdentity(const IssuedCertificate& identity) const {
    Write("server.pem", identity.certificate);
    Write("server.key", identity.key);
  }

  ServerOptions Options(bool tls, bool client_ca, bool tokens) const {
    ServerOptions options = TestOptions();
    options.reload_interval = std::chrono::milliseconds(10);
    if (tls) {
      options.tls = {Path("server.pem"), Path("server.key"), client_ca ? Path("clients.pem") : ""};
    }
    if (tokens) options.token_file = Path("tokens");
    return options;
  }

  // A connection of its own.
  std::shared_ptr<grpc::Channel> Channel(const Client& client) const {
    grpc::ChannelArguments arguments;
    arguments.SetMaxReceiveMessageSize(-1);
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto credentials = client.tls
                                 ? grpc::SslCredentials({.pem_root_certs = client.authority,
                                                         .pem_private_key = client.own.key,
                                                         .pem_cert_chain = client.own.certificate})
                                 : grpc::InsecureChannelCredentials();
    return grpc::CreateCustomChannel(server_->address().ToString(), credentials, arguments);
  }

  struct End {
    grpc::StatusCode code;
    std::string reason, message;
  };
  // How a call of GetServerInfo ends.
  End Ask(const Client& client) const { return Ask(Channel(client), client.token); }
  static End Ask(const std::shared_ptr<grpc::Channel>& channel, const std::string& token) {
    return Call(channel,
                v1::ReconstructionService::service_full_name() + std::string("/GetServerInfo"),
                token.empty() ? "" : "Bearer " + token);
  }
  // How a call of any method ends that sends one empty message; streams are told after it that no
  // more will come.
  static End Call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                  const std::string& authorization) {
    grpc::ClientContext context;
    SetDeadline(context);
    if (!authorization.empty()) context.AddMetadata("authorization", authorization);
    grpc::GenericStub stub(channel);
    grpc::CompletionQueue queue;
    const auto call = stub.PrepareCall(&context, "/" + method, &queue);
    const auto step = [&] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    call->StartCall(nullptr);
    bool goes_on = step();
    const grpc::Slice nothing;
    if (goes_on) {
      call->WriteLast(grpc::ByteBuffer(&nothing, 1), {}, nullptr);
      goes_on = step();
    }
    while (goes_on) {
      grpc::ByteBuffer answer;
      call->Read(&answer, nullptr);
      goes_on = step();
    }
    grpc::Status status;
    call->Finish(&status, nullptr);
    EXPECT_TRUE(step());
    return {status.error_code(), ReasonOf(context), status.error_message()};
  }

  const std::string folder_ = ::testing::TempDir() + "/partiemc_security_" +
                              std::to_string(getpid()) + "_" +
                              ::testing::UnitTest::GetInstance()->current_test_info()->name();
  CertificateAuthority authority_{"authority"}, stranger_{"stranger"};
  std::unique_ptr<Server> server_;
};

TEST_F(Security, StreamsOverTlsAreTheSameBits) {
  WriteIdentity(authority_.Issue("server"));
  server_ = StartServer(Options(/*tls=*/true, /*client_ca=*/false, /*tokens=*/false));
  EXPECT_EQ(StreamedDigests(Channel({.authority = authority_.certificate()}), 3, 5),
            LocalDigests(3, 5));
}

TEST_F(Security, WhoDoesNotTrustTheServerOrSpeaksInTheClearDoesNotComeIn) {
  WriteIdentity(authority_.Issue("server"));
  server_ = StartServer(Options(true, false, false));
  const std::string authority = authority_.certificate();
  EXPECT_EQ(Ask({.authority = authority}).code, grpc::StatusCode::OK);
  EXPECT_EQ(Ask({.authority = stranger_.certificate()}).code, grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(Ask({.tls = false}).code, grpc::StatusCode::UNAVAILABLE);
}

TEST_F(Security, AnExpiredServerIsNotTrustedUntilItsCertificateIsReplaced) {
  WriteIdentity(authority_.Issue("server", std::chrono::hours(-2)));
  server_ = StartServer(Options(true, false, false));
  const Client client{.authority = authority_.certificate()};
  EXPECT_EQ(Ask(client).code, grpc::StatusCode::UNAVAILABLE);
  WriteIdentity(authority_.Issue("server"));
  EXPECT_TRUE(Eventually([&] { return Ask(client).code == grpc::StatusCode::OK; }));
}

TEST_F(Security, AClientNeedsACertificateOfTheAuthorityWhereOneIsAskedFor) {
  WriteIdentity(stranger_.Issue("server"));
  Write("clients.pem", authority_.certificate());
  server_ = StartServer(Options(true, /*client_ca=*/true, false));
  const auto code = [&](const IssuedCertificate& own) {
    return Ask({.authority = stranger_.certificate(), .own = own}).code;
  };
  EXPECT_EQ(code(authority_.Issue("client")), grpc::StatusCode::OK);
  EXPECT_EQ(code({}), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(code(stranger_.Issue("client")), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(code(authority_.Issue("client", std::chrono::hours(-2))),
            grpc::StatusCode::UNAVAILABLE);
}

TEST_F(Security, TheHealthCheckOfTheProgramPassesOverTlsAndShowsACertificateWhereAskedTo) {
  WriteIdentity(authority_.Issue("server"));
  Write("clients.pem", authority_.certificate());
  server_ = StartServer(Options(true, true, false));
  const Address& address = server_->address();
  EXPECT_TRUE(
      CheckHealth(
          address, kHealthTimeout,
          {.tls = true, .certificate_file = Path("server.pem"), .key_file = Path("server.key")})
          .ok());
  EXPECT_FALSE(CheckHealth(address, kHealthTimeout, {.tls = true}).ok());
  EXPECT_FALSE(CheckHealth(address, kHealthTimeout, {}).ok());
}

TEST_F(Security, EveryMethodWantsAToken) {
  Write("tokens", std::string(kToken) + " alice\n");
  server_ = StartServer(Options(false, false, /*tokens=*/true));
  const auto channel = Connect(*server_, Transport::kTcp);
  const auto* service =
      v1::GetServerInfoRequest::descriptor()->file()->FindServiceByName("ReconstructionService");
  ASSERT_GE(service->method_count(), 5);
  for (int i = 0; i < service->method_count(); ++i) {
    const std::string method = service->full_name() + "/" + service->method(i)->name();
    SCOPED_TRACE(method);
    const End absent = Call(channel, method, "");
    EXPECT_EQ(absent.code, grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(absent.reason, "TOKEN_MISSING");
    EXPECT_THAT(absent.message, HasSubstr("--token-file"));
    const End basic = Call(channel, method, std::string("Basic ") + kToken);
    EXPECT_EQ(basic.code, grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(basic.reason, "TOKEN_MISSING");
    const End wrong = Call(channel, method, std::string("Bearer ") + kOtherToken);
    EXPECT_EQ(wrong.code, grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(wrong.reason, "TOKEN_UNKNOWN");
    EXPECT_THAT(wrong.message, Not(HasSubstr("secret")));
    EXPECT_NE(Call(channel, method, std::string("Bearer ") + kToken).code,
              grpc::StatusCode::UNAUTHENTICATED);
  }
}

TEST_F(Security, ReflectionWantsATokenAndHealthDoesNot) {
  Write("tokens", kToken);
  server_ = StartServer(Options(false, false, true));
  const auto channel = Connect(*server_, Transport::kTcp);
  const std::string reflection = "grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";
  const End refused = Call(channel, reflection, "");
  EXPECT_EQ(refused.code, grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(refused.message, HasSubstr("authorization"));
  EXPECT_EQ(Call(channel, reflection, std::string("Bearer ") + kOtherToken).code,
            grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(Call(channel, reflection, std::string("Bearer ") + kToken).code, grpc::StatusCode::OK);
  EXPECT_TRUE(CheckHealth(server_->address(), kHealthTimeout).ok());
  const End health = Call(channel, "grpc.health.v1.Health/Check", "");
  EXPECT_EQ(health.code, grpc::StatusCode::OK) << health.message;
}

TEST_F(Security, AStreamIsOpenedWithATokenAndGoesOnWhenItIsTakenBack) {
  Write("tokens", kToken);
  server_ = StartServer(Options(false, false, true));
  const auto channel = Connect(*server_, Transport::kTcp);
  grpc::ClientContext context;
  SetDeadline(context);
  context.AddMetadata("authorization", std::string("Bearer ") + kToken);
  const auto stub = v1::ReconstructionService::NewStub(channel);
  const auto stream = stub->Reconstruct(&context);
  v1::ReconstructResponse answer;
  ASSERT_TRUE(stream->Write(OpenRequest()) && stream->Read(&answer) && answer.has_opened());
  Write("tokens", kOtherToken);
  EXPECT_TRUE(
      Eventually([&] { return Ask(channel, kToken).code == grpc::StatusCode::UNAUTHENTICATED; }));
  ASSERT_TRUE(stream->Write(BlobRequest(1, 1, 0)) && stream->Read(&answer) && answer.has_frame());
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(Security, TokensAreReloadedAndABrokenFileKeepsThoseThatWereThere) {
  Write("tokens", kToken);
  server_ = StartServer(Options(false, false, true));
  const auto channel = Connect(*server_, Transport::kTcp);
  const auto comes_in = [&](const char* token) {
    return Ask(channel, token).code == grpc::StatusCode::OK;
  };
  EXPECT_TRUE(comes_in(kToken));
  EXPECT_FALSE(comes_in(kOtherToken));
  Write("tokens", kOtherToken);
  EXPECT_TRUE(Eventually([&] { return comes_in(kOtherToken); }));
  EXPECT_FALSE(comes_in(kToken));

  const CapturedLog log;
  Write("tokens", "short");
  EXPECT_TRUE(Eventually([&] { return log.Count("tokens not reloaded") == 1; }));
  std::filesystem::remove(Path("tokens"));
  EXPECT_TRUE(Eventually([&] { return log.Count("tokens not reloaded") == 2; }));
  EXPECT_THAT(log.Text(), HasSubstr(Path("tokens")));
  EXPECT_TRUE(comes_in(kOtherToken));
  EXPECT_FALSE(Ask(channel, "").code == grpc::StatusCode::OK);
  Write("tokens", kToken);
  EXPECT_TRUE(Eventually([&] { return comes_in(kToken); }));
  EXPECT_EQ(log.Count("tokens not reloaded"), 2u);
}

TEST_F(Security, WhatDoesNotHoldIsToldAtTheStart) {
  const auto told = [](const ServerOptions& options) {
    const auto server = Server::Start(options);
    EXPECT_EQ(server.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(server.status().message());
  };
  EXPECT_THAT(told(Options(true, false, false)), HasSubstr("--tls-cert " + Path("server.pem")));
  EXPECT_THAT(told(Options(false, false, true)), HasSubstr("--token-file " + Path("tokens")));
  WriteIdentity({authority_.Issue("server").certificate, authority_.Issue("server").key});
  EXPECT_THAT(told(Options(true, false, false)), HasSubstr("must be the key of"));
  Write("tokens", "short-secret");
  EXPECT_THAT(told(Options(false, false, true)), HasSubstr("line 1"));

  // In the clear beyond this machine.
  Write("tokens", kToken);
  ServerOptions options = Options(false, false, true);
  options.address.host = "0.0.0.0";
  EXPECT_THAT(told(options), HasSubstr("tokens would travel in the clear"));
  WriteIdentity(authority_.Issue("server"));
  options = Options(true, false, true);
  options.address.host = "0.0.0.0";
  EXPECT_TRUE(Server::Start(options).ok());
}

// PARTIEMC_ROTATIONS=50 for the full form.
int Rotations() {
  const char* const text = std::getenv("PARTIEMC_ROTATIONS");
  return text == nullptr ? 5 : std::atoi(text);
}

TEST_F(Security, CertificatesAreRotatedUnderLoadWithoutADroppedStream) {
  constexpr unsigned kStreams = 4;
  constexpr std::uint64_t kFrames = 8;  // Of one round.
  WriteIdentity(authority_.Issue("server"));
  server_ = StartServer(Options(true, false, false));
  ASSERT_NE(server_, nullptr);

  // Streams that go on from before the first rotation until after the last.
  std::atomic<bool> enough = false;
  std::atomic<std::uint64_t> opened = 0, answered = 0, wrong = 0;
  std::vector<std::thread> streams;
  for (unsigned seed = 1; seed <= kStreams; ++seed) {
    streams.emplace_back([&, seed, channel = Channel({.authority = authority_.certificate()})] {
      const auto expected = LocalDigests(seed, kFrames);
      StreamClient client(channel);
      ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
      ++opened;
      for (std::uint64_t i = 0; !enough; ++i) {
        const auto answer =
            client.SendAndReceive(BlobRequest(i + 1, seed, std::min(i, kFrames - 1)));
        ASSERT_EQ(answer.frame().sequence(), i + 1);
        if (i < kFrames && answer.frame().rings_digest() != expected[i].rings) ++wrong;
        ++answered;
      }
      client.HalfClose();
      EXPECT_TRUE(client.Finish().ok());
    });
  }

  EXPECT_TRUE(Eventually([&] { return opened == kStreams; }));
  const CapturedLog log;
  std::string old_authority = authority_.certificate();
  for (int rotation = 1; rotation <= Rotations(); ++rotation) {
    // A key that does not belong to the certificate, as in the midst of a careless rotation: the
    // old identity stays.
    const CertificateAuthority next("authority-" + std::to_string(rotation));
    const IssuedCertificate fresh = next.Issue("server");
    Write("server.key", fresh.key);
    EXPECT_TRUE(Eventually([&] {
      return log.Count("TLS certificate not reloaded") == static_cast<std::size_t>(rotation);
    }));
    EXPECT_EQ(Ask({.authority = old_authority}).code, grpc::StatusCode::OK) << rotation;
    // The other half of it: the new one counts, and the old authority no more.
    Write("server.pem", fresh.certificate);
    EXPECT_TRUE(Eventually([&] {
      return Ask({.authority = next.certificate()}).code == grpc::StatusCode::OK;
    })) << rotation;
    EXPECT_EQ(Ask({.authority = old_authority}).code, grpc::StatusCode::UNAVAILABLE) << rotation;
    old_authority = next.certificate();
    const std::uint64_t so_far = answered;
    EXPECT_TRUE(Eventually([&] { return answered > so_far; }));
  }
  enough = true;
  for (std::thread& stream : streams) stream.join();
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(log.Count("stream closed"), kStreams);
  EXPECT_EQ(log.Count("status=OK"), kStreams);
  std::printf("%d rotations, %llu frames answered on %u streams\n", Rotations(),
              static_cast<unsigned long long>(answered), kStreams);
}

TEST_F(Security, NoSecretIsEverInTheLog) {
  const IssuedCertificate identity = authority_.Issue("server");
  WriteIdentity(identity);
  Write("tokens", std::string(kToken) + " alice\n");
  const CapturedLog log(LogFormat::kJson);
  server_ = StartServer(Options(true, false, true));
  const Client client{.authority = authority_.certificate()};
  const auto channel = Channel(client);
  for (const char* token : {kToken, kOtherToken, ""}) Ask(channel, token);
  grpc::ClientContext context;
  SetDeadline(context);
  context.AddMetadata("authorization", std::string("Bearer ") + kOtherToken);
  v1::ReconstructionService::NewStub(channel)->Reconstruct(&context)->Finish();
  Ask({.authority = stranger_.certificate(), .token = kToken});
  Write("tokens", std::string(kToken) + "\n" + kToken + "\n");
  Write("server.key", authority_.Issue("server").key);
  EXPECT_TRUE(Eventually([&] { return log.Count("not reloaded") == 2; }));
  server_.reset();
  EXPECT_THAT(log.Text(), HasSubstr("grpc: "));  // What gRPC says is in it too.
  EXPECT_THAT(log.Text(), Not(HasSubstr("secret")));
  EXPECT_THAT(log.Text(), Not(HasSubstr("PRIVATE")));
  const std::size_t line = identity.key.find('\n') + 1;
  EXPECT_THAT(log.Text(), Not(HasSubstr(identity.key.substr(line, 40))));
}

}  // namespace
}  // namespace partiemc::server
