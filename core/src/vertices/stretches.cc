#include "vertices/stretches.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/point.h"
#include "vertices/contact_curve.h"

namespace partiemc {
namespace {

// Distance between consecutive points that AddBeyond adds beyond a wall, in spacings.
constexpr double kStep = .5;

// All vertices of one ring: [first, first + count). At(k) is the k-th vertex along the ring from
// `first`; after the last vertex follows the first one.
struct Vertices {
  std::size_t first, count;
  std::size_t At(std::size_t k) const { return first + k % count; }
};

// Outward normal of a ring that runs along `direction` (`sign` 1) or against it (-1), with the
// inside on its left.
VertexNormal NormalOf(const Point& direction, double sign) {
  const double length = Length(direction) * sign;
  return {static_cast<float>(direction.y / length), static_cast<float>(-direction.x / length)};
}

// One end of a stretch: the contact `from`, and the way into the stretch.
struct StretchEnd {
  const VertexInput& input;
  const Vertices& ring;
  std::size_t from;
  bool is_forward;  // Whether the ring runs from the contact into the stretch.

  // The k-th vertex from the contact.
  std::size_t At(std::size_t k) const {
    return ring.At(is_forward ? from + k : from + ring.count - k);
  }

  // The local size at the end of the stretch.
  double SizeOf(const RingVertices& v) const { return v.SizeOf(At(1)); }

  std::optional<ContactCurve> Fit(const RingVertices& v) const {
    return ContactCurve::Fit({*input.walls, input.bins.tiles, v.walls.tile[At(0)]},
                             v.walls.place[At(0)], input.scale.spacing * SizeOf(v),
                             [&](std::size_t k) -> std::optional<Point> {
                               if (k >= ring.count) return std::nullopt;
                               if (v.walls.kind[At(k)] != VertexKind::kFree) return std::nullopt;
                               return v.point[At(k)];
                             });
  }

  void MoveOnto(const ContactCurve& curve, RingVertices& v) const {
    const std::size_t count = curve.first_point();
    for (std::size_t k = 1; k < count; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(count);
      const double s = curve.s_foot() * (1 - share);
      v.point[At(k)] = curve.At(s);
      v.normal[At(k)] = NormalOf(curve.DirectionAt(s), is_forward ? 1 : -1);
    }
  }

  // Appends the points beyond the wall, in the order of the ring. `reach`: in local sizes times
  // cells.
  void AddBeyond(const ContactCurve& curve, double reach, double size,
                 std::vector<StretchPoint>& to) const {
    const double step = kStep * input.scale.spacing;
    const auto count = static_cast<std::size_t>(std::ceil(reach / step));
    for (std::size_t k = 0; k <= count; ++k) {
      const double s =
          curve.s_foot() - step * size * static_cast<double>(is_forward ? count - k : k);
      to.push_back({curve.At(s), NormalOf(curve.DirectionAt(s), is_forward ? 1 : -1),
                    static_cast<float>(size), kNoVertex});
    }
  }
};

}  // namespace

void ForEachStretch(const VertexInput& input, std::size_t ring, double reach, RingVertices& v,
                    absl::FunctionRef<void()> visit) {
  const std::size_t first = 2 * std::size_t{input.topology.offsets[ring]};
  const Vertices of{first, 2 * std::size_t{input.topology.offsets[ring + 1]} - first};
  const auto is_free = [&](std::size_t k) { return v.walls.kind[of.At(k)] == VertexKind::kFree; };
  for (std::size_t start = 0; start < of.count; ++start) {
    if (!is_free(start) || is_free(start + of.count - 1)) continue;
    std::size_t end = start;
    while (is_free(end)) ++end;
    const StretchEnd before{input, of, start + of.count - 1, true}, after{input, of, end, false};
    const std::optional<ContactCurve> in = before.Fit(v), out = after.Fit(v);
    if (in) before.MoveOnto(*in, v);
    if (out) after.MoveOnto(*out, v);
    v.stretch.clear();
    if (in) before.AddBeyond(*in, reach, before.SizeOf(v), v.stretch);
    for (std::size_t k = start; k < end; ++k) {
      const std::size_t i = of.At(k);
      v.stretch.push_back({v.point[i], v.normal[i], static_cast<float>(v.SizeOf(i)), i});
    }
    if (out) after.AddBeyond(*out, reach, after.SizeOf(v), v.stretch);
    if (v.stretch.size() >= 3) visit();
  }
}

}  // namespace partiemc
