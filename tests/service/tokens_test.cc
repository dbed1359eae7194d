// Tokens: which callers are accepted, and what is reported about tokens and keys at the start and
// in the log.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "server/rpc/health_check.h"
#include "service/captured_log.h"
#include "service/security_testing.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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
    EXPECT_NE(Call(channel, method, std::string("bEARER ") + kToken).code,
              grpc::StatusCode::UNAUTHENTICATED)
        << method;
    EXPECT_NE(Call(channel, method, std::string("Bearer ") + kToken).code,
              grpc::StatusCode::UNAUTHENTICATED);
  }
}

TEST_F(Security, ReflectionWantsATokenAndHealthDoesNot) {
  WriteTokens(kToken);
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
  WriteTokens(kToken);
  server_ = StartServer(Options(false, false, true));
  const auto channel = Connect(*server_, Transport::kTcp);
  TimedContext context;
  context.AddMetadata("authorization", std::string("Bearer ") + kToken);
  const auto stub = v1::ReconstructionService::NewStub(channel);
  const auto stream = stub->Reconstruct(&context);
  v1::ReconstructResponse answer;
  ASSERT_TRUE(stream->Write(OpenRequest()) && stream->Read(&answer) && answer.has_opened());
  WriteTokens(kOtherToken);
  EXPECT_TRUE(
      Eventually([&] { return Ask(channel, kToken).code == grpc::StatusCode::UNAUTHENTICATED; }));
  ASSERT_TRUE(stream->Write(BlobRequest(1, 1, 0)) && stream->Read(&answer) && answer.has_frame());
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(Security, TokensAreReloadedAndABrokenFileKeepsThoseThatWereThere) {
  WriteTokens(kToken);
  server_ = StartServer(Options(false, false, true));
  const auto channel = Connect(*server_, Transport::kTcp);
  const auto comes_in = [&](const char* token) {
    return Ask(channel, token).code == grpc::StatusCode::OK;
  };
  EXPECT_TRUE(comes_in(kToken));
  EXPECT_FALSE(comes_in(kOtherToken));
  WriteTokens(kOtherToken);
  EXPECT_TRUE(Eventually([&] { return comes_in(kOtherToken); }));
  EXPECT_FALSE(comes_in(kToken));

  const CapturedLog log;
  WriteTokens("short");
  EXPECT_TRUE(Eventually([&] { return log.Count("tokens not reloaded") == 1; }));
  std::filesystem::remove(Path("tokens"));
  EXPECT_TRUE(Eventually([&] { return log.Count("tokens not reloaded") == 2; }));
  EXPECT_THAT(log.Text(), HasSubstr(Path("tokens")));
  EXPECT_TRUE(comes_in(kOtherToken));
  EXPECT_FALSE(Ask(channel, "").code == grpc::StatusCode::OK);
  WriteTokens(kToken);
  EXPECT_TRUE(Eventually([&] { return comes_in(kToken); }));
  EXPECT_EQ(log.Count("tokens not reloaded"), 2u);
}

// The rest of the line restricts the token.
TEST_F(Security, AHalfWrittenLineOfATokenFileIsNotUsed) {
  const std::string half = std::string(kToken) + " alice";
  const auto may_list = [&] {
    return Call(Connect(*server_, Transport::kTcp), "partiemc.v1.ReconstructionService/ListStreams",
                std::string("Bearer ") + kToken)
               .code == grpc::StatusCode::OK;
  };
  Write("tokens", half);
  const auto refused = Server::Start(Options(false, false, true)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("must end with a newline"));
  Write("tokens", half + " may=watch\n");
  server_ = StartServer(Options(false, false, true));
  EXPECT_FALSE(may_list());
  const CapturedLog log;
  Write("tokens", half);
  EXPECT_TRUE(Eventually([&] { return log.Count("tokens not reloaded") == 1; }));
  EXPECT_THAT(log.Text(), HasSubstr("must end with a newline"));
  EXPECT_FALSE(may_list());
  Write("tokens", half + "\n");
  EXPECT_TRUE(Eventually(may_list));
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
  WriteTokens("short-secret");
  EXPECT_THAT(told(Options(false, false, true)), HasSubstr("line 1"));

  // Without TLS beyond this machine.
  WriteTokens(kToken);
  ServerOptions options = Options(false, false, true);
  options.address.host = "0.0.0.0";
  EXPECT_THAT(told(options), HasSubstr("tokens would travel in the clear"));
  WriteIdentity(authority_.Issue("server"));
  options = Options(true, false, true);
  options.address.host = "0.0.0.0";
  EXPECT_TRUE(Server::Start(options).ok());
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
  TimedContext context;
  context.AddMetadata("authorization", std::string("Bearer ") + kOtherToken);
  v1::ReconstructionService::NewStub(channel)->Reconstruct(&context)->Finish();
  Ask({.authority = stranger_.certificate(), .token = kToken});
  Write("tokens", std::string(kToken) + "\n" + kToken + "\n");
  Write("server.key", authority_.Issue("server").key);
  EXPECT_TRUE(Eventually([&] { return log.Count("not reloaded") == 2; }));
  server_.reset();
  EXPECT_THAT(log.Text(), HasSubstr("\"message\":\"grpc\""));  // Includes gRPC's errors.
  EXPECT_THAT(log.Text(), Not(HasSubstr("secret")));
  EXPECT_THAT(log.Text(), Not(HasSubstr("PRIVATE")));
  const std::size_t line = identity.key.find('\n') + 1;
  EXPECT_THAT(log.Text(), Not(HasSubstr(identity.key.substr(line, 40))));
}

}  // namespace
}  // namespace partiemc::server
