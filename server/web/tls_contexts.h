// TLS contexts of the gateway, with the same identity as gRPC.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <cstdint>
#include <memory>

#include "server/security/tls_identity.h"

namespace partiemc::server {

/// Provides the TLS context for new connections. Open connections keep theirs.
class TlsContexts {
 public:
  /// `current` must have an identity and outlive this object. Whether clients need a certificate is
  /// decided here, as for gRPC.
  explicit TlsContexts(const CurrentTlsIdentity& current);

  /// The context of the current identity. If OpenSSL rejects it, the previous context, or null.
  std::shared_ptr<boost::asio::ssl::context> Get();

 private:
  const CurrentTlsIdentity& current_;
  const bool asks_clients_;
  std::uint64_t version_ = 0;  // Version of context_.
  std::shared_ptr<boost::asio::ssl::context> context_;
};

}  // namespace partiemc::server
