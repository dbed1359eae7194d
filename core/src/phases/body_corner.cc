#include "phases/body_corner.h"

#include <algorithm>
#include <cmath>

namespace partiemc {
namespace {

// The sine of the smallest turn of a corner. With noise, smaller turns may be chance.
constexpr double kSmallestTurn = .4;
// A side has no curve if the root mean square distance of its points from the curve is larger, in
// spacings. Another corner of the body may be near.
constexpr double kLargestMisfit = .05;

double AreaOf(std::uint32_t begin, std::uint32_t end, std::span<const Point> positions) {
  const Point origin = positions[begin];
  double twice = 0;
  for (std::uint32_t k = begin + 1; k + 1 < end; ++k) {
    twice += Cross(Minus(positions[k], origin), Minus(positions[k + 1], origin));
  }
  return twice / 2;
}

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
                   std::span<const std::uint8_t> is_contact, std::span<const Point> positions)
    : vertex_(vertex), is_ahead_(is_ahead) {
  const auto after = std::ranges::upper_bound(body.offsets, vertex);
  begin_ = *(after - 1);
  count_ = *after - begin_;
  Point last = positions[vertex];
  double distance = 0;
  for (; size_ + 1 < count_ && distance <= kCurvatureFarthest; ++size_) {
    const std::uint32_t next = (*this)[size_];
    if (is_contact[next] != 0) return;
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

void SumRingAreas(const Rings& body, std::span<const Point> positions, std::vector<double>& areas) {
  areas.clear();
  for (std::size_t ring = 0; ring < body.RingCount(); ++ring) {
    areas.push_back(AreaOf(body.offsets[ring], body.offsets[ring + 1], positions));
  }
}

void RestoreRingAreas(const Rings& body, std::span<const double> areas, double limit,
                      std::span<std::uint8_t> has_moved, SharedPoints& points) {
  for (std::size_t ring = 0; ring < body.RingCount(); ++ring) {
    const std::uint32_t begin = body.offsets[ring], end = body.offsets[ring + 1];
    const std::span<std::uint8_t> moved = has_moved.subspan(begin, end - begin);
    if (std::ranges::find(moved, kMovedCorner) == moved.end()) continue;
    double length = 0;
    for (std::uint32_t k = begin; k < end; ++k) {
      length += Length(Minus(points.position[k + 1 == end ? begin : k + 1], points.position[k]));
    }
    if (!(length > 0)) continue;
    const double lost = areas[ring] - AreaOf(begin, end, points.position);
    const double offset = std::clamp(lost / length, -limit, limit);
    for (std::uint32_t k = begin; k < end; ++k) {
      const VertexNormal& normal = points.normal[k];
      points.position[k] =
          Plus(points.position[k], Times({double{normal.x}, double{normal.y}}, offset));
      if (has_moved[k] == 0) has_moved[k] = kMoved;
    }
  }
}

}  // namespace partiemc
