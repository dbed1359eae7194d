#include "client/input/plane.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "absl/strings/str_format.h"
#include "client/input/base/text.h"
#include "partiemc/status.h"

namespace partiemc::client::input {
namespace {

// An axis is constant if its extent is at most this share of the largest extent. The share is above
// the rounding error of text with six digits, and far below a real third dimension.
constexpr double kFlatRelativeTolerance = 1e-6;

constexpr std::string_view kAxisNames[] = {"x", "y", "z"};

struct Interval {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  double Extent() const { return high >= low ? high - low : 0.0; }
};

Interval FiniteInterval(const std::vector<double>& values) {
  Interval interval;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    interval.low = std::min(interval.low, value);
    interval.high = std::max(interval.high, value);
  }
  return interval;
}

bool HasThreeAxes(const ParticleRows& rows) {
  return rows.has_position[0] && rows.has_position[1] && rows.has_position[2];
}

constexpr std::array<std::size_t, 3> kAllAxes = {0, 1, 2};

// The two axes that remain, in ascending order.
std::span<const std::size_t> AxesWithout(std::size_t dropped) {
  static constexpr std::array<std::array<std::size_t, 2>, 3> kOthers = {{{1, 2}, {0, 2}, {0, 1}}};
  return kOthers[dropped];
}

std::string PlaneName(std::size_t dropped) {
  const auto axes = AxesWithout(dropped);
  return Concat(kAxisNames[axes[0]], "-", kAxisNames[axes[1]]);
}

}  // namespace

absl::StatusOr<PlaneProjection::Axes> PlaneProjection::AxesFor(const ParticleRows& rows,
                                                               std::vector<std::string>& notices) {
  if (in_space_) {
    if (HasThreeAxes(rows)) return kAllAxes;
    return absl::FailedPreconditionError(Concat(
        rows.source, ": has two coordinates; must have x, y and z for a slice or a surface"));
  }
  std::size_t dropped = 2;
  if (HasThreeAxes(rows)) {
    if (absl::Status status = plane_ ? CheckStaysInPlane(rows) : Decide(rows, notices);
        !status.ok()) {
      return status;
    }
    if (plane_) dropped = plane_->dropped_axis;
  } else {
    while (rows.has_position[dropped]) --dropped;
    if (dropped != 2 && !told_plane_of_two_) {
      told_plane_of_two_ = true;
      notices.push_back(Concat("the particles lie in the ", PlaneName(dropped), " plane"));
    }
  }
  return AxesWithout(dropped);
}

absl::Status PlaneProjection::Project(const ParticleRows& rows, RecordedFrame& frame,
                                      std::vector<std::string>& notices) {
  const auto axes = AxesFor(rows, notices);
  if (!axes.ok()) return axes.status();
  const std::size_t components = axes->size();
  frame.components = static_cast<int>(components);
  frame.positions.resize(components * rows.count);
  for (std::size_t c = 0; c < components; ++c) {
    const std::vector<double>& along = rows.positions[(*axes)[c]];
    for (std::size_t i = 0; i < rows.count; ++i) frame.positions[components * i + c] = along[i];
  }
  if (HasThreeAxes(rows) && components == 2) {
    // If the dropped coordinate of a particle is not finite, it replaces the first kept one. The
    // particle then still counts as non-finite.
    const std::vector<double>& off_plane = rows.positions[3 - (*axes)[0] - (*axes)[1]];
    for (std::size_t i = 0; i < rows.count; ++i) {
      if (!std::isfinite(off_plane[i])) frame.positions[2 * i] = off_plane[i];
    }
  }
  CopyOptionalArrays(rows, *axes, frame, notices);
  frame.float32 = rows.float32;
  frame.time = rows.time;
  frame.step = rows.step;
  frame.source = rows.source;
  frame.box.reset();
  if (rows.box) {
    frame.box.emplace(RecordedBox{.is_tilted = rows.box->is_tilted});
    for (std::size_t c = 0; c < components; ++c) {
      frame.box->low[c] = rows.box->low[(*axes)[c]];
      frame.box->length[c] = rows.box->length[(*axes)[c]];
      frame.box->is_periodic[c] = rows.box->is_periodic[(*axes)[c]];
    }
  }
  return absl::OkStatus();
}

absl::Status PlaneProjection::Decide(const ParticleRows& rows, std::vector<std::string>& notices) {
  std::array<Interval, 3> intervals;
  double largest = 0;
  bool any_finite = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    intervals[axis] = FiniteInterval(rows.positions[axis]);
    largest = std::max(largest, intervals[axis].Extent());
    any_finite = any_finite && intervals[axis].high >= intervals[axis].low;
  }
  if (!any_finite) return absl::OkStatus();
  largest_extent_ = largest;
  for (std::size_t axis = 3; axis-- > 0;) {
    if (intervals[axis].Extent() > kFlatRelativeTolerance * largest) continue;
    plane_ = Plane{axis, intervals[axis].low};
    if (axis != 2) {
      notices.push_back(Concat("the particles lie in the ", PlaneName(axis), " plane (",
                               kAxisNames[axis], " = ", ShortestNumber(plane_->offset + 0.0), ")"));
    }
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(absl::StrFormat(
      "%s: is 3D (extents %.3g x %.3g x %.3g in x, y, z): --surface makes closed surfaces, --slice "
      "z=0, "
      "for example, the outline on a plane; convert keeps three coordinates with --in-space",
      rows.source, intervals[0].Extent(), intervals[1].Extent(), intervals[2].Extent()));
}

absl::Status PlaneProjection::CheckStaysInPlane(const ParticleRows& rows) {
  for (const std::vector<double>& values : rows.positions) {
    largest_extent_ = std::max(largest_extent_, FiniteInterval(values).Extent());
  }
  const Interval off_plane = FiniteInterval(rows.positions[plane_->dropped_axis]);
  const double tolerance = kFlatRelativeTolerance * largest_extent_;
  if (off_plane.high < off_plane.low || (off_plane.low >= plane_->offset - tolerance &&
                                         off_plane.high <= plane_->offset + tolerance)) {
    return absl::OkStatus();
  }
  const std::string_view axis = kAxisNames[plane_->dropped_axis];
  return absl::FailedPreconditionError(
      Concat(rows.source, ": leaves the plane of the frames before: ", axis, " was ",
             ShortestNumber(plane_->offset), " and is now ", ShortestNumber(off_plane.low), " to ",
             ShortestNumber(off_plane.high), "; PartiEMC reconstructs 2D data in one plane"));
}

void PlaneProjection::Ignore(bool& told, const ParticleRows& rows, std::string_view what,
                             std::vector<std::string>& notices) {
  if (std::exchange(told, true)) return;
  losses_.push_back(Concat(rows.source, ": ", what, "; later frames may have this fault, too"));
  notices.push_back(losses_.back());
}

void PlaneProjection::CopyOptionalArrays(const ParticleRows& rows, Axes axes, RecordedFrame& frame,
                                         std::vector<std::string>& notices) {
  frame.velocities.clear();
  const bool has_all = std::all_of(axes.begin(), axes.end(),
                                   [&](std::size_t axis) { return rows.has_velocity[axis]; });
  if (has_all) {
    for (std::size_t i = 0; i < rows.count; ++i) {
      for (const std::size_t axis : axes) frame.velocities.push_back(rows.velocities[axis][i]);
    }
    const bool usable = std::all_of(frame.velocities.begin(), frame.velocities.end(),
                                    [](float velocity) { return std::isfinite(velocity); });
    if (!usable) {
      frame.velocities.clear();
      Ignore(told_velocities_, rows, "velocities are ignored: not all are finite", notices);
    }
  }
  frame.ids.clear();
  if (rows.has_ids) {
    sorted_ids_ = rows.ids;
    std::sort(sorted_ids_.begin(), sorted_ids_.end());
    const bool unique =
        std::adjacent_find(sorted_ids_.begin(), sorted_ids_.end()) == sorted_ids_.end();
    if (unique) {
      frame.ids = rows.ids;
    } else {
      Ignore(told_ids_, rows, "ids are ignored: several particles have the same", notices);
    }
  }
  frame.attributes = rows.attributes;
  frame.volumes.clear();
  frame.volume_column = rows.volume_column;
  if (!rows.has_volumes) return;
  frame.volumes.assign(rows.volumes.begin(), rows.volumes.end());
  if (keeps_volumes_) return;
  const auto wrong = std::ranges::find_if_not(
      frame.volumes, [](float volume) { return volume > 0 && std::isfinite(volume); });
  if (wrong == frame.volumes.end()) return;
  const std::string fault =
      Concat("volumes are ignored: ", VolumeName(frame, wrong - frame.volumes.begin()), " is ",
             ShortestNumber(*wrong), ", and must be positive and finite");
  frame.volumes.clear();
  Ignore(told_volumes_, rows, fault, notices);
}

}  // namespace partiemc::client::input
