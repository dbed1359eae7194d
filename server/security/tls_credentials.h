// TLS for gRPC's server, with an identity that may change while it runs.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>

#include "server/security/tls_identity.h"

namespace partiemc::server {

/// The identity in force. Safe from any thread.
class CurrentTlsIdentity {
 public:
  struct Version {
    std::uint64_t number = 0;  ///< One more for each change; 0: none yet.
    std::shared_ptr<const TlsIdentity> identity;
  };

  void Set(TlsIdentity identity) {
    auto next = std::make_shared<const TlsIdentity>(std::move(identity));
    const std::lock_guard lock(mutex_);
    version_ = {version_.number + 1, std::move(next)};
  }
  Version Get() const {
    const std::lock_guard lock(mutex_);
    return version_;
  }

 private:
  mutable std::mutex mutex_;
  Version version_;
};

/// Credentials that give every new connection the identity in force; connections that are open keep
/// the one that they began with. With a client authority a client without a certificate of it is
/// refused. `current` has an identity by now; it and the credentials are kept until the server has
/// stopped.
std::shared_ptr<grpc::ServerCredentials> MakeTlsCredentials(const CurrentTlsIdentity& current);

}  // namespace partiemc::server
