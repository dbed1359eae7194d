#include "wire/wall_codec.h"

#include <cstddef>
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

void EncodeWalls(const std::vector<Wall>& walls, v1::ReconstructionParameters& message) {
  for (const Wall& wall : walls) {
    message.add_walls()->mutable_points()->Assign(wall.points.begin(), wall.points.end());
  }
}

}  // namespace partiemc::wire
