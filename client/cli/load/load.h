// `partiemc load`: measures the capacity of a server.
#pragma once

#include <string>
#include <vector>

#include "client/cli/server_flags.h"

namespace CLI {
class App;
}

namespace partiemc::client {

struct LoadFlags {
  ServerFlags server;
  int streams = 4;
  int particles = 10'000;  ///< Per frame.
  double rate = 30;        ///< Frames per second and stream; 0: as fast as possible.
  bool surface = false;    ///< A ball in space and its surface, instead of a disc.
  std::string coordinates = "float64";
  int watchers = 0;                        ///< In total.
  std::vector<std::string> watch_servers;  ///< Servers of the watchers, in turn; empty: `server`.
  bool no_ids = false;
  double seconds = 60;  ///< Longest duration.
  std::string metrics;  ///< HOST:PORT of the server's metrics; empty: not read.
  bool json = false;
  bool quiet = false;
};

/// Adds the verb to `app`. Requires: `flags` outlives the parsing.
CLI::App* AddLoad(CLI::App& app, LoadFlags& flags);

int Load(const LoadFlags& flags);

}  // namespace partiemc::client
