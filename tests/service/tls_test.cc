// TLS: which clients are accepted, and rotation of certificates at run time.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "server/rpc/health_check.h"
#include "service/captured_log.h"
#include "service/security_testing.h"

namespace partiemc::server {
namespace {

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

TEST_F(Security, AnExpiredCertificateReplacesNoValidOne) {
  const CapturedLog log;
  WriteIdentity(authority_.Issue("server"));
  server_ = StartServer(Options(true, false, false));
  const Client client{.authority = authority_.certificate()};
  EXPECT_EQ(Ask(client).code, grpc::StatusCode::OK);
  WriteIdentity(authority_.Issue("server", std::chrono::hours(-2)));
  EXPECT_TRUE(Eventually([&] { return log.Count("has expired; the current one has not") > 0; }));
  EXPECT_EQ(Ask(client).code, grpc::StatusCode::OK);
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

TEST_F(Security, TheHealthCheckWorksOverTlsWithAClientCertificate) {
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

// PARTIEMC_ROTATIONS=50 for the full form.
int Rotations() {
  const char* const text = std::getenv("PARTIEMC_ROTATIONS");
  return text == nullptr ? 5 : std::atoi(text);
}

TEST_F(Security, CertificatesAreRotatedUnderLoadWithoutADroppedStream) {
  constexpr unsigned kStreams = 4;
  constexpr std::uint64_t kFrames = 8;  // Frames of one round.
  WriteIdentity(authority_.Issue("server"));
  server_ = StartServer(Options(true, false, false));
  ASSERT_NE(server_, nullptr);

  // Streams that run from before the first rotation until after the last.
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
    // A key that does not belong to the certificate, as during a careless rotation: the old
    // identity stays.
    const CertificateAuthority next("authority-" + std::to_string(rotation));
    const IssuedCertificate fresh = next.Issue("server");
    Write("server.key", fresh.key);
    EXPECT_TRUE(Eventually([&] {
      return log.Count("TLS certificate not reloaded") == static_cast<std::size_t>(rotation);
    }));
    EXPECT_EQ(Ask({.authority = old_authority}).code, grpc::StatusCode::OK) << rotation;
    // Completes the rotation: the new identity applies, and the old authority no longer.
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

}  // namespace
}  // namespace partiemc::server
