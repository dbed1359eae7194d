// Credentials as gRPC takes them.
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/support/client_interceptor.h>

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/address.h"
#include "partiemc/client/credentials.h"

namespace partiemc::client {

/// Of the connection; clear text without `tls`.
/// Errors: INVALID_ARGUMENT, with the field of Credentials, for a file that cannot be read or holds
/// something else.
absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeChannelCredentials(
    const Credentials& credentials);

/// What adds the token to every call of a channel to `address`; null where there is none.
/// Errors: INVALID_ARGUMENT where the token cannot be read, is none, or would leave this machine in
/// the clear. No error has the token in it.
absl::StatusOr<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>>
MakeTokenSender(const Credentials& credentials, const Address& address);

}  // namespace partiemc::client
