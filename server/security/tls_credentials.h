// TLS for gRPC's server, with an identity that may change while it runs.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "server/security/tls_identity.h"

namespace partiemc::server {

/// Credentials that give every new connection the identity in force; connections that are open keep
/// the one that they began with. With a client authority a client without a certificate of it is
/// refused. `current` has an identity by now; it and the credentials are kept until the server has
/// stopped.
std::shared_ptr<grpc::ServerCredentials> MakeTlsCredentials(const CurrentTlsIdentity& current);

}  // namespace partiemc::server
