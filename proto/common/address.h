// Where a server is: HOST:PORT or unix:PATH.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc {

struct Address {
  std::string host;        ///< Name or number, without brackets; empty for a Unix socket.
  std::uint16_t port = 0;  ///< 0: any that is free, to listen on.
  std::string unix_path;   ///< Empty for HOST:PORT.

  /// Reached from this machine only: a loopback address, "localhost" or a Unix socket.
  bool IsLocal() const;
  /// As gRPC takes it and as people write it: "127.0.0.1:50051", "[::1]:0", "unix:/run/p.sock".
  std::string ToString() const;
};

/// Errors: INVALID_ARGUMENT, a line that says what is wrong with `text` and what is asked.
absl::StatusOr<Address> ParseAddress(const std::string& text);

}  // namespace partiemc
