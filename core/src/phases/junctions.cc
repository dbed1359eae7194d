#include "phases/junctions.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

namespace partiemc {
namespace {

// The part of an arc that determines its line, in spacings from the junction.
constexpr double kNearest = 1.5, kFarthest = 4.5;
// Weight of a junction's place against lines that hardly determine it.
constexpr double kOwnWeight = 1e-3;
// A junction moves by at most this number of spacings.
constexpr double kLongestMove = 1.5;
// Shares of the ring's segments by which a vertex may move: if the next vertex stays, or may move,
// too.
constexpr double kShare = .9, kSharedShare = .45;
// Lines that meet at a smaller angle, by its sine, do not determine a point.
constexpr double kSmallestSine = .3;

struct Line {
  Point through;
  Point along;  // Unit.
};

double Cross(const Point& a, const Point& b) { return a.x * b.y - a.y * b.x; }
Point Between(const Point& from, const Point& to) { return {to.x - from.x, to.y - from.y}; }
double Length(const Point& v) { return std::sqrt(v.x * v.x + v.y * v.y); }

// The inner points of an arc in the order of their distance from one of its ends.
class ArcFrom {
 public:
  ArcFrom(const Interfaces& interfaces, const PhaseArc& arc, bool is_start)
      : inner_(interfaces.InnerPoints(arc)), is_start_(is_start) {}
  std::size_t size() const { return inner_.size(); }
  std::uint32_t operator[](std::size_t k) const {
    return inner_[is_start_ ? k : inner_.size() - 1 - k];
  }

 private:
  std::span<const std::uint32_t> inner_;
  bool is_start_;
};

// Calls visit(point, distance) for the points of an arc up to `farthest`, with their distances
// along the arc from `from`.
template <typename Visit>
void ForEachWithin(const ArcFrom& arc, const Point& from, double farthest,
                   const SharedPoints& points, Visit visit) {
  Point last = from;
  double distance = 0;
  for (std::size_t k = 0; k < arc.size() && distance <= farthest; ++k) {
    const Point& at = points.position[arc[k]];
    distance += Length(Between(last, at));
    last = at;
    if (distance <= farthest) visit(arc[k], distance);
  }
}

// The line through the points of an arc that are neither near the junction nor far from it.
std::optional<Line> LineOf(const ArcFrom& arc, const Point& junction, double h,
                           const SharedPoints& points) {
  double count = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  ForEachWithin(arc, junction, kFarthest * h, points, [&](std::uint32_t point, double distance) {
    if (distance < kNearest * h) return;
    const Point at = Between(junction, points.position[point]);
    count += 1;
    x += at.x;
    y += at.y;
    xx += at.x * at.x;
    xy += at.x * at.y;
    yy += at.y * at.y;
  });
  if (count < 2) return std::nullopt;
  x /= count;
  y /= count;
  const double cxx = xx / count - x * x, cxy = xy / count - x * y, cyy = yy / count - y * y;
  // The eigenvector of the larger eigenvalue.
  const double half = (cxx - cyy) / 2;
  const double root = std::sqrt(half * half + cxy * cxy);
  Point along = half >= 0 ? Point{half + root, cxy} : Point{cxy, root - half};
  const double length = Length(along);
  if (!(length > 0)) return std::nullopt;
  return Line{{junction.x + x, junction.y + y}, {along.x / length, along.y / length}};
}

// Puts the points of an arc before kNearest onto the chord to the first point behind it.
void Straighten(const ArcFrom& arc, const Point& before, const Point& junction, double h,
                SharedPoints& points) {
  double reach = 0;
  std::optional<Point> target;
  Point last = before;
  for (std::size_t k = 0; k < arc.size() && !target; ++k) {
    const Point& at = points.position[arc[k]];
    reach += Length(Between(last, at));
    last = at;
    if (reach >= kNearest * h) target = at;
  }
  if (!target) return;
  double distance = 0;
  last = before;
  for (std::size_t k = 0; k < arc.size(); ++k) {
    Point& at = points.position[arc[k]];
    distance += Length(Between(last, at));
    if (distance >= reach) return;
    last = at;
    const double share = distance / reach;
    at = {junction.x + share * (target->x - junction.x),
          junction.y + share * (target->y - junction.y)};
  }
}

// The point nearest to lines, near `from`.
Point MeetingPoint(std::span<const Line> lines, const Point& from, double h) {
  double xx = kOwnWeight, xy = 0, yy = kOwnWeight, bx = 0, by = 0;
  for (const Line& line : lines) {
    const Point normal{-line.along.y, line.along.x};
    const Point to = Between(from, line.through);
    const double height = normal.x * to.x + normal.y * to.y;
    xx += normal.x * normal.x;
    xy += normal.x * normal.y;
    yy += normal.y * normal.y;
    bx += height * normal.x;
    by += height * normal.y;
  }
  const double determinant = xx * yy - xy * xy;
  Point move{(yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant};
  const double length = Length(move);
  const double share = length > kLongestMove * h ? kLongestMove * h / length : 1;
  return {from.x + share * move.x, from.y + share * move.y};
}

// Where lines meet the ring of a vertex of the body, between the neighbours of the vertex.
Point PlaceOnRing(std::span<const Line> lines, std::uint32_t vertex, const Rings& body,
                  const JunctionScratch& scratch, const SharedPoints& points) {
  const auto after = std::ranges::upper_bound(body.offsets, vertex);
  const std::uint32_t begin = *(after - 1), end = *after;
  const std::uint32_t next = vertex + 1 == end ? begin : vertex + 1;
  const std::uint32_t previous = vertex == begin ? end - 1 : vertex - 1;
  const Point& at = points.position[vertex];
  // The outward normal lies on the right of the ring.
  const Point along{-points.normal[vertex].y, points.normal[vertex].x};
  double sum = 0, count = 0;
  for (const Line& line : lines) {
    const double sine = Cross(along, line.along);
    if (std::abs(sine) < kSmallestSine) continue;
    sum += Cross(Between(at, line.through), line.along) / sine;
    count += 1;
  }
  if (count == 0) return at;
  const double way = sum / count;
  const std::uint32_t neighbour = way > 0 ? next : previous;
  const Point side = Between(at, points.position[neighbour]);
  const double most = scratch.is_contact[neighbour] ? kSharedShare : kShare;
  const double share = std::min(std::abs(way) / std::max(Length(side), 1e-9), most);
  return {at.x + share * side.x, at.y + share * side.y};
}

void CollectEnds(const Interfaces& interfaces, std::size_t body_points, JunctionScratch& scratch) {
  scratch.ends.clear();
  scratch.is_contact.assign(body_points, 0);
  for (std::uint32_t k = 0; k < interfaces.arcs.size(); ++k) {
    const PhaseArc& arc = interfaces.arcs[k];
    if (arc.IsClosed()) continue;
    scratch.ends.push_back({arc.start, k, true});
    scratch.ends.push_back({arc.end, k, false});
  }
  std::ranges::sort(scratch.ends, {}, [](const JunctionScratch::ArcEnd& end) {
    return std::tuple(end.junction, end.arc, !end.is_start);
  });
  for (const auto& end : scratch.ends) {
    if (end.junction < body_points) scratch.is_contact[end.junction] = 1;
  }
}

}  // namespace

void MoveJunctions(const Scale& scale, const Rings& body, const Interfaces& interfaces,
                   JunctionScratch& scratch, SharedPoints& points) {
  CollectEnds(interfaces, body.PointCount(), scratch);
  const double h = scale.spacing;
  for (std::size_t first = 0, last = 0; first < scratch.ends.size(); first = last) {
    const std::uint32_t junction = scratch.ends[first].junction;
    while (last < scratch.ends.size() && scratch.ends[last].junction == junction) ++last;
    // At most four arcs meet in a cell.
    std::array<Line, 4> lines;
    std::size_t count = 0;
    const Point before = points.position[junction];
    for (std::size_t k = first; k < last; ++k) {
      const auto& [_, arc, is_start] = scratch.ends[k];
      const auto line = LineOf({interfaces, interfaces.arcs[arc], is_start}, before, h, points);
      if (line && count < lines.size()) lines[count++] = *line;
    }
    if (count == 0) continue;
    const std::span<const Line> known(lines.data(), count);
    const bool is_body = junction < body.PointCount();
    const Point now = is_body      ? PlaceOnRing(known, junction, body, scratch, points)
                      : count >= 2 ? MeetingPoint(known, before, h)
                                   : before;
    points.position[junction] = now;
    for (std::size_t k = first; k < last; ++k) {
      const auto& [_, arc, is_start] = scratch.ends[k];
      Straighten({interfaces, interfaces.arcs[arc], is_start}, before, now, h, points);
    }
  }
}

}  // namespace partiemc
