#include "vertices/placement.h"

#include <cmath>
#include <span>

namespace partiemc {
namespace {

// The corner that a saddle's segment cuts off. Corner c lies between the edges c - 1 and c.
int CornerOf(const Segment& segment) {
  return ((segment.entry + 1) & 3) == segment.exit ? segment.exit : segment.entry;
}

// SnapToAxes sets coordinates nearer to 0 than this, in cells, to 0.
constexpr double kAxisReach = 0x1p-96;

}  // namespace

void SnapToAxes(double cell_size, std::span<double> coordinates) {
  const double reach = kAxisReach * cell_size;
  for (double& coordinate : coordinates) {
    const bool is_near = (coordinate != 0) & (std::abs(coordinate) < reach);
    coordinate = is_near ? 0 : coordinate;  // An unconditional store allows vectorisation.
  }
}

Point ClampToHalf(const Segment& segment, Point point) {
  auto [u, v] = point;
  const int corner = CornerOf(segment);
  const bool right = corner == 1 || corner == 2;
  const bool upper = corner >= 2;
  if (right) u = 1 - u;
  if (upper) v = 1 - v;
  const double excess = u + v - (1 - 2 * kCellMargin);
  if (excess > 0) {
    u = std::clamp(u - excess / 2, kCellMargin, 1 - 3 * kCellMargin);
    v = 1 - 2 * kCellMargin - u;
  }
  if (right) u = 1 - u;
  if (upper) v = 1 - v;
  return {u, v};
}

}  // namespace partiemc
