// `partiemc load`: what a server bears.
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
  int particles = 10'000;  ///< Of each frame.
  double rate = 30;        ///< Frames a second of each stream; 0: as fast as they are answered.
  int watchers = 0;        ///< Of all streams together.
  std::vector<std::string> watch_servers;  ///< That they ask in turns; empty: `server`.
  bool no_ids = false;
  double seconds = 60;
  std::string metrics;
  bool json = false;
  bool quiet = false;
};

/// Adds the verb to `app`; its flags go to `flags`, which must outlive the parsing.
CLI::App* AddLoad(CLI::App& app, LoadFlags& flags);

int Load(const LoadFlags& flags);

}  // namespace partiemc::client
