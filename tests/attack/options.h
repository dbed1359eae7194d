// Size of the tests of this room: small by default, larger by flags.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::attack {

struct Options {
  std::uint64_t calls = 20'000;  ///< --calls: random calls.
  std::uint64_t seconds =
      60;  ///< --seconds, --minutes: duration of the attacks, including the quiet part.
  std::uint64_t flood_seconds = 10;  ///< --flood-seconds: duration of the flood without a token.
  std::string attack;                ///< --attack: this attack alone; empty: all at once.
  /// --elsewhere: all attacks hit another server of this machine, which shows the cost of the
  /// attackers' processor time.
  bool elsewhere = false;
  /// --first: the server and the honest clients run before all other threads of the machine, so
  /// that the attackers cannot take their processor time.
  bool first = false;
  std::string server;      ///< --server: attacks this program; empty: the one built with the tests.
  std::uint64_t seed = 1;  ///< --seed: seed of random choices.
  /// --slowdown: limit of the honest streams' p99 relative to the undisturbed run. The default
  /// guards against regressions on busy machines.
  double slowdown = 40;
};

/// The options of this run.
Options& GetOptions();

}  // namespace partiemc::attack
