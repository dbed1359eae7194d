// How long the tests of this room take: a moment by default, as long as asked for by flags.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::attack {

struct Options {
  std::uint64_t calls = 20'000;  ///< --calls: random ones.
  std::uint64_t seconds = 60;    ///< --seconds, --minutes: of hostility, the quiet part included.
  std::uint64_t flood_seconds = 10;  ///< --flood-seconds: without a token.
  std::string attack;                ///< --attack: that one alone; empty: all at once.
  /// --elsewhere: all attacks hit another server of this machine, so that what the honest streams
  /// lose is what they lose to the attackers' use of its processors.
  bool elsewhere = false;
  std::string server;      ///< --server: attack this program; empty: the one built with the tests.
  std::uint64_t seed = 1;  ///< --seed: of what is random.
  /// --slowdown: the honest streams' p99, of that of the undisturbed run, and --beside: memory
  /// beyond the budget. 2 and 64 are the aim, which is not reached (tests/PROMISES.md); the
  /// defaults are what must not get worse.
  double slowdown = 40;
  double beside_mib = 160;
};

/// Of this run.
Options& GetOptions();

}  // namespace partiemc::attack
