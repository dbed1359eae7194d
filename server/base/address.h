// Where a server listens: HOST:PORT or unix:PATH.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc::server {

struct Address {
  std::string host;        ///< Name or number, without brackets; empty for a Unix socket.
  std::uint16_t port = 0;  ///< 0: any that is free.
  std::string unix_path;   ///< Empty for HOST:PORT.

  /// Reached from this machine only: a loopback address, "localhost" or a Unix socket.
  bool IsLocal() const;
  /// As gRPC takes it and as people write it: "127.0.0.1:50051", "[::1]:0", "unix:/run/p.sock".
  std::string ToString() const;
};

/// Errors: INVALID_ARGUMENT, a line that says what is wrong with `text` and what is asked.
absl::StatusOr<Address> ParseAddress(const std::string& text);

/// Tries to listen there and lets go at once: gRPC itself does not say why it could not, and would
/// take a Unix socket away from the server that owns it.
/// Errors: UNAVAILABLE, a line that says where, why and what to do.
absl::Status CheckCanListen(const Address& address);

}  // namespace partiemc::server
