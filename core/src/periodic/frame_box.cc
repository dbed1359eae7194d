#include "periodic/frame_box.h"

#include <string>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "frame/frame_view.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// Names the box of the frame in an error about the box of parameters.
absl::Status OfFrame(const absl::Status& status) {
  std::optional<Violation> violation = FindViolation(status);
  if (!violation) return status;
  constexpr std::string_view kPrefix = "parameters.";
  if (violation->field.starts_with(kPrefix)) violation->field.erase(0, kPrefix.size());
  return ViolationError(status.code(), *std::move(violation));
}

// Names the largest particle in an error about a least length.
absl::Status ForLargest(const absl::Status& status) {
  std::optional<Violation> violation = FindViolation(status);
  if (!violation) return status;
  violation->rule += ", for the largest particle";
  return ViolationError(status.code(), *std::move(violation));
}

}  // namespace

absl::Status ResolveBox(const std::optional<PeriodicBox>& of_stream, Frame& frame) {
  if (!frame.box) {
    frame.box = of_stream;
    return absl::OkStatus();
  }
  if (!of_stream) {
    return InvalidFrame(kReasonOutOfRange, "box", "present",
                        "must be absent: the stream has no periodic box");
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const bool is_periodic = of_stream->axes[k].has_value();
    if (frame.box->axes[k].has_value() == is_periodic) continue;
    return InvalidFrame(kReasonOutOfRange, absl::StrCat("box.", kAxisNames[k]),
                        is_periodic ? "absent" : "present",
                        "must be periodic if and only if the box of the stream is");
  }
  frame.box->wraps = of_stream->wraps;
  return OfFrame(Validate(*frame.box, 0, 0));
}

absl::Status CheckBoxLengths(const std::optional<PeriodicBox>& of_stream, const PeriodicBox& box,
                             double kernel_radius, double spacing, const SizeRange& sizes) {
  absl::Status status = Validate(box, kernel_radius, spacing);
  // All other limits are met, so only a least length can still be violated.
  if (status.ok()) status = ForLargest(Validate(box, kernel_radius * sizes.Reach(), spacing));
  return status.ok() || of_stream == box ? status : OfFrame(status);
}

std::optional<PeriodicBox> BoxToStore(const std::optional<PeriodicBox>& of_stream,
                                      const std::optional<PeriodicBox>& box) {
  if (!box || of_stream == box) return std::nullopt;
  return PeriodicBox{.axes = box->axes};
}

BoxMotion MotionOf(const std::optional<PeriodicBox>& of_stream,
                   const std::optional<PeriodicBox>& before, const std::optional<PeriodicBox>& now,
                   double unit) {
  BoxMotion motion;
  const std::optional<PeriodicBox>& last = before ? before : of_stream;
  if (!last || !now) return motion;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto &from = last->axes[k], &to = now->axes[k];
    if (!from || !to || *from == *to) continue;
    motion.any = true;
    motion.axes[k] = {from->origin / unit, to->origin / unit, to->length / from->length};
  }
  return motion;
}

}  // namespace partiemc
