// Options of the gateway.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/address.h"

namespace partiemc::server {

struct WebOptions {
  Address address;
  /// Folder of the built page. Empty: DefaultPageRoot(), if that folder exists.
  std::string root = {};
  /// Origins of pages that may call the server, in addition to the server's own host:
  /// "https://host:port".
  std::vector<std::string> origins = {};
  /// Host names that requests may use, in addition to localhost and addresses (IsHostAllowed):
  /// "viewer.example". Empty: with TLS or tokens, requests may use any name, except on a loopback
  /// address.
  std::vector<std::string> hosts = {};
  /// Other origins whose pages may show the page in a frame.
  std::vector<std::string> frame_ancestors = {};
  /// Maximum number of connections, with and without a call, in total and per address; at least 1.
  std::uint32_t max_connections = 256;
  std::uint32_t max_per_address = 0;  ///< 0: half of max_connections.
};

}  // namespace partiemc::server
