// Options of the gateway.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/address.h"

namespace partiemc::server {

struct WebOptions {
  Address address;
  /// Folder of the built page; empty: DefaultPageRoot(), if it exists.
  std::string root = {};
  /// Origins of pages that may call, in addition to the server's own host: "https://host:port".
  std::vector<std::string> origins = {};
  /// Host names that requests may use in addition to this machine's, if the server listens on a
  /// loopback address: "viewer.example".
  std::vector<std::string> hosts = {};
  /// Other origins that may show the page in a frame.
  std::vector<std::string> frame_ancestors = {};
  /// Limits of connections, including those without a call, in total and per address; at least 1.
  std::uint32_t max_connections = 256;
  std::uint32_t max_per_address = 0;  ///< 0: half of max_connections.
};

}  // namespace partiemc::server
