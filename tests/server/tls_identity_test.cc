// Certificate and key files: errors are found when they are read.
#include "server/security/tls_identity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include "server/web/tls_contexts.h"
#include "support/certificates.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class TlsIdentityFiles : public ::testing::Test {
 protected:
  TlsIdentityFiles() {
    Write(files_.certificate, issued_.certificate);
    Write(files_.key, issued_.key);
    Write(files_.client_ca, authority_.certificate());
  }

  static void Write(const std::string& path, const std::string& text) {
    std::ofstream(path) << text;
  }
  std::string Refused() const {
    const auto identity = ReadTlsIdentity(files_);
    return identity.ok() ? "accepted" : std::string(identity.status().message());
  }

  const support::TemporaryFolder folder_;
  TlsFiles files_{folder_.Path("server.pem"), folder_.Path("server.key"),
                  folder_.Path("clients.pem")};
  CertificateAuthority authority_{"authority"};
  IssuedCertificate issued_ = authority_.Issue("server");
};

TEST_F(TlsIdentityFiles, AreReadAsTheyAre) {
  const auto identity = ReadTlsIdentity(files_);
  ASSERT_TRUE(identity.ok()) << identity.status();
  EXPECT_EQ(identity->certificate, issued_.certificate);
  EXPECT_EQ(identity->key, issued_.key);
  EXPECT_EQ(identity->client_ca, authority_.certificate());
  const auto left = identity->not_after - std::chrono::system_clock::now();
  EXPECT_GT(left, std::chrono::minutes(50));
  EXPECT_LE(left, std::chrono::hours(1));
}

TEST_F(TlsIdentityFiles, TheGatewayDoesNotStartWithAChainThatIsDamaged) {
  CurrentTlsIdentity current;
  current.Set({.certificate = issued_.certificate, .key = issued_.key, .client_ca = ""});
  EXPECT_TRUE(TlsContexts(current).Check().ok());
  current.Set({.certificate = issued_.certificate +
                              "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n",
               .key = issued_.key,
               .client_ca = ""});
  const absl::Status refused = TlsContexts(current).Check();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--tls-cert"));
}

TEST_F(TlsIdentityFiles, AnExpiredCertificateIsReadAndItsEndKnown) {
  Write(files_.certificate, issued_.certificate);
  const auto expired = authority_.Issue("server", std::chrono::hours(-2));
  Write(files_.certificate, expired.certificate);
  Write(files_.key, expired.key);
  const auto identity = ReadTlsIdentity(files_);
  ASSERT_TRUE(identity.ok()) << identity.status();
  EXPECT_LT(identity->not_after, std::chrono::system_clock::now() - std::chrono::hours(1));
}

TEST_F(TlsIdentityFiles, AMissingFileIsNamedWithItsFlag) {
  const TlsFiles whole = files_;
  files_.certificate = folder_.Path("none");
  EXPECT_THAT(Refused(), AllOf(HasSubstr("--tls-cert " + folder_.Path("none")),
                               HasSubstr("No such file or directory")));
  files_ = whole;
  files_.key = folder_.Path("none");
  EXPECT_THAT(Refused(), HasSubstr("--tls-key " + folder_.Path("none")));
  files_ = whole;
  files_.client_ca = folder_.path();
  EXPECT_THAT(Refused(), AllOf(HasSubstr("--tls-client-ca " + folder_.path().string()),
                               HasSubstr("cannot be")));
}

TEST_F(TlsIdentityFiles, ABrokenFileIsNamedAndNothingOfItShown) {
  Write(files_.certificate, issued_.key);
  EXPECT_THAT(Refused(), AllOf(HasSubstr(files_.certificate), HasSubstr("must hold a certificate"),
                               Not(HasSubstr("PRIVATE KEY"))));
  Write(files_.certificate, issued_.certificate.substr(0, issued_.certificate.size() / 2));
  EXPECT_THAT(Refused(), HasSubstr("must hold a certificate"));
  Write(files_.certificate, issued_.certificate);
  Write(files_.key, "secret");
  EXPECT_THAT(Refused(), AllOf(HasSubstr(files_.key), HasSubstr("must hold a private key"),
                               Not(HasSubstr("secret"))));
  Write(files_.key, issued_.key);
  Write(files_.client_ca, "");
  EXPECT_THAT(Refused(), AllOf(HasSubstr(files_.client_ca), HasSubstr("must hold a certificate")));
  Write(files_.client_ca, std::string((1u << 20) + 1, 'x'));
  EXPECT_THAT(Refused(), HasSubstr("must be at most 1 MiB"));
}

TEST_F(TlsIdentityFiles, AKeyOfAnotherCertificateIsRefused) {
  Write(files_.key, authority_.Issue("server").key);
  EXPECT_THAT(Refused(), AllOf(HasSubstr(files_.key), HasSubstr(files_.certificate),
                               HasSubstr("must be the key of")));
}

}  // namespace
}  // namespace partiemc::server
