#include "phases/body_corner.h"

#include <algorithm>
#include <cmath>

#include "vertices/measure.h"

namespace partiemc {
namespace {

// The sine of the smallest turn of a corner. With noise, smaller turns may be chance.
constexpr double kSmallestTurn = .4;
// A side has no curve if the root mean square distance of its points from the curve is larger, in
// spacings. Another corner of the body may be near.
constexpr double kLargestMisfit = .05;

// Whether the points that determine a curve lie near it. `curve` is relative to `vertex`.
bool Follows(const ArcCurve& curve, const RingPath& path, const Point& vertex, double spacing,
             std::span<const Point> positions) {
  double sum = 0, count = 0, distance = 0;
  Point last = vertex;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const Point& at = positions[path[k]];
    distance += Length(Minus(at, last)) / spacing;
    last = at;
    if (distance > kCurveFarthest) break;
    if (distance < kCurveNearest) continue;
    const double misfit = curve.MisfitOf(Minus(at, vertex)) / spacing;
    sum += misfit * misfit;
    count += 1;
  }
  return sum <= kLargestMisfit * kLargestMisfit * count;
}

}  // namespace

RingPath::RingPath(const Rings& body, std::uint32_t vertex, bool is_ahead, double spacing,
                   std::span<const std::uint8_t> ends_path, std::span<const Point> positions)
    : vertex_(vertex), is_ahead_(is_ahead) {
  const auto after = std::ranges::upper_bound(body.offsets, vertex);
  begin_ = *(after - 1);
  count_ = *after - begin_;
  Point last = positions[vertex];
  double distance = 0;
  for (; size_ + 1 < count_ && distance <= kCurvatureFarthest; ++size_) {
    const std::uint32_t next = (*this)[size_];
    if (ends_path[next] != 0) return;
    distance += Length(Minus(positions[next], last)) / spacing;
    last = positions[next];
  }
}

std::uint32_t RingPath::operator[](std::size_t k) const {
  const auto step = static_cast<std::uint32_t>(k + 1);
  return begin_ + (vertex_ - begin_ + (is_ahead_ ? step : count_ - step)) % count_;
}

std::optional<BodyCorner> CornerOf(const RingPath& ahead, const RingPath& back, const Point& vertex,
                                   double spacing, std::span<const Point> positions) {
  const auto after = CurveAlong(ahead, vertex, spacing, positions);
  const auto before = CurveAlong(back, vertex, spacing, positions);
  if (!after || !before) return std::nullopt;
  if (!Follows(*after, ahead, vertex, spacing, positions) ||
      !Follows(*before, back, vertex, spacing, positions)) {
    return std::nullopt;
  }
  const Point to = after->DirectionAt({}), from = before->DirectionAt({});
  const bool is_corner = Dot(to, from) > 0 || std::abs(Cross(to, from)) > kSmallestTurn;
  return is_corner ? std::optional(BodyCorner{*after, *before}) : std::nullopt;
}

double RingAreas::AreaOf(const Rings& body, std::uint32_t ring, const PhaseImages& images,
                         std::span<const Point> positions) {
  const std::uint32_t begin = body.offsets[ring], end = body.offsets[ring + 1];
  if (images.IsRingCut(ring)) {
    ring_.clear();
    for (const Point& at : positions.subspan(begin, end - begin)) {
      ring_.insert(ring_.end(), {at.x, at.y});
    }
    return MeasureInWindow(ring_, images.window()).area;
  }
  const Point origin = positions[begin];
  double twice = 0;
  for (std::uint32_t k = begin + 1; k + 1 < end; ++k) {
    twice += Cross(Minus(positions[k], origin), Minus(positions[k + 1], origin));
  }
  return twice / 2;
}

double RingAreas::LengthOf(const Rings& body, std::uint32_t ring, const WallVertices* walls,
                           const PhaseImages& images, std::span<const Point> positions) const {
  const std::uint32_t begin = body.offsets[ring], end = body.offsets[ring + 1];
  const bool is_cut = images.IsRingCut(ring);
  double length = 0;
  for (std::uint32_t k = begin; k < end; ++k) {
    const std::uint32_t next = k + 1 == end ? begin : k + 1;
    const Point &from = positions[k], &to = positions[next];
    const double share = (IsOnWall(walls, k) + IsOnWall(walls, next)) / 2.0;
    length += (1 - share) *
              (is_cut ? LengthInWindow(from, to, images.window()) : Length(Minus(to, from)));
  }
  return length;
}

void RingAreas::Measure(const Rings& body, const PhaseImages& images,
                        std::span<const Point> positions) {
  groups_.assign(body.RingCount(), {});
  for (std::uint32_t ring = 0; ring < body.RingCount(); ++ring) {
    groups_[images.GroupOf(ring)].before += AreaOf(body, ring, images, positions);
  }
}

void RingAreas::Restore(const Rings& body, const WallVertices* walls, const PhaseImages& images,
                        double limit, std::span<std::uint8_t> has_moved, SharedPoints& points) {
  const auto moved_of = [&](std::uint32_t ring) {
    return has_moved.subspan(body.offsets[ring], body.offsets[ring + 1] - body.offsets[ring]);
  };
  for (Group& group : groups_) {
    group.now = group.length = 0;
    group.has_corner = false;
  }
  for (std::uint32_t ring = 0; ring < body.RingCount(); ++ring) {
    const auto moved = moved_of(ring);
    groups_[images.GroupOf(ring)].has_corner |=
        std::ranges::find(moved, kMovedCorner) != moved.end();
  }
  for (std::uint32_t ring = 0; ring < body.RingCount(); ++ring) {
    Group& group = groups_[images.GroupOf(ring)];
    if (!group.has_corner) continue;
    group.now += AreaOf(body, ring, images, points.position);
    group.length += LengthOf(body, ring, walls, images, points.position);
  }
  for (std::uint32_t ring = 0; ring < body.RingCount(); ++ring) {
    const Group& group = groups_[images.GroupOf(ring)];
    if (!group.has_corner || !(group.length > 0)) continue;
    const double offset = std::clamp((group.before - group.now) / group.length, -limit, limit);
    for (std::uint32_t k = body.offsets[ring]; k < body.offsets[ring + 1]; ++k) {
      if (IsOnWall(walls, k)) continue;
      const VertexNormal& normal = points.normal[k];
      points.position[k] =
          Plus(points.position[k], Times({double{normal.x}, double{normal.y}}, offset));
      if (has_moved[k] == 0) has_moved[k] = kMoved;
    }
  }
}

}  // namespace partiemc
