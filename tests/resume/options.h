// How long the tests of this room take: a moment by default, as long as asked for by flags.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::resume {

struct Options {
  std::uint64_t kills = 6;         ///< --kills: of servers, for each route.
  std::uint64_t terminations = 6;  ///< --terminations: likewise, by SIGTERM.
  std::uint64_t faults = 12;       ///< --faults: of the network.
  std::uint64_t updates = 3;       ///< --updates: of all servers, one after the other.
  std::uint64_t seed = 1;          ///< --seed: of what is random.
  /// --other-server: every other start of a server is one of this program, of another commit.
  std::string other_server = {};
};

/// Of this run.
Options& GetOptions();

}  // namespace partiemc::resume
