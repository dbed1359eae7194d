// TLS credentials for gRPC's server, with an identity that can change at run time.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "server/security/tls_identity.h"

namespace partiemc::server {

/// New connections use the current identity; open connections keep theirs. With a client authority,
/// clients need a certificate signed by it. Requires: `current` has an identity and outlives the
/// server.
std::shared_ptr<grpc::ServerCredentials> MakeTlsCredentials(const CurrentTlsIdentity& current);

}  // namespace partiemc::server
