// TLS credentials for gRPC's server, whose identity (certificate and key) can be replaced at run
// time.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "server/security/tls_identity.h"

namespace partiemc::server {

/// New connections use the current identity; open connections keep the identity with which they
/// began. If the identity has client authorities at this call, clients need a certificate that one
/// of them has signed. Requires: `current` has an identity and outlives the server.
std::shared_ptr<grpc::ServerCredentials> MakeTlsCredentials(const CurrentTlsIdentity& current);

}  // namespace partiemc::server
