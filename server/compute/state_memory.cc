#include "server/compute/state_memory.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/compute/memory_budget.h"

namespace partiemc::server {

absl::Status StateMemory::Account::Grow(std::uint64_t bytes) {
  if (memory_ == nullptr || bytes <= bytes_) return absl::OkStatus();
  const std::uint64_t more = memory_->CountedOf(bytes) - memory_->CountedOf(bytes_);
  if (more > 0) {
    const MutexLock lock(memory_->mutex_);
    FairShare& share = memory_->share_;
    const std::uint64_t all = share.held_by(caller_.get()) + more;
    if (all > QuotaOf(caller_.get())) return TooManyBytesOfCaller(more);
    // FairShare alone would let the first state take all: it is made for memory that is given back
    // soon.
    if (all > share.room() / 2 || share.Fits(caller_.get(), more) != FairShare::Fit::kYes) {
      return ViolationError(
          absl::StatusCode::kResourceExhausted,
          {std::string(kReasonMemoryBudget), "frame",
           absl::StrCat("a state of ", bytes, " bytes for the next frame"),
           absl::StrCat("must fit with the states of other streams into ", share.room(),
                        " bytes, of which one caller has at most half; send fewer particles, leave "
                        "out noise_filter, or start the server with a larger --memory-budget")});
    }
    share.Take(caller_.get(), more);
  }
  bytes_ = bytes;
  return absl::OkStatus();
}

void StateMemory::Account::Shrink(std::uint64_t bytes) {
  if (memory_ == nullptr || bytes >= bytes_) return;
  const std::uint64_t less = memory_->CountedOf(bytes_) - memory_->CountedOf(bytes);
  bytes_ = bytes;
  if (less == 0) return;
  const MutexLock lock(memory_->mutex_);
  memory_->share_.GiveBack(caller_.get(), less);
}

std::uint64_t StateMemory::held() const {
  const MutexLock lock(mutex_);
  return share_.held();
}

}  // namespace partiemc::server
