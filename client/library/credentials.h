// Converts Credentials to gRPC's objects.
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

/// INVALID_ARGUMENT with a Violation (OUT_OF_RANGE) for an option of a stream or watch.
absl::Status InvalidOption(std::string field, std::string value, std::string rule);

/// Returns gRPC's credentials for the connection; without `tls` the connection is not encrypted.
/// Errors: INVALID_ARGUMENT, which names the field of Credentials, for a file that cannot be read
/// or is not PEM, for a file without `tls`, and for a certificate without a key or the reverse.
absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeChannelCredentials(
    const Credentials& credentials);

/// Creates the interceptor that adds the token to every call to `address`; null without a token.
/// Errors: INVALID_ARGUMENT if the token cannot be read, is malformed, or would leave this machine
/// unencrypted. No error contains the token.
absl::StatusOr<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>>
MakeTokenSender(const Credentials& credentials, const Address& address);

}  // namespace partiemc::client
