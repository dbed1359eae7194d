// The address of a server: HOST:PORT or unix:PATH.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc {

struct Address {
  std::string host;        ///< Name or number, without brackets; empty for a Unix socket.
  std::uint16_t port = 0;  ///< 0: any free port, for listening.
  std::string unix_path;   ///< Empty for HOST:PORT.

  /// Whether only this machine can reach it: a loopback address, "localhost" or a Unix socket.
  bool IsLocal() const;
  /// The form that gRPC and ParseAddress accept: "127.0.0.1:50051", "[::1]:0", "unix:/run/p.sock".
  std::string ToString() const;
};

/// Errors: INVALID_ARGUMENT with the text and the expected form.
absl::StatusOr<Address> ParseAddress(const std::string& text);

}  // namespace partiemc
