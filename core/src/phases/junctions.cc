#include "phases/junctions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <tuple>

#include "base/point.h"
#include "phases/arc_curve.h"
#include "phases/body_corner.h"

namespace partiemc {
namespace {

// A corner of the body has two more curves.
constexpr std::size_t kMostCurves = kMostArcs + 2;
// Steps of the search for the point nearest to curves.
constexpr int kSteps = 3;
// Weight of a junction's present place, for lines that hardly determine a new one.
constexpr double kOwnWeight = 1e-3;
// A junction moves by at most this number of spacings.
constexpr double kLongestMove = 1.5;
// A vertex of the body moves at most by this share of the segment to its neighbour: kShare if the
// neighbour stays, kSharedShare if it may move, too.
constexpr double kShare = .9, kSharedShare = .45;
// A line that meets the ring at a smaller angle, given by its sine, does not determine a place.
constexpr double kSmallestSine = .3;
// The sine of the largest turn of a wall at a vertex that may move along it.
constexpr double kStraightWall = .02;
// The anchors of images differ by whole lengths up to this error, in cells. The anchors of contacts
// are computed with single precision.
constexpr double kImageError = 1e-3;

Point Between(const Point& from, const Point& to) { return Minus(to, from); }

// Puts the points of a path that are nearer than kCurveNearest onto a parabola from the junction to
// the first farther point, with the bend of the curve. Calls on_move(number, direction) for each. A
// path without such a point in its first half stays: its other end may move the same points.
template <typename Path, typename OnMove>
void Reshape(const Path& path, const Point& before, const Point& junction, double h,
             const std::optional<ArcCurve>& curve, SharedPoints& points, OnMove on_move) {
  double reach = 0;
  std::optional<Point> target;
  Point last = before;
  for (std::size_t k = 0; 2 * k < path.size() && !target; ++k) {
    const Point& at = points.position[path[k]];
    reach += Length(Between(last, at));
    last = at;
    if (reach >= kCurveNearest * h) target = at;
  }
  if (!target) return;
  const Point chord = Between(junction, *target);
  const double bow = curve ? curve->bend * Dot(chord, chord) : 0;
  const Point side = curve ? Point{curve->along.y * bow, -curve->along.x * bow} : Point{};
  double distance = 0;
  last = before;
  for (std::size_t k = 0; k < path.size(); ++k) {
    Point& at = points.position[path[k]];
    distance += Length(Between(last, at));
    if (distance >= reach) return;
    last = at;
    const double share = distance / reach;
    at = Plus(Plus(junction, Times(chord, share)), Times(side, share * (1 - share)));
    on_move(path[k], Plus(chord, Times(side, 1 - 2 * share)));
  }
}

// The point nearest to lines, near `from`.
Point MeetingPoint(std::span<const Line> lines, const Point& from) {
  double xx = kOwnWeight, xy = 0, yy = kOwnWeight, bx = 0, by = 0;
  for (const Line& line : lines) {
    const Point normal{-line.along.y, line.along.x};
    const double height = Dot(normal, Between(from, line.through));
    xx += normal.x * normal.x;
    xy += normal.x * normal.y;
    yy += normal.y * normal.y;
    bx += height * normal.x;
    by += height * normal.y;
  }
  const double determinant = xx * yy - xy * xy;
  return {from.x + (yy * bx - xy * by) / determinant, from.y + (xx * by - xy * bx) / determinant};
}

Point Limited(const Point& move, double most) {
  const double length = Length(move);
  return length > most ? Times(move, most / length) : move;
}

// Whether a vertex of the body may move towards its neighbours. A vertex on a wall must have the
// same straight wall on both sides, so that it stays on the wall and keeps the corners of the wall.
bool MayMove(std::uint32_t previous, std::uint32_t vertex, std::uint32_t next,
             const WallVertices* walls, std::span<const Point> positions) {
  if (!IsOnWall(walls, vertex)) return true;
  if (walls->is_wet[previous] == 0 || walls->is_wet[vertex] == 0) return false;
  const Point before = Between(positions[previous], positions[vertex]);
  const Point after = Between(positions[vertex], positions[next]);
  return std::abs(Cross(before, after)) <= kStraightWall * Dot(before, after);
}

// Where lines meet the ring of a vertex of the body, between the neighbours of the vertex.
Point PlaceOnRing(std::span<const Line> lines, std::uint32_t vertex, const Rings& body,
                  const JunctionScratch& scratch, const SharedPoints& points) {
  const auto after = std::ranges::upper_bound(body.offsets, vertex);
  const std::uint32_t begin = *(after - 1), end = *after;
  const std::uint32_t next = vertex + 1 == end ? begin : vertex + 1;
  const std::uint32_t previous = vertex == begin ? end - 1 : vertex - 1;
  const Point& at = points.position[vertex];
  if (!MayMove(previous, vertex, next, scratch.walls, points.position)) return at;
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

using Curves = std::array<std::optional<ArcCurve>, kMostCurves>;

// Where the curves of a junction meet. The curves are relative to the junction. `is_on_ring`: a
// vertex of the body that stays on its ring.
Point PlaceOf(const Curves& curves, std::uint32_t junction, bool is_on_ring, const Rings& body,
              double h, const JunctionScratch& scratch, const SharedPoints& points) {
  const Point before = points.position[junction];
  Point now = before;
  std::array<Line, kMostCurves> lines;
  for (int step = 0; step < kSteps; ++step) {
    std::size_t count = 0;
    for (const auto& curve : curves) {
      if (!curve) continue;
      Line& line = lines[count++] = curve->TangentNear(Between(before, now));
      line.through = Plus(before, line.through);
    }
    if (count < (is_on_ring ? 1u : 2u)) return before;
    const std::span<const Line> known(lines.data(), count);
    if (is_on_ring) {
      now = PlaceOnRing(known, junction, body, scratch, points);
    } else {
      const Point move = Between(before, MeetingPoint(known, now));
      now = Plus(before, Limited(move, kLongestMove * h));
    }
  }
  return now;
}

// Turns a normal to be perpendicular to `along`, on the same side as before.
void TurnNormal(const Point& along, VertexNormal& normal) {
  const double length = Length(along);
  if (!(length > 0)) return;
  const Point unit{along.y / length, -along.x / length};
  const double sign = unit.x * double{normal.x} + unit.y * double{normal.y} < 0 ? -1 : 1;
  normal = {static_cast<float>(sign * unit.x), static_cast<float>(sign * unit.y)};
}

ArcPath PathOf(const ArcEnd& end, const Interfaces& interfaces) {
  return {interfaces.InnerPoints(interfaces.arcs[end.arc]), end.is_start};
}

// Reads positions only, so that plans do not depend on each other.
JunctionPlan PlanOf(std::span<const ArcEnd> ends, const Rings& body, double h,
                    const Interfaces& interfaces, const JunctionScratch& scratch,
                    const SharedPoints& points) {
  const std::uint32_t junction = ends[0].junction;
  const Point& before = points.position[junction];
  const auto side = [&](bool is_ahead) {
    return RingPath(body, junction, is_ahead, h, scratch.ends_path, points.position);
  };
  JunctionPlan plan{.ends = ends};
  const bool is_body = junction < body.PointCount();
  if (is_body) plan.ring = {side(true), side(false)};
  JunctionMove move;
  Curves curves;
  for (std::size_t k = 0; k < ends.size(); ++k) {
    curves[k] = CurveAlong(PathOf(ends[k], interfaces), before, h, points.position);
    move.curves[k] = curves[k];
  }
  if (std::ranges::none_of(curves, &std::optional<ArcCurve>::has_value)) return plan;
  if (is_body) {
    move.corner = CornerOf(plan.ring->ahead, plan.ring->back, before, h, points.position);
  }
  if (move.corner) {
    curves[kMostArcs] = move.corner->ahead;
    curves[kMostArcs + 1] = move.corner->back;
  }
  const bool is_on_ring = is_body && !move.corner;
  move.step = Between(before, PlaceOf(curves, junction, is_on_ring, body, h, scratch, points));
  plan.move = move;
  return plan;
}

// Moves a junction and the points near it.
void Move(const JunctionPlan& plan, double h, const Interfaces& interfaces,
          std::span<std::uint8_t> has_moved, SharedPoints& points) {
  const std::uint32_t junction = plan.ends[0].junction;
  const JunctionMove& move = *plan.move;
  const Point before = points.position[junction], now = Plus(before, move.step);
  points.position[junction] = now;
  if (plan.ring) has_moved[junction] = move.corner ? kMovedCorner : kMoved;
  if (plan.ring && move.corner) {
    const auto on_move = [&](std::uint32_t vertex, const Point& along) {
      has_moved[vertex] = kMoved;
      TurnNormal(along, points.normal[vertex]);
    };
    Reshape(plan.ring->ahead, before, now, h, move.corner->ahead, points, on_move);
    Reshape(plan.ring->back, before, now, h, move.corner->back, points, on_move);
  }
  for (std::size_t k = 0; k < plan.ends.size(); ++k) {
    Reshape(PathOf(plan.ends[k], interfaces), before, now, h, move.curves[k], points,
            [](std::uint32_t, const Point&) {});
  }
}

// The lengths of the window in whole cells. Absent without one, and if it is no whole number.
std::array<std::optional<std::int64_t>, 2> WholeLengths(const Window& window) {
  std::array<std::optional<std::int64_t>, 2> lengths;
  for (std::size_t k = 0; k < lengths.size(); ++k) {
    if (!window.axes[k]) continue;
    const double length = window.axes[k]->length, whole = std::round(length);
    if (std::abs(length - whole) < kImageError) lengths[k] = static_cast<std::int64_t>(whole);
  }
  return lengths;
}

void CollectImages(const Window& window, std::span<const Point> anchors, JunctionScratch& scratch) {
  scratch.images.clear();
  const auto lengths = WholeLengths(window);
  for (std::uint32_t plan = 0; plan < scratch.plans.size(); ++plan) {
    const Point& anchor = anchors[scratch.plans[plan].ends[0].junction];
    JunctionImage image{.anchor = anchor, .plan = plan};
    const std::array<double, 2> at{anchor.x, anchor.y};
    for (std::size_t k = 0; k < lengths.size(); ++k) {
      image.cell[k] = static_cast<std::int64_t>(std::floor(at[k]));
      if (!lengths[k]) continue;
      image.cell[k] = (image.cell[k] % *lengths[k] + *lengths[k]) % *lengths[k];
      const double away = at[k] - window.axes[k]->origin - window.axes[k]->length / 2;
      image.distance += away * away;
    }
    scratch.images.push_back(image);
  }
  std::ranges::sort(scratch.images, {}, [](const JunctionImage& image) {
    return std::tuple(image.cell, image.distance, image.anchor.x, image.anchor.y, image.plan);
  });
}

// Whether two junctions of the same cell are images of each other.
bool AreImages(const JunctionImage& a, const JunctionImage& b, const JunctionScratch& scratch) {
  const auto is_whole = [](double x) { return std::abs(x - std::round(x)) < kImageError; };
  const JunctionPlan &p = scratch.plans[a.plan], &q = scratch.plans[b.plan];
  return is_whole(a.anchor.x - b.anchor.x) && is_whole(a.anchor.y - b.anchor.y) &&
         p.ends.size() == q.ends.size() && p.ring.has_value() == q.ring.has_value();
}

// Gives each junction the move of its image nearest to the middle of the box.
void MoveImagesAlike(const PhaseImages& images, std::span<const Point> anchors,
                     JunctionScratch& scratch) {
  if (!images.HasCopies()) return;
  CollectImages(images.window(), anchors, scratch);
  for (std::size_t k = 1, first = 0; k < scratch.images.size(); ++k) {
    const JunctionImage& image = scratch.images[k];
    if (image.cell != scratch.images[first].cell) first = k;
    std::size_t nearest = first;
    while (nearest < k && !AreImages(scratch.images[nearest], image, scratch)) ++nearest;
    scratch.plans[image.plan].move = scratch.plans[scratch.images[nearest].plan].move;
  }
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
  // Images of a junction have their ends in the same order: no two ends at a junction have the same
  // phases and direction.
  std::ranges::sort(scratch.ends, {}, [&](const ArcEnd& end) {
    const PhaseArc& arc = interfaces.arcs[end.arc];
    return std::tuple(end.junction, arc.left, arc.right, !end.is_start, end.arc);
  });
  for (const auto& end : scratch.ends) {
    if (end.junction < body_points) scratch.is_contact[end.junction] = 1;
  }
  scratch.ends_path = scratch.is_contact;
  for (std::size_t k = 0; scratch.walls != nullptr && k < body_points; ++k) {
    if (IsOnWall(scratch.walls, k)) scratch.ends_path[k] = 1;
  }
}

}  // namespace

void MoveJunctions(const Scale& scale, const Rings& body, const WallVertices* walls,
                   const Interfaces& interfaces, const PhaseImages& images,
                   JunctionScratch& scratch, SharedPoints& points) {
  scratch.walls = walls;
  CollectEnds(interfaces, body.PointCount(), scratch);
  const double h = scale.spacing;
  scratch.plans.clear();
  for (std::size_t first = 0, last = 0; first < scratch.ends.size(); first = last) {
    const std::uint32_t junction = scratch.ends[first].junction;
    while (last < scratch.ends.size() && scratch.ends[last].junction == junction) ++last;
    const std::size_t count = std::min(last - first, kMostArcs);
    const auto ends = std::span(scratch.ends).subspan(first, count);
    scratch.plans.push_back(PlanOf(ends, body, h, interfaces, scratch, points));
  }
  MoveImagesAlike(images, points.anchor, scratch);
  // The order does not matter: Reshape moves a point from one end of its path only, and no move
  // reads a point that another one moves.
  for (const JunctionPlan& plan : scratch.plans) {
    if (plan.move) Move(plan, h, interfaces, scratch.has_moved, points);
  }
}

}  // namespace partiemc
