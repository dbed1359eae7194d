// TLS of the gateway, with the identity that gRPC has too.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <cstdint>
#include <memory>

#include "server/security/tls_identity.h"

namespace partiemc::server {

/// What a new connection begins with. Connections that are open keep what they began with.
class TlsContexts {
 public:
  /// `current` has an identity by now, and lives longer. Whether clients need a certificate is
  /// decided now, as for gRPC.
  explicit TlsContexts(const CurrentTlsIdentity& current);

  /// Of the identity in force; the one before, or none, where OpenSSL does not take it.
  std::shared_ptr<boost::asio::ssl::context> Get();

 private:
  const CurrentTlsIdentity& current_;
  const bool asks_clients_;
  std::uint64_t version_ = 0;  // Of context_.
  std::shared_ptr<boost::asio::ssl::context> context_;
};

}  // namespace partiemc::server
