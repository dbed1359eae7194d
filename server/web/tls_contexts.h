// The TLS contexts of the gateway, which use the same certificate and key as gRPC.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "server/security/tls_identity.h"

namespace partiemc::server {

/// Provides the TLS context for new connections. Open connections keep the context with which they
/// began. Not thread-safe.
class TlsContexts {
 public:
  /// `current` must have an identity and outlive this object. Whether clients need a certificate is
  /// decided once, in this constructor; gRPC's credentials do the same.
  explicit TlsContexts(const CurrentTlsIdentity& current);

  /// Returns the context of the current identity. If OpenSSL rejects this identity, returns the
  /// previous context, or null if there is none.
  std::shared_ptr<boost::asio::ssl::context> Get();
  /// Returns OK if Get returns a context. Errors: INVALID_ARGUMENT with OpenSSL's reason.
  absl::Status Check();

 private:
  const CurrentTlsIdentity& current_;
  const bool asks_clients_;
  std::uint64_t version_ = 0;  // Version of context_.
  std::shared_ptr<boost::asio::ssl::context> context_;
  std::string error_;  // OpenSSL's reason, if it rejected the last identity.
};

}  // namespace partiemc::server
