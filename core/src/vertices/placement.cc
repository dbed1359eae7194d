#include "vertices/placement.h"

#include <algorithm>
#include <cmath>

namespace partiemc {
namespace {

// Eigenvalues of the QEF below this share of the larger one leave their direction free.
constexpr double kQefCutoff = 0.1;

// The corner that a saddle's segment cuts off: corner c lies between edges c - 1 and c.
int CornerOf(const Segment& segment) {
  return ((segment.entry + 1) & 3) == segment.exit ? segment.exit : segment.entry;
}

struct Direction {
  double x, y;
};

Direction NormalAt(const LevelSetSampler& field, const TileDirectory& directory,
                   const ActiveCell& cell, Point point, const CellPlane& plane) {
  const Point origin = CellOrigin(directory, cell);
  const FieldSample sample =
      field.Sample(cell.tile, point.x - origin.x + cell.i, point.y - origin.y + cell.j);
  const double square =
      sample.gradient_x * sample.gradient_x + sample.gradient_y * sample.gradient_y;
  if (square < kWeakGradientSquare) return {plane.normal_x, plane.normal_y};
  const double length = std::sqrt(square);
  return {sample.gradient_x / length, sample.gradient_y / length};
}

}  // namespace

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

Point VirtualPlaneVertex(const CellPlane& plane, double max_step) {
  if (plane.is_weak) return plane.point;
  return NewtonStep(plane.point, plane.value, {plane.gradient_x, plane.gradient_y}, max_step);
}

Point QefVertex(const VertexInput& input, std::uint32_t segment, const CellPlane& plane) {
  const ActiveCell& cell = input.crossings.cells[input.crossings.segments[segment].cell];
  const Point middle{(plane.entry.x + plane.exit.x) / 2, (plane.entry.y + plane.exit.y) / 2};
  double xx = 0, xy = 0, yy = 0, bx = 0, by = 0;  // Normal equations about the middle.
  for (const Point& point : {plane.entry, plane.exit}) {
    const Direction n = NormalAt(input.field, input.bins.tiles, cell, point, plane);
    const double offset = n.x * (point.x - middle.x) + n.y * (point.y - middle.y);
    xx += n.x * n.x;
    xy += n.x * n.y;
    yy += n.y * n.y;
    bx += n.x * offset;
    by += n.y * offset;
  }
  // Closed-form eigenvalues of the symmetric 2 x 2 matrix; the trace is 2 as normals are unit.
  const double mean = (xx + yy) / 2;
  const double radius = std::sqrt((xx - yy) * (xx - yy) / 4 + xy * xy);
  const double large = mean + radius;
  const double small = mean - radius;
  // Of the two forms of the eigenvector, the one without cancellation.
  double ex = xx >= yy ? large - yy : xy;
  double ey = xx >= yy ? xy : large - xx;
  const double length = std::sqrt(ex * ex + ey * ey);
  if (length > 0) {
    ex /= length;
    ey /= length;
  } else {
    ex = 1;
    ey = 0;
  }
  const double along = (ex * bx + ey * by) / large;
  const double across = small > kQefCutoff * large ? (-ey * bx + ex * by) / small : 0;
  return {middle.x + along * ex - across * ey, middle.y + along * ey + across * ex};
}

Point FarthestParticleVertex(const VertexInput& input, std::uint32_t segment,
                             const CellPlane& plane) {
  const Scale& scale = input.scale;
  const ActiveCell& cell = input.crossings.cells[input.crossings.segments[segment].cell];
  const Point origin = CellOrigin(input.bins.tiles, cell);
  const double x = plane.point.x - origin.x + cell.i;
  const double y = plane.point.y - origin.y + cell.j;
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const TilePlace place = Normalise(input.bins.tiles, cell.tile, i, j);

  constexpr std::uint32_t kNone = 0xffffffff;
  std::uint32_t farthest = kNone;
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
                              if (farthest == kNone || distance > farthest_distance) {
                                farthest = input.field.SourceOf(particle);
                                farthest_distance = distance;
                              }
                            });
  }
  Point vertex{(plane.entry.x + plane.exit.x) / 2 * scale.cell_size,
               (plane.entry.y + plane.exit.y) / 2 * scale.cell_size};
  if (farthest != kNone) vertex = PositionOf(input.frame, input.parameters.plane, farthest);
  const double offset = input.parameters.surface_offset * scale.spacing * scale.cell_size;
  return {vertex.x + offset * plane.normal_x, vertex.y + offset * plane.normal_y};
}

}  // namespace partiemc
