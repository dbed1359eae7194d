#include "server/security/tls_credentials.h"

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>

#include <cstdint>
#include <string>

namespace partiemc::server {
namespace {

// Credentials whose identity (certificate and key) can be replaced: gRPC requests it at every
// handshake (grpc_ssl_server_certificate_config_callback). gRPC's own
// FileWatcherCertificateProvider is not used, because it would accept a key that does not match the
// certificate, and then refuse every client.
class TlsCredentials final : public grpc::ServerCredentials {
 public:
  explicit TlsCredentials(const CurrentTlsIdentity& current) : current_(current) {
    const bool ask_clients = !current.Get().identity->client_ca.empty();
    credentials_ = grpc_ssl_server_credentials_create_with_options(
        grpc_ssl_server_credentials_create_options_using_config_fetcher(
            ask_clients ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                        : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE,
            &TlsCredentials::Fetch, this));
  }
  ~TlsCredentials() override { grpc_server_credentials_release(credentials_); }

  // Not used: partiemc checks tokens itself at the start of each call, because its refusals can
  // then carry a reason.
  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }

  // Returns the current identity to gRPC. gRPC calls this function at every handshake, while it
  // holds a lock.
  static grpc_ssl_certificate_config_reload_status Fetch(
      void* self, grpc_ssl_server_certificate_config** config) {
    auto& credentials = *static_cast<TlsCredentials*>(self);
    const CurrentTlsIdentity::Version version = credentials.current_.Get();
    if (version.number == credentials.fetched_) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const TlsIdentity& identity = *version.identity;
    const grpc_ssl_pem_key_cert_pair pair{identity.key.c_str(), identity.certificate.c_str()};
    // gRPC requires a client authority even if no client certificate is required. In this case it
    // receives the server's own certificate.
    const std::string& authority =
        identity.client_ca.empty() ? identity.certificate : identity.client_ca;
    *config = grpc_ssl_server_certificate_config_create(authority.c_str(), &pair, 1);
    credentials.fetched_ = version.number;
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  const CurrentTlsIdentity& current_;
  grpc_server_credentials* credentials_ = nullptr;
  std::uint64_t fetched_ = 0;  // The version that gRPC uses.
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> MakeTlsCredentials(const CurrentTlsIdentity& current) {
  return std::make_shared<TlsCredentials>(current);
}

}  // namespace partiemc::server
