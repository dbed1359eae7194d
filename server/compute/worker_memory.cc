#include "server/compute/worker_memory.h"

#include <algorithm>
#include <utility>

namespace partiemc::server {

void WorkerMemory::BeginFrame(std::uint64_t message_bytes) {
  if (budget_ == nullptr) return;
  const std::uint64_t usual = kUsualBytesPerMessageByte * message_bytes;
  if (usual <= kWorkerBytes + counted_) return;
  const std::uint64_t more = budget_->TakeForWorker(usual - kWorkerBytes - counted_, this);
  is_beyond_ = budget_->IsBeyond(this);
  counted_ += more;
}

bool WorkerMemory::Reserve(std::uint64_t bytes, std::size_t particles, std::uint64_t state_bytes) {
  if (budget_ == nullptr) return true;
  if (bytes > kWorkerBytes + counted_) {
    const std::uint64_t more = bytes - kWorkerBytes - counted_;
    const bool is_usual = bytes <= kWorkerBytes + state_bytes + kWorkerBytesPerParticle * particles;
    if (budget_->TryTake(more) != FairShare::Fit::kYes &&
        !(is_usual && budget_->TryTakeBeyond(more, this))) {
      return false;
    }
    is_beyond_ = budget_->IsBeyond(this);
    counted_ += more;
  }
  used_ = std::max(used_, bytes);
  return true;
}

void WorkerMemory::EndFrame() {
  const std::uint64_t needed = used_ - std::min(used_, kWorkerBytes);
  if (counted_ <= needed) return;
  budget_->GiveBack(counted_ - needed);
  counted_ = needed;
}

void WorkerMemory::GiveBack() {
  used_ = 0;
  is_beyond_ = false;
  if (counted_ > 0) budget_->GiveBackOfWorker(std::exchange(counted_, 0), this);
}

}  // namespace partiemc::server
