#include "server/connections/connection_limits.h"

#include <algorithm>

namespace partiemc::server {
namespace {

// Capacity of the token bucket that limits new connections, in seconds of its rate. Bursts are
// legitimate: the ranks of a simulation connect at the same time.
constexpr double kBurstSeconds = 2;

// Times for which OnFlood restricts or refuses an address, because an attacker reconnects before
// gRPC has freed the memory of the flood.
constexpr std::chrono::seconds kBan(10), kRefusal(1);

}  // namespace

Admission ConnectionCounts::Add(const std::string& address, Clock::time_point now) {
  const double burst = kBurstSeconds * limits_.new_of_address;
  const auto [found, is_new] = addresses_.try_emplace(address);
  Address& counted = found->second;
  if (now < counted.refused_until) return Admission::kRefused;
  if (is_new) {
    counted.tokens = burst;
  } else {
    const double seconds = std::chrono::duration<double>(now - counted.filled).count();
    counted.tokens = std::min(burst, counted.tokens + seconds * limits_.new_of_address);
  }
  counted.filled = now;
  const bool too_fast = limits_.new_of_address > 0 && counted.tokens < 1;
  const bool too_many = limits_.of_address > 0 && counted.kept >= limits_.of_address;
  if (too_fast || too_many || IsFull() || now < counted.banned_until) {
    ++counted.health_only;
    return Admission::kHealthOnly;
  }
  counted.tokens -= 1;
  ++counted.kept;
  ++kept_;
  return Admission::kKept;
}

void ConnectionCounts::Remove(const std::string& address, Admission admission) {
  const auto found = addresses_.find(address);
  if (found == addresses_.end() || admission == Admission::kRefused) return;
  if (admission == Admission::kKept) {
    --found->second.kept;
    --kept_;
  } else {
    --found->second.health_only;
  }
}

void ConnectionCounts::OnFlood(const std::string& address, Admission admission,
                               Clock::time_point now) {
  const auto found = addresses_.find(address);
  // No ban if the number of new connections per address is unlimited: operators set this behind a
  // proxy, where all clients have the same address.
  if (found == addresses_.end() || limits_.new_of_address == 0) return;
  found->second.banned_until = now + kBan;
  if (admission == Admission::kHealthOnly) found->second.refused_until = now + kRefusal;
}

std::size_t ConnectionCounts::CountOf(const std::string& address) const {
  const auto found = addresses_.find(address);
  return found == addresses_.end() ? 0 : found->second.kept;
}

void ConnectionCounts::Forget(Clock::time_point now) {
  std::erase_if(addresses_, [&](const auto& entry) {
    const Address& address = entry.second;
    return address.kept == 0 && address.health_only == 0 && now - address.filled > kBan &&
           now > address.banned_until;
  });
}

}  // namespace partiemc::server
