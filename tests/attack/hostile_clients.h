// Clients that want the server's memory, its time or its places. Each goes round and round until it
// is told to stop.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>

#include "support/random.h"

namespace partiemc::attack {

struct Hostility {
  std::string address;
  std::string token;  ///< A good one, of those who have come by one.
  support::Random random;
  const std::atomic<bool>& stop;
  std::atomic<std::uint64_t>& rounds;
};

struct Attack {
  const char* name;
  const char* what;
  void (*run)(Hostility&);
};

/// All there are.
std::span<const Attack> Attacks();

/// Calls and bodies of those who have no token: `calls` a minute over `connections`.
void FloodWithoutToken(Hostility& hostility, std::uint64_t calls, std::size_t connections);

}  // namespace partiemc::attack
