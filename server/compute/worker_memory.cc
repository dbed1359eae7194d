#include "server/compute/worker_memory.h"

#include <utility>

namespace partiemc::server {

bool WorkerMemory::Reserve(std::uint64_t bytes, std::size_t particles) {
  if (budget_ == nullptr || bytes <= kWorkerBytes + counted_) return true;
  const std::uint64_t more = bytes - kWorkerBytes - counted_;
  if (bytes <= kWorkerBytes + kWorkerBytesPerParticle * particles) {
    budget_->Take(more);
  } else if (budget_->TryTake(more) != FairShare::Fit::kYes) {
    return false;
  }
  counted_ += more;
  return true;
}

void WorkerMemory::GiveBack() {
  if (counted_ > 0) budget_->GiveBack(std::exchange(counted_, 0));
}

}  // namespace partiemc::server
