#include "server/compute/fair_share.h"

namespace partiemc::server {

FairShare::Fit FairShare::FitsInto(std::uint64_t room, const CallerAccount* caller,
                                   std::uint64_t amount, std::uint64_t most) const {
  const std::uint64_t own = caller == nullptr ? 0 : held_by(caller);
  if (own > most || amount > most - own) return Fit::kMoreThanShare;
  const bool has_room = held_ <= room && amount <= room - held_;
  if (own == 0) return has_room ? Fit::kYes : Fit::kNoRoom;
  if (!has_room) return Fit::kMoreThanShare;
  const std::uint64_t left = room - held_ - amount;
  return own <= left && amount <= left - own ? Fit::kYes : Fit::kMoreThanShare;
}

void FairShare::Take(const CallerAccount* caller, std::uint64_t amount) {
  if (amount == 0) return;
  held_ += amount;
  held_by_[caller] += amount;
}

void FairShare::GiveBack(const CallerAccount* caller, std::uint64_t amount) {
  if (amount == 0) return;
  held_ -= amount;
  const auto own = held_by_.find(caller);
  own->second -= amount;
  if (own->second == 0) held_by_.erase(own);
}

std::uint64_t FairShare::held_by(const CallerAccount* caller) const {
  const auto own = held_by_.find(caller);
  return own == held_by_.end() ? 0 : own->second;
}

}  // namespace partiemc::server
