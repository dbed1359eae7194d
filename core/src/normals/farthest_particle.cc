#include "normals/farthest_particle.h"

#include <algorithm>
#include <cmath>

#include "base/bits.h"
#include "frame/frame_view.h"

namespace partiemc {
namespace {

// Converts a point near `cell`: from cells relative to the tile of `cell` to cells relative to the
// tile that contains the point.
FieldPoint PointNear(const TileDirectory& directory, const ActiveCell& cell, double x, double y) {
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const TilePlace place = Normalise(directory, cell.tile, i, j);
  return {place.tile, place.i + (x - i), place.j + (y - j)};
}

}  // namespace

void FarthestParticle::SampleAtMean(CellPlane& plane) const {
  const ActiveCell& cell = plane.cell;
  const double centre_x = cell.i + 0.5;
  const double centre_y = cell.j + 0.5;
  const FieldSample centre = field_.Sample(cell.tile, centre_x, centre_y);
  const Point origin = CellOrigin(directory_, cell);
  plane.point = {origin.x + 0.5 + centre.mean_x, origin.y + 0.5 + centre.mean_y};
  plane.gradient_x = plane.gradient_y = 0;
  plane.value = static_cast<float>(centre.value);
  const FieldPoint at =
      PointNear(directory_, cell, centre_x + centre.mean_x, centre_y + centre.mean_y);
  if (at.tile == kNoTile) return;
  const FieldSample mean = field_.Sample(at.tile, at.x, at.y);
  plane.gradient_x = static_cast<float>(mean.phi_x);
  plane.gradient_y = static_cast<float>(mean.phi_y);
}

Point FarthestParticle::Vertex(const CellPlane& plane, const Frame& frame,
                               const ReconstructionParameters& parameters,
                               const Scale& scale) const {
  const ActiveCell& cell = plane.cell;
  const Point origin = CellOrigin(directory_, cell);
  const FieldPoint at = PointNear(directory_, cell, plane.point.x - origin.x + cell.i,
                                  plane.point.y - origin.y + cell.j);
  std::uint32_t farthest = kNoIndex;
  double farthest_distance = 0;
  if (at.tile != kNoTile) {
    const double radius = std::min(1.0, scale.kernel_radius);
    field_.ForEachNear(at.tile, at.x, at.y, radius,
                       [&](double x, double y, std::uint32_t particle) {
                         const double dx = x - at.x;
                         const double dy = y - at.y;
                         const double distance = dx * plane.normal_x + dy * plane.normal_y;
                         if (distance < 0 || dx * dx + dy * dy > radius * radius) return;
                         if (farthest == kNoIndex || distance > farthest_distance) {
                           farthest = field_.SourceOf(particle);
                           farthest_distance = distance;
                         }
                       });
  }
  Point vertex{(plane.entry.x + plane.exit.x) / 2 * scale.cell_size,
               (plane.entry.y + plane.exit.y) / 2 * scale.cell_size};
  if (farthest != kNoIndex) vertex = PositionOf(frame, parameters.plane, farthest);
  const double offset = parameters.surface_offset * scale.spacing * scale.cell_size;
  return {vertex.x + offset * plane.normal_x, vertex.y + offset * plane.normal_y};
}

}  // namespace partiemc
