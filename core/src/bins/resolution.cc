#include "bins/resolution.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <variant>

#include "absl/strings/str_cat.h"
#include "frame/frame_view.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// If the step of float32 is 1/16 of the spacing, outlines move by up to 0.06 spacings; with 1/8 by
// 0.15, with 1/4 by 0.23, with 1/2 by 0.46 (core/METHOD.md, "Numbers"). The outline's own error is
// 0.7 at its worst point.
constexpr double kDoubtfulStep = 1.0 / 16;
constexpr double kMaxStep = 1.0 / 4;

// The distance from a float to the next larger one.
double StepAt(double coordinate) {
  const auto value = static_cast<float>(coordinate);
  return std::nextafter(value, std::numeric_limits<float>::infinity()) - value;
}

// An upper bound of the coordinates in these tiles.
double BoundOf(const TileDirectory& tiles, double cell_size) {
  double farthest = 0;
  for (const TileCoordinate& tile : tiles.tiles()) {
    farthest = std::max(
        {farthest, std::abs(static_cast<double>(tile.x)), std::abs(static_cast<double>(tile.y))});
  }
  return (farthest + 1) * kTileSize * cell_size;
}

double LargestCoordinate(const Frame& frame, Plane plane) {
  return VisitPositions(frame, plane, [&](const auto& reader) {
    double largest = 0;
    for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
      largest = std::max({largest, std::abs(reader[k].x), std::abs(reader[k].y)});
    }
    return largest;
  });
}

}  // namespace

absl::Status CheckResolution(const Frame& frame, Plane plane, const TileDirectory& tiles,
                             double cell_size, double spacing, Doubts& doubts) {
  if (std::holds_alternative<std::span<const double>>(frame.positions)) return absl::OkStatus();
  if (StepAt(BoundOf(tiles, cell_size)) <= kDoubtfulStep * spacing) return absl::OkStatus();
  return CheckStep(frame, plane, spacing, doubts);
}

bool AreCoarse(const Frame& frame, double spacing) {
  const auto* positions = std::get_if<std::span<const float>>(&frame.positions);
  if (positions == nullptr) return false;
  float largest = 0;
  for (const float coordinate : *positions) largest = std::max(largest, std::abs(coordinate));
  return StepAt(largest) > kDoubtfulStep * spacing;
}

absl::Status CheckStep(const Frame& frame, Plane plane, double spacing, Doubts& doubts) {
  if (std::holds_alternative<std::span<const double>>(frame.positions)) return absl::OkStatus();
  const double largest = LargestCoordinate(frame, plane);
  const double step = StepAt(largest);
  if (step <= kDoubtfulStep * spacing) return absl::OkStatus();
  doubts.Add(Doubt::kPositionsCoarse);
  if (step <= kMaxStep * spacing) return absl::OkStatus();
  return ViolationError(
      absl::StatusCode::kOutOfRange,
      {std::string(kReasonResolution), "positions",
       absl::StrCat("float32 up to ", ShortestNumber(largest)),
       absl::StrCat("must be finer than a quarter of the spacing, ", ShortestNumber(spacing),
                    "; send float64, or coordinates relative to a near origin")});
}

}  // namespace partiemc
