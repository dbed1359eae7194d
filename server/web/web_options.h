// How the gateway of a server is set up.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/address.h"

namespace partiemc::server {

struct WebOptions {
  Address address;
  /// The folder with the built page; empty: DefaultPageRoot(), where that is there.
  std::string root = {};
  /// Beside pages of the host that is asked itself, pages of these may call: "https://host:port".
  std::vector<std::string> origins = {};
  /// Sockets of all kinds, those of which nobody knows yet who they are included; at least 1.
  std::uint32_t max_connections = 256;
};

}  // namespace partiemc::server
