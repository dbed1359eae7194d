// Clients that exhaust memory, time or slots of the server. Each runs in rounds until stopped.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>

#include "support/random.h"

namespace partiemc::attack {

struct Hostility {
  std::string address;
  std::string web;    ///< Address of the gateway.
  std::string token;  ///< A valid token for attackers that have one.
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

/// Calls and bodies without a token: `calls` per minute over `connections`.
void FloodWithoutToken(Hostility& hostility, std::uint64_t calls, std::size_t connections);

}  // namespace partiemc::attack
