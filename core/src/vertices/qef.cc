#include <cmath>

#include "vertices/placement.h"

namespace partiemc {
namespace {

// If the smaller eigenvalue of the matrix is below this fraction of the larger one, it counts as 0.
constexpr double kQefCutoff = 0.1;

// The unit normal of the level set at a point of the cell; the plane's normal if the gradient is
// weak.
Point NormalAt(const VertexInput& input, const CellPlane& plane, const Point& point) {
  const ActiveCell& cell = plane.cell;
  const Point origin = CellOrigin(input.bins.tiles, cell);
  const FieldSample sample =
      input.field.Sample(cell.tile, point.x - origin.x + cell.i, point.y - origin.y + cell.j);
  const double square =
      sample.gradient_x * sample.gradient_x + sample.gradient_y * sample.gradient_y;
  if (square < kWeakGradientSquare) return {plane.normal_x, plane.normal_y};
  const double length = std::sqrt(square);
  return {sample.gradient_x / length, sample.gradient_y / length};
}

}  // namespace

Point QefVertex(const VertexInput& input, const CellPlane& plane) {
  const Point middle{(plane.entry.x + plane.exit.x) / 2, (plane.entry.y + plane.exit.y) / 2};
  double xx = 0, xy = 0, yy = 0, bx = 0, by = 0;  // Normal equations about the middle.
  for (const Point& point : {plane.entry, plane.exit}) {
    const Point n = NormalAt(input, plane, point);
    const double offset = n.x * (point.x - middle.x) + n.y * (point.y - middle.y);
    xx += n.x * n.x;
    xy += n.x * n.y;
    yy += n.y * n.y;
    bx += n.x * offset;
    by += n.y * offset;
  }
  // Closed-form eigenvalues of the symmetric 2 x 2 matrix.
  const double mean = (xx + yy) / 2;
  const double radius = std::sqrt((xx - yy) * (xx - yy) / 4 + xy * xy);
  const double large = mean + radius;
  const double small = mean - radius;
  // Of two forms of the eigenvector, takes the one without cancellation.
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

}  // namespace partiemc
