// Checks whether the server can listen on an address.
#pragma once

#include <netdb.h>

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/address.h"

namespace partiemc::server {

/// Listens on `address` and stops at once, so that the Unix socket of a running server is never
/// replaced. Errors: UNAVAILABLE with one line: address, cause and remedy.
absl::Status CheckCanListen(const Address& address);

/// A linked list, never empty.
using ResolvedAddresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

/// The addresses of TCP on which a server of `address` listens. Errors: UNAVAILABLE with the
/// system's message.
absl::StatusOr<ResolvedAddresses> ResolveToListen(const Address& address);

}  // namespace partiemc::server
