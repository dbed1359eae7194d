#include "frame/wall_rules.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "base/point.h"
#include "base/predicates.h"
#include "frame/frame_view.h"
#include "frame/phase_rules.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// Limits of coordinates: squares and products of lengths in cells stay finite.
constexpr double kLeast = 1e-60, kMost = 1e60;

// Whether the line b c leads back over the line a b.
bool FoldsBack(const Point& a, const Point& b, const Point& c) {
  return Orientation(a, b, c) == 0 &&
         ((c.x - b.x) * (b.x - a.x) < 0 || (c.y - b.y) * (b.y - a.y) < 0);
}

absl::Status CheckPolygon(const std::string& field, std::span<const double> points) {
  const std::size_t count = points.size() / 2;
  const auto at = [&](std::size_t k) { return PointAt(points, k % count); };
  for (std::size_t k = 0; k < count; ++k) {
    const auto refused = [&](std::size_t other) {
      return InvalidParameter(field, absl::StrCat("lines ", k, " and ", other),
                              "must be a polygon that does not touch itself");
    };
    if (FoldsBack(at(k), at(k + 1), at(k + 2))) return refused((k + 1) % count);
    // Neighbouring lines share a point.
    for (std::size_t other = k + 2; other < count && other + 1 < k + count; ++other) {
      if (SegmentsTouch(at(k), at(k + 1), at(other), at(other + 1))) return refused(other);
    }
  }
  return absl::OkStatus();
}

absl::Status CheckPoints(const std::string& field, std::span<const double> points) {
  if (points.size() % 2 != 0 || points.size() < 4) {
    return InvalidParameter(field, absl::StrCat(points.size(), " coordinates"),
                            "must be two coordinates of at least two points");
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double magnitude = std::abs(points[k]);
    if (magnitude == 0 || (magnitude >= kLeast && magnitude <= kMost)) continue;
    return InvalidParameter(absl::StrCat(field, "[", k, "]"), ShortestNumber(points[k]),
                            "must be 0 or in [1e-60, 1e60] in magnitude");
  }
  const std::size_t count = points.size() / 2;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t next = (k + 1) % count;
    if (PointAt(points, k) != PointAt(points, next)) continue;
    return InvalidParameter(field, absl::StrCat("points ", k, " and ", next), "must differ");
  }
  return count == 2 ? absl::OkStatus() : CheckPolygon(field, points);
}

// Checks a wall in a periodic box: endless lines must be their own images, and other walls must be
// obstacles, because the fluid of a tank is at one place only.
absl::Status CheckInBox(const std::string& field, std::span<const double> points,
                        const PeriodicBox& box, const Axes& axes) {
  const bool along_first = box.axes[static_cast<std::size_t>(axes.first)].has_value();
  const bool along_second = box.axes[static_cast<std::size_t>(axes.second)].has_value();
  if (points.size() == 4) {
    const bool is_image =
        (!along_first || points[1] == points[3]) && (!along_second || points[0] == points[2]);
    if (is_image) return absl::OkStatus();
    return InvalidParameter(
        field, "an endless line",
        along_first && along_second
            ? "must be absent if both axes are periodic: it would meet its images"
            : "must be parallel to the periodic axis, so that it meets itself at the "
              "faces");
  }
  double area = 0;
  for (std::size_t k = 2; k + 2 < points.size(); k += 2) {
    area += (points[k] - points[0]) * (points[k + 3] - points[1]) -
            (points[k + 1] - points[1]) * (points[k + 2] - points[0]);
  }
  if (area < 0) return absl::OkStatus();
  return InvalidParameter(
      field, "a tank",
      "must be a clockwise obstacle in a periodic box: give the sides of a channel as "
      "endless lines");
}

// Checks that no other parameter excludes walls. `field`: the parameter with the walls.
absl::Status CheckOthers(const ReconstructionParameters& p, const std::string& field) {
  const auto refused = [&](std::string_view rule) {
    return InvalidParameter(field, "present", rule);
  };
  if (p.output == Output::kSurface) {
    return refused("must be absent for a surface, which has wall planes instead");
  }
  if (p.slice) return refused("must be absent with a slice");
  if (p.isovalue) return refused("must be absent with an isovalue");
  const auto is_phase = [](const Section& section) { return section.phase.has_value(); };
  if (!std::ranges::all_of(p.sections, is_phase)) {
    return refused("must be absent with sections that are no phases: slices, isolines");
  }
  if (p.boundary == Boundary::kGrains) return refused("must be absent if the boundary is grains");
  if (p.placement != Placement::kVirtualPlane) {
    return refused("must be absent unless the placement is virtual-plane");
  }
  return absl::OkStatus();
}

absl::Status CheckWallPhases(const ReconstructionParameters& p) {
  const auto& phases = p.wall_phases;
  if (phases.empty()) return absl::OkStatus();
  if (phases.size() > p.kMaxWallPhases) {
    return InvalidParameter("wall_phases", absl::StrCat(phases.size()),
                            absl::StrCat("must be at most ", p.kMaxWallPhases));
  }
  if (absl::Status status = CheckOthers(p, "wall_phases"); !status.ok()) return status;
  if (p.noise_filter) {
    return InvalidParameter("wall_phases", "present", "must be absent with a noise filter");
  }
  for (std::size_t k = 0; k < phases.size(); ++k) {
    const std::string field = absl::StrCat("wall_phases[", k, "]");
    if (absl::Status status = CheckPhaseNumber(field, phases[k]); !status.ok()) return status;
    for (std::size_t other = 0; other < k; ++other) {
      if (phases[other] != phases[k]) continue;
      return InvalidParameter(field, absl::StrCat(phases[k]),
                              absl::StrCat("must differ from wall_phases[", other, "]"));
    }
    for (std::size_t section = 0; section < p.sections.size(); ++section) {
      if (p.sections[section].phase != phases[k]) continue;
      return InvalidParameter(field, absl::StrCat(phases[k]),
                              absl::StrCat("must differ from sections[", section, "].phase"));
    }
  }
  return CheckPhaseAttribute(p.phase_attribute, "particles of some phases are walls");
}

// Checks that no other parameter excludes the walls of a surface.
absl::Status CheckOthersOfPlanes(const ReconstructionParameters& p) {
  const auto refused = [&](std::string_view rule) {
    return InvalidParameter("wall_planes", "present", rule);
  };
  if (p.output != Output::kSurface) return refused("must be absent unless the output is a surface");
  if (!p.sections.empty()) return refused("must be absent with sections: slices, isolines");
  return absl::OkStatus();
}

// Whether a wall may have this coordinate.
bool IsCoordinate(double value) {
  const double magnitude = std::abs(value);
  return magnitude == 0 || (magnitude >= kLeast && magnitude <= kMost);
}

}  // namespace

absl::Status CheckWallPlanes(std::span<const WallPlane> planes, double kernel_radius,
                             double spacing) {
  constexpr std::size_t kMost = ReconstructionParameters::kMaxWallPlanes;
  if (planes.size() > kMost) {
    return InvalidParameter("wall_planes", absl::StrCat(planes.size()),
                            absl::StrCat("must be at most ", kMost, ": two for each axis"));
  }
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const WallPlane& plane = planes[k];
    const std::string field = absl::StrCat("wall_planes[", k, "]");
    if (plane.axis < 0 || plane.axis > 2) {
      return InvalidParameter(field + ".axis", absl::StrCat(plane.axis), "must be x, y or z");
    }
    if (!IsCoordinate(plane.position)) {
      return InvalidParameter(field + ".position", ShortestNumber(plane.position),
                              "must be 0 or in [1e-60, 1e60] in magnitude");
    }
    for (std::size_t other = 0; other < k; ++other) {
      if (planes[other].axis != plane.axis) continue;
      const std::string name = absl::StrCat("wall_planes[", other, "]");
      if (planes[other].is_fluid_above == plane.is_fluid_above) {
        return InvalidParameter(
            field, ShortestNumber(plane.position),
            "must have another axis or the fluid on the other side than " + name);
      }
      const double low = plane.is_fluid_above ? plane.position : planes[other].position;
      const double high = plane.is_fluid_above ? planes[other].position : plane.position;
      // The sizes of particles are rounded.
      if (high - low > 0 && high - low >= (1 - 1e-6) * kernel_radius * spacing) continue;
      return InvalidParameter(
          field + ".position", ShortestNumber(plane.position),
          absl::StrCat("must leave a kernel radius of fluid between this wall and ", name, ", ",
                       kernel_radius * spacing));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckAxesOfWalls(std::span<const WallPlane> planes,
                              const std::optional<PeriodicBox>& box) {
  if (!box) return absl::OkStatus();
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const auto axis = static_cast<std::size_t>(planes[k].axis);
    if (!box->axes[axis]) continue;
    return InvalidParameter(absl::StrCat("wall_planes[", k, "].axis"), std::string(1, "xyz"[axis]),
                            "must not be a periodic axis of the box");
  }
  return absl::OkStatus();
}

absl::Status CheckWalls(const ReconstructionParameters& p) {
  if (!p.wall_planes.empty()) {
    absl::Status status = CheckOthersOfPlanes(p);
    if (status.ok()) {
      status = CheckWallPlanes(p.wall_planes, p.kernel_radius, p.spacing.value_or(0));
    }
    if (status.ok()) status = CheckAxesOfWalls(p.wall_planes, p.box);
    if (!status.ok()) return status;
  }
  if (absl::Status status = CheckWallPhases(p); !status.ok()) return status;
  if (p.walls.empty()) return absl::OkStatus();
  std::size_t points = 0;
  for (const Wall& wall : p.walls) points += wall.points.size() / 2;
  if (points > p.kMaxWallPoints) {
    return InvalidParameter("walls", absl::StrCat(points, " points"),
                            absl::StrCat("must have at most ", p.kMaxWallPoints,
                                         " points together, and at least 2 points each"));
  }
  if (absl::Status status = CheckOthers(p, "walls"); !status.ok()) return status;
  for (std::size_t k = 0; k < p.walls.size(); ++k) {
    const std::string field = absl::StrCat("walls[", k, "].points");
    if (absl::Status status = CheckPoints(field, p.walls[k].points); !status.ok()) return status;
  }
  // With another plane, frames decide the axes.
  if (!p.box || p.plane != Plane::kXy) return absl::OkStatus();
  return CheckWallsInBox(p.walls, *p.box, AxesOf(p.plane));
}

absl::Status CheckWallsInBox(std::span<const Wall> walls, const PeriodicBox& box,
                             const Axes& axes) {
  for (std::size_t k = 0; k < walls.size(); ++k) {
    const std::string field = absl::StrCat("walls[", k, "].points");
    absl::Status status = CheckInBox(field, walls[k].points, box, axes);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace partiemc
