#include "server/rpc/health_check.h"

#include <grpcpp/grpcpp.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "server/security/tls_identity.h"

namespace partiemc::server {

namespace {

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeCredentials(
    const HealthCheckSecurity& security) {
  if (!security.tls) return grpc::InsecureChannelCredentials();
  namespace experimental = grpc::experimental;
  experimental::TlsChannelCredentialsOptions options;
  options.set_verify_server_certs(false);
  options.set_check_call_host(false);
  options.set_certificate_verifier(std::make_shared<experimental::NoOpCertificateVerifier>());
  if (!security.certificate_file.empty()) {
    const auto certificate = ReadSmallFile("--tls-cert", security.certificate_file);
    if (!certificate.ok()) return certificate.status();
    const auto key = ReadSmallFile("--tls-key", security.key_file);
    if (!key.ok()) return key.status();
    options.set_certificate_provider(std::make_shared<experimental::StaticDataCertificateProvider>(
        std::vector<experimental::IdentityKeyCertPair>{{*key, *certificate}}));
    options.watch_identity_key_cert_pairs();
  }
  return experimental::TlsCredentials(options);
}

}  // namespace

absl::Status CheckHealth(const Address& address, std::chrono::milliseconds timeout,
                         const HealthCheckSecurity& security) {
  const auto credentials = MakeCredentials(security);
  if (!credentials.ok()) return credentials.status();
  namespace health = grpc::health::v1;
  const auto stub = health::Health::NewStub(grpc::CreateChannel(address.ToString(), *credentials));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  health::HealthCheckRequest request;
  request.set_service("partiemc.v1.ReconstructionService");
  health::HealthCheckResponse response;
  const grpc::Status status = stub->Check(&context, request, &response);
  if (!status.ok()) {
    return absl::UnavailableError(absl::StrCat("no healthy server at ", address.ToString(), ": ",
                                               status.error_message(),
                                               "; is it running, and is this its --address?"));
  }
  if (response.status() != health::HealthCheckResponse::SERVING) {
    return absl::UnavailableError(
        absl::StrCat("the server at ", address.ToString(), " is not serving; it is draining"));
  }
  return absl::OkStatus();
}

}  // namespace partiemc::server
