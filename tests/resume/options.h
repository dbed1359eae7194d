// Size of the tests of this room: small by default, larger by flags.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::resume {

struct Options {
  std::uint64_t kills = 6;         ///< --kills: kills per route.
  std::uint64_t terminations = 6;  ///< --terminations: SIGTERMs per route.
  std::uint64_t faults = 12;       ///< --faults: faults of the network.
  std::uint64_t updates = 3;       ///< --updates: rolling updates of all servers.
  std::uint64_t seed = 1;          ///< --seed: seed of random choices.
  /// --time-limits: other than 0 also fails tests whose times exceed their limits. For a machine
  /// that does nothing else: a busy one delays replicas and clients by seconds.
  std::uint64_t time_limits = 0;
  /// --other-server: every second start of a server uses this program, of another commit.
  std::string other_server = {};
};

/// The options of this run.
Options& GetOptions();

}  // namespace partiemc::resume
