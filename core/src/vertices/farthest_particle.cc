#include <algorithm>
#include <cmath>

#include "base/bits.h"
#include "vertices/placement.h"

namespace partiemc {

Point FarthestParticleVertex(const VertexInput& input, const CellPlane& plane) {
  const Scale& scale = input.scale;
  const ActiveCell& cell = plane.cell;
  const Point origin = CellOrigin(input.bins.tiles, cell);
  const double x = plane.point.x - origin.x + cell.i;
  const double y = plane.point.y - origin.y + cell.j;
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const TilePlace place = Normalise(input.bins.tiles, cell.tile, i, j);

  std::uint32_t farthest = kNoIndex;
  double farthest_distance = 0;
  if (place.tile != kNoTile) {
    const double px = place.i + (x - i);
    const double py = place.j + (y - j);
    const double radius = std::min(1.0, scale.kernel_radius);
    input.field.ForEachNear(place.tile, px, py, radius,
                            [&](double qx, double qy, std::uint32_t particle) {
                              const double dx = qx - px;
                              const double dy = qy - py;
                              const double distance = dx * plane.normal_x + dy * plane.normal_y;
                              if (distance < 0 || dx * dx + dy * dy > radius * radius) return;
                              if (farthest == kNoIndex || distance > farthest_distance) {
                                farthest = input.field.SourceOf(particle);
                                farthest_distance = distance;
                              }
                            });
  }
  Point vertex{(plane.entry.x + plane.exit.x) / 2 * scale.cell_size,
               (plane.entry.y + plane.exit.y) / 2 * scale.cell_size};
  if (farthest != kNoIndex) vertex = PositionOf(input.frame, input.parameters.plane, farthest);
  const double offset = input.parameters.surface_offset * scale.spacing * scale.cell_size;
  return {vertex.x + offset * plane.normal_x, vertex.y + offset * plane.normal_y};
}

}  // namespace partiemc
