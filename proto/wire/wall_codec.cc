#include "wire/wall_codec.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::wire {
namespace {

constexpr std::size_t kMaxPoints = ReconstructionParameters::kMaxWallPoints;
constexpr std::size_t kFewestPoints = 2;  // Of a wall.

absl::Status TooMany(std::string value) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonOutOfRange), "parameters.walls", std::move(value),
       absl::StrCat("must have at most ", kMaxPoints, " points together, and at least ",
                    kFewestPoints, " points each")});
}

}  // namespace

absl::StatusOr<std::vector<Wall>> DecodeWalls(const v1::ReconstructionParameters& message) {
  const auto count = static_cast<std::size_t>(message.walls_size());
  if (count > kMaxPoints / kFewestPoints) return TooMany(absl::StrCat(count, " walls"));
  std::size_t coordinates = 0;
  for (const v1::Wall& wall : message.walls()) {
    coordinates += static_cast<std::size_t>(wall.points_size());
  }
  if (coordinates > 2 * kMaxPoints) return TooMany(absl::StrCat((coordinates + 1) / 2, " points"));
  std::vector<Wall> walls;
  walls.reserve(count);
  for (const v1::Wall& wall : message.walls()) {
    walls.push_back({.points = {wall.points().begin(), wall.points().end()}});
  }
  return walls;
}

absl::StatusOr<std::vector<WallPlane>> DecodeWallPlanes(
    const v1::ReconstructionParameters& message) {
  constexpr std::size_t kMost = ReconstructionParameters::kMaxWallPlanes;
  const auto refused = [](std::string field, std::string value, std::string rule) {
    return ViolationError(absl::StatusCode::kInvalidArgument,
                          {std::string(kReasonOutOfRange), "parameters." + std::move(field),
                           std::move(value), std::move(rule)});
  };
  const auto count = static_cast<std::size_t>(message.wall_planes_size());
  if (count > kMost) {
    return refused("wall_planes", absl::StrCat(count),
                   absl::StrCat("must be at most ", kMost, ": two for each axis"));
  }
  std::vector<WallPlane> planes;
  planes.reserve(count);
  for (const v1::WallPlane& plane : message.wall_planes()) {
    if (plane.axis() > 2) {
      return refused(absl::StrCat("wall_planes[", planes.size(), "].axis"),
                     absl::StrCat(plane.axis()), "must be x, y or z");
    }
    planes.push_back({.axis = static_cast<int>(plane.axis()),
                      .position = plane.position(),
                      .is_fluid_above = !plane.fluid_below()});
  }
  return planes;
}

void EncodeWallPlanes(const std::vector<WallPlane>& planes, v1::ReconstructionParameters& message) {
  for (const WallPlane& from : planes) {
    v1::WallPlane& plane = *message.add_wall_planes();
    plane.set_axis(static_cast<std::uint32_t>(from.axis));
    plane.set_position(from.position);
    plane.set_fluid_below(!from.is_fluid_above);
  }
}

void EncodeWalls(const std::vector<Wall>& walls, v1::ReconstructionParameters& message) {
  for (const Wall& wall : walls) {
    message.add_walls()->mutable_points()->Assign(wall.points.begin(), wall.points.end());
  }
}

}  // namespace partiemc::wire
