#include "coordinate_block.h"

#include <cmath>

#include "lattice.h"

namespace partiemc {
namespace {

constexpr double kUnitsPerCell = 1 << kFractionBits;
constexpr float kCellsPerUnit = 1.0f / (1 << kFractionBits);
constexpr double kUnitsPerTile = 1 << (kFractionBits + kTileShift);
constexpr double kMaxCellsFromOrigin = 1 << 30;

// The nearest whole number, for magnitudes below 2^51: beyond 2^52 doubles have no fraction.
double Round(double value) {
  constexpr double kShift = 0x1.8p52;
  return (value + kShift) - kShift;
}

}  // namespace

Reach ReachOf(const Scale& scale, double tile_margin) {
  const auto rounded_up = [](double cells) {
    return static_cast<float>(std::ceil(cells * kUnitsPerCell) / kUnitsPerCell);
  };
  return {kUnitsPerCell / scale.cell_size, rounded_up(scale.kernel_radius),
          rounded_up(scale.kernel_radius + tile_margin)};
}

bool IsNearOrigin(double units) { return std::abs(units) <= kMaxCellsFromOrigin * kUnitsPerCell; }

// Loops without a branch, of which the compiler makes vectors.
bool FindTiles(int count, const Reach& reach, CoordinateBlock& block, float* positions) {
  constexpr auto kSize = static_cast<float>(kTileSize);
  bool near = true;
  for (int k = 0; k < count; ++k) near &= IsNearOrigin(block.units[k]);
  if (!near) return false;
  for (int k = 0; k < count; ++k) {
    const double units = Round(block.units[k]);
    // Of positions k + 1/2 units none is half way between two tiles, which Round would not decide.
    const double tile = Round((units + 0.5) / kUnitsPerTile - 0.5);
    block.tile[k] = static_cast<std::int32_t>(tile);
    positions[k] = static_cast<float>(units - tile * kUnitsPerTile) * kCellsPerUnit;
  }
  for (int k = 0; k < count; ++k) {
    const float at = positions[k];
    block.sides[k] = static_cast<std::uint32_t>(at < reach.kernel) |
                     static_cast<std::uint32_t>(at >= kSize - reach.kernel) << 1;
    block.reached[k] = static_cast<std::uint32_t>(at < reach.tiles - kSize) |
                       static_cast<std::uint32_t>(at < reach.tiles) << 1 | 1u << 2 |
                       static_cast<std::uint32_t>(at >= kSize - reach.tiles) << 3 |
                       static_cast<std::uint32_t>(at >= 2 * kSize - reach.tiles) << 4;
  }
  return true;
}

}  // namespace partiemc
