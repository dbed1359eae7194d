#include "server/calls/surface_level.h"

#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <utility>

#include "absl/strings/string_view.h"
#include "partiemc/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "server/compute/memory_budget.h"
#include "server/relay/watched_result.h"
#include "wire/message_bytes.h"
#include "wire/surface_level.h"

namespace partiemc::server {
namespace {

constexpr char kField[] = "open.level_of_detail";

// Number of copies at the same time: a result's bytes, the message in them, the level's bytes.
constexpr std::uint64_t kCopies = 3;

// Holds bytes of the budget until the end of the scope.
class Reservation {
 public:
  explicit Reservation(MemoryBudget& budget) : budget_(budget) {}
  ~Reservation() {
    if (bytes_ > 0) budget_.GiveBack(bytes_);
  }
  Reservation(const Reservation&) = delete;
  Reservation& operator=(const Reservation&) = delete;

  absl::Status Take(std::uint64_t bytes) {
    may_fit_later_ = bytes_ + bytes <= budget_.bytes();
    if (!may_fit_later_ || budget_.TryTake(bytes) != FairShare::Fit::kYes) {
      return NoRoomInBudget(kField, bytes_ + bytes, budget_.bytes());
    }
    bytes_ += bytes;
    return absl::OkStatus();
  }
  bool may_fit_later() const { return may_fit_later_; }

 private:
  MemoryBudget& budget_;
  std::uint64_t bytes_ = 0;
  bool may_fit_later_ = true;
};

absl::Status Invalid(const WatchedResult& result, absl::string_view fault) {
  if (result.origin == WatchedResult::Origin::kHere) return absl::InternalError(fault);
  return ViolationError(
      absl::StatusCode::kDataLoss,
      {std::string(kReasonInvalidResult), kField, std::string(fault),
       "must be of a valid surface, which the replica of the stream has not sent; "
       "watch without a level"});
}

absl::StatusOr<LevelQueue::Frame> MakeOrThrow(const LevelQueue::Frame& exact,
                                              const LevelOfDetail& level,
                                              const std::atomic<bool>& cancelled,
                                              Reservation& reservation) {
  const auto& result = static_cast<const WatchedResult&>(*exact);
  absl::Status status = reservation.Take(kCopies * result.bytes.size());
  if (!status.ok()) return status;
  v1::ReconstructedFrame frame;
  {
    const std::string bytes = result.bytes.ToString();
    status = reservation.Take(wire::ParsedBytes(bytes, *v1::ReconstructedFrame::descriptor()));
    if (!status.ok()) return status;
    if (!frame.ParseFromString(bytes)) return Invalid(result, "a result that cannot be parsed");
  }
  if (!frame.has_surface()) return exact;
  const SurfaceOrigin origin = result.origin == WatchedResult::Origin::kHere
                                   ? SurfaceOrigin::kCore
                                   : SurfaceOrigin::kUnknown;
  status = wire::ReplaceByLevel(
      level, origin, [&](std::uint64_t bytes) { return reservation.Take(bytes); }, &cancelled,
      frame);
  if (absl::IsDataLoss(status) || absl::IsOutOfRange(status)) {
    return Invalid(result, status.message());
  }
  if (!status.ok()) return status;
  return std::make_shared<WatchedResult>(wire::WatchedBytes(frame.SerializeAsString()));
}

}  // namespace

LevelQueue::Made MakeResultLevel(const LevelQueue::Frame& exact, const LevelOfDetail& level,
                                 const std::atomic<bool>& cancelled, MemoryBudget& budget) {
  Reservation reservation(budget);
  LevelQueue::Made made;
  try {
    made.level = MakeOrThrow(exact, level, cancelled, reservation);
  } catch (const std::bad_alloc&) {
    made.level = NoRoomInBudget(kField, exact->bytes(), budget.bytes());
  }
  made.may_succeed_later =
      absl::IsResourceExhausted(made.level.status()) && reservation.may_fit_later();
  return made;
}

}  // namespace partiemc::server
