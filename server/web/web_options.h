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
  /// Host names that requests may name beside those of this machine, if the server listens on a
  /// loopback address: "viewer.example".
  std::vector<std::string> hosts = {};
  /// Origins whose pages may show the page in a frame, beside its own.
  std::vector<std::string> frame_ancestors = {};
  /// Connections, including those without a call, of all addresses and of one; at least 1.
  std::uint32_t max_connections = 256;
  std::uint32_t max_per_address = 0;  ///< 0: half of max_connections.
};

}  // namespace partiemc::server
