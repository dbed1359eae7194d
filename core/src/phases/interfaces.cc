#include "phases/interfaces.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/parallel.h"
#include "base/point.h"
#include "phases/arc_curve.h"
#include "vertices/placement.h"
#include "vertices/ring_filters.h"
#include "walls/tile_point.h"

namespace partiemc {
namespace {

// Steps of the search for the boundary on an edge.
constexpr int kRootSteps = 3;

Point NodeAt(const TileDirectory& directory, std::uint32_t tile, double i, double j) {
  const Point origin = OriginOf(directory, tile);
  return {origin.x + i, origin.y + j};
}

// The fraction of an edge at which the difference of its phases is 0, by the Illinois method.
double RootOn(const PhaseEdge& edge, const PhaseField& field) {
  const auto at = [&](double t) {
    return field.Difference(edge.tile, edge.i + (edge.is_up ? 0 : t), edge.j + (edge.is_up ? t : 0),
                            edge.from, edge.to);
  };
  double low = 0, high = 1, at_low = at(0), at_high = at(1);
  // At nodes whose labels another rule has decided, the difference may have any sign.
  if (!(at_low > 0) || !(at_high < 0)) return .5;
  double root = .5;
  int last_side = 0;
  for (int step = 0; step < kRootSteps; ++step) {
    root = low + (high - low) * at_low / (at_low - at_high);
    const double value = at(root);
    if (value > 0) {
      low = root;
      at_low = value;
      if (last_side > 0) at_high /= 2;
      last_side = 1;
    } else {
      high = root;
      at_high = value;
      if (last_side < 0) at_low /= 2;
      last_side = -1;
    }
  }
  return root;
}

VertexNormal UnitOf(double x, double y, const VertexNormal& otherwise) {
  const double length = std::sqrt(x * x + y * y);
  if (length < 1e-6) return otherwise;
  return {static_cast<float>(x / length), static_cast<float>(y / length)};
}

void FindEdgePoint(const TileDirectory& directory, const PhaseEdge& edge, const PhaseField& field,
                   std::uint32_t point, SharedPoints& points) {
  const double t = std::clamp(RootOn(edge, field), kEdgeMargin, 1 - kEdgeMargin);
  const double i = edge.i + (edge.is_up ? 0 : t), j = edge.j + (edge.is_up ? t : 0);
  points.anchor[point] = points.position[point] = NodeAt(directory, edge.tile, i, j);
  const bool ascends = edge.from < edge.to;
  const PhaseDifference d = field.DifferenceAt(edge.tile, i, j, std::min(edge.from, edge.to),
                                               std::max(edge.from, edge.to));
  const float along = ascends ? 1 : -1;
  points.normal[point] = UnitOf(-d.gradient_x, -d.gradient_y,
                                edge.is_up ? VertexNormal{0, along} : VertexNormal{along, 0});
}

// A junction lies in the middle of its cell. The point of an interface that runs around a corner
// lies halfway from the vertex of the body to the corner, so that it does not cross the body's
// outline.
Point AnchorOf(const TileDirectory& directory, const PhaseCell& cell, const BodyVertices& vertices,
               const SharedPoints& points) {
  if (cell.corner == kNoCorner) return NodeAt(directory, cell.tile, cell.i + .5, cell.j + .5);
  const bool right = cell.corner == 1 || cell.corner == 2, upper = cell.corner >= 2;
  const Point corner = NodeAt(directory, cell.tile, cell.i + right, cell.j + upper);
  const std::uint32_t at = vertices.In({cell.tile, cell.i, cell.j});
  const Point& vertex = points.anchor[vertices.CellVertex(at)];
  return {(vertex.x + corner.x) / 2, (vertex.y + corner.y) / 2};
}

// Cuts the outline of one phase into its arcs.
class ArcCollector {
 public:
  ArcCollector(const TileDirectory& directory, const PhaseMap& map, const PointNumbers& numbers,
               std::span<const PhaseRings> phases, Interfaces& interfaces)
      : directory_(directory), map_(map), numbers_(numbers), phases_(phases), to_(interfaces) {}

  void AddPhase(PhaseLabel label) {
    const PhaseRings& rings = phases_[label - 1u];
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) AddRing(label, rings, ring);
  }

 private:
  // Whether a point ends arcs.
  bool IsEnd(std::uint32_t point) const {
    if (numbers_.IsBody(point)) return true;
    return !numbers_.IsEdge(point) && map_.cells[point - numbers_.cells].corner == kNoCorner;
  }

  void AddRing(PhaseLabel label, const PhaseRings& rings, std::size_t ring) {
    const std::span<const std::uint32_t> points = rings.RingPoints(ring);
    const std::span<const PhaseLabel> across =
        std::span(rings.across).subspan(rings.offsets[ring], points.size());
    const std::size_t count = points.size();
    const auto first =
        std::ranges::find_if(points, [&](std::uint32_t point) { return IsEnd(point); });
    if (first == points.end()) {
      // The whole ring is one arc, which the phase with the smaller label adds.
      const PhaseLabel other = *std::ranges::max_element(across);
      if (other < label) return;
      Begin(label, other, rings.topology.component_of_ring[ring]);
      for (std::size_t k = 0; k < count; ++k) AddPoint(points[k], across[k]);
      to_.arcs.back().last = static_cast<std::uint32_t>(to_.points.size());
      return;
    }
    const auto start = static_cast<std::size_t>(first - points.begin());
    for (std::size_t step = 1; step <= count; ++step) {
      const std::size_t k = (start + step) % count, before = (start + step - 1) % count;
      if (IsEnd(points[k])) {
        if (is_open_) End(points[k]);
        continue;
      }
      if (IsEnd(points[before])) {
        // A point that follows the end of an arc lies on an edge.
        if (across[k] < label) continue;
        Begin(label, across[k], rings.topology.component_of_ring[ring]);
        to_.arcs.back().start = points[before];
        is_open_ = true;
      }
      if (is_open_) AddPoint(points[k], across[k]);
    }
  }

  void Begin(PhaseLabel left, PhaseLabel right, std::uint32_t component) {
    const auto first = static_cast<std::uint32_t>(to_.points.size());
    to_.arcs.push_back(
        {.first = first, .last = first, .left = left, .right = right, .left_component = component});
    has_right_ = false;
  }

  void AddPoint(std::uint32_t point, PhaseLabel across) {
    to_.points.push_back(point);
    if (has_right_ || across == kNoPhase) return;
    has_right_ = true;
    PhaseArc& arc = to_.arcs.back();
    const PhaseEdge& edge = map_.edges[point - numbers_.edges];
    const TilePlace from{edge.tile, edge.i, edge.j};
    const TilePlace to =
        Normalise(directory_, edge.tile, edge.i + !edge.is_up, edge.j + edge.is_up);
    const PhaseRings& right = phases_[arc.right - 1u];
    arc.right_component =
        right.topology.components.At(right.crossings, edge.from == arc.right ? from : to);
  }

  void End(std::uint32_t point) {
    to_.arcs.back().end = point;
    to_.arcs.back().last = static_cast<std::uint32_t>(to_.points.size());
    is_open_ = false;
  }

  const TileDirectory& directory_;
  const PhaseMap& map_;
  const PointNumbers& numbers_;
  const std::span<const PhaseRings> phases_;
  Interfaces& to_;
  bool is_open_ = false, has_right_ = false;
};

// The number of points of an arc's ring: the arc itself if closed, else along the arc and back.
std::size_t RingCountOf(const PhaseArc& arc) {
  const std::size_t count = arc.last - arc.first;
  return arc.IsClosed() ? count : 2 * count - 2;
}

// The index in the arc of point k of its ring.
std::size_t IndexInArc(const PhaseArc& arc, std::size_t k) {
  const std::size_t count = arc.last - arc.first;
  return k < count ? k : 2 * count - 2 - k;
}

// Sets `ring` to the positions of the points of an arc's ring.
void CopyRing(const PhaseArc& arc, const Interfaces& interfaces, const SharedPoints& points,
              std::vector<Point>& ring) {
  const std::span<const std::uint32_t> inner = interfaces.InnerPoints(arc);
  ring.resize(RingCountOf(arc));
  for (std::size_t k = 0; k < ring.size(); ++k) {
    ring[k] = points.position[inner[IndexInArc(arc, k)]];
  }
}

PeriodicRings::Size SizeOf(std::span<const Point> ring, double min_length) {
  double length = 0;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Point& next = ring[k + 1 == ring.size() ? 0 : k + 1];
    const double x = next.x - ring[k].x, y = next.y - ring[k].y;
    length += std::sqrt(x * x + y * y);
  }
  if (length < min_length) return {};
  PeriodicRings::Size size = SizeForWindows(ring, {}, min_length / 2);
  size.margin += kWindowPadding;
  return size;
}

// Gives the points of cells the normals of their neighbours.
void FillNormals(std::span<const std::uint32_t> inner, SharedPoints& points) {
  for (std::size_t k = 0; k < inner.size(); ++k) {
    VertexNormal& normal = points.normal[inner[k]];
    if (normal.x != 0 || normal.y != 0) continue;
    normal = points.normal[inner[k > 0 ? k - 1 : std::min<std::size_t>(1, inner.size() - 1)]];
  }
}

// How an open arc continues beyond an end: as its mirror image across a normal of its curve.
struct Mirror {
  Point through;
  Point along;  // Unit, the tangent.

  Point OfPosition(const Point& x) const {
    return Minus(x, Times(along, 2 * Dot(along, Minus(x, through))));
  }
  VertexNormal OfNormal(const VertexNormal& n) const {
    const auto x = static_cast<float>(along.x), y = static_cast<float>(along.y);
    const float twice = 2 * (x * n.x + y * n.y);
    return {n.x - twice * x, n.y - twice * y};
  }
};

// Absent for a closed arc, and for an end that is straight or has no curve.
std::optional<Mirror> MirrorOf(const PhaseArc& arc, bool is_start, double h,
                               const Interfaces& interfaces, const SharedPoints& points) {
  if (arc.IsClosed()) return std::nullopt;
  const std::span<const std::uint32_t> inner = interfaces.InnerPoints(arc);
  const Point& end = points.position[is_start ? arc.start : arc.end];
  const auto curve = CurveAlong(ArcPath(inner, is_start), end, h, points.position);
  if (!curve || curve->bend == 0) return std::nullopt;
  const Point& last = points.position[is_start ? inner.front() : inner.back()];
  const Line tangent = curve->TangentNear(Minus(last, end));
  return Mirror{Plus(end, tangent.through), tangent.along};
}

// The ring of an arc. Beyond the ends of an open arc it may hold mirror images instead.
class ArcRing {
 public:
  ArcRing(const PhaseArc& arc, std::span<const std::uint32_t> inner, PeriodicRing& ring,
          const std::optional<Mirror>& before, const std::optional<Mirror>& after)
      : arc_(arc), inner_(inner), ring_(ring), before_(before), after_(after) {}

  // The number of vertices of the arc; the others repeat or mirror them.
  std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(inner_.size()); }

  void SetPositions(const SharedPoints& points) {
    const auto set = [&](std::ptrdiff_t k, const Point& at) {
      ring_.x[k] = RingUnits(at.x);
      ring_.y[k] = RingUnits(at.y);
    };
    const auto at = [&](std::ptrdiff_t k) { return points.position[inner_[k]]; };
    for (std::ptrdiff_t k = 0; k < ring_.count; ++k) set(k, at(Index(k)));
    for (std::int32_t* values : {ring_.x, ring_.y}) ring_.Repeat(values, 0, ring_.count);
    MeasureArc(ring_, {});
    ForEachImage([&](const Mirror& mirror, std::ptrdiff_t k, std::ptrdiff_t of) {
      set(k, mirror.OfPosition(at(of)));
    });
  }
  // Continues the normals of the first count() vertices to the others.
  void ContinueNormals() {
    for (float* values : {ring_.normal_x, ring_.normal_y}) Continue(values);
    ForEachImage([&](const Mirror& mirror, std::ptrdiff_t k, std::ptrdiff_t of) {
      const VertexNormal image = mirror.OfNormal({ring_.normal_x[of], ring_.normal_y[of]});
      ring_.normal_x[k] = image.x;
      ring_.normal_y[k] = image.y;
    });
  }
  void Continue(float* values) {
    for (std::ptrdiff_t k = count(); k < ring_.count; ++k) values[k] = values[Index(k)];
    ring_.Repeat(values, 0, ring_.count);
  }

 private:
  std::ptrdiff_t Index(std::ptrdiff_t k) const {
    return static_cast<std::ptrdiff_t>(IndexInArc(arc_, static_cast<std::size_t>(k)));
  }
  // Calls visit(mirror, image, vertex) for each vertex that is an image of another.
  template <typename Visit>
  void ForEachImage(Visit visit) {
    const std::ptrdiff_t last = count() - 1;
    if (before_) {
      for (std::ptrdiff_t k = 1; k <= std::min(last, ring_.margin); ++k) visit(*before_, -k, k);
    }
    if (after_) {
      const std::ptrdiff_t most = std::min(last, ring_.count + ring_.margin - 1 - last);
      for (std::ptrdiff_t k = 1; k <= most; ++k) visit(*after_, last + k, last - k);
    }
  }

  const PhaseArc& arc_;
  const std::span<const std::uint32_t> inner_;
  PeriodicRing& ring_;
  const std::optional<Mirror>&before_, &after_;
};

void Smooth(const Scale& scale, const VirtualPlaneConstants& c, const PhaseArc& arc,
            const Interfaces& interfaces, PeriodicRing ring, SharedPoints& points) {
  const double h = scale.spacing;
  const std::span<const std::uint32_t> inner = interfaces.InnerPoints(arc);
  const auto before = MirrorOf(arc, true, h, interfaces, points);
  const auto after = MirrorOf(arc, false, h, interfaces, points);
  ArcRing extended(arc, inner, ring, before, after);
  const std::ptrdiff_t count = extended.count();
  extended.SetPositions(points);
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    ring.normal_x[k] = points.normal[inner[k]].x;
    ring.normal_y[k] = points.normal[inner[k]].y;
  }
  extended.ContinueNormals();
  for (const bool by_angle : {false, true}) {
    MeanNormals(ring, 0, count, (by_angle ? c.bilateral_reach : c.normal_reach) * h, by_angle);
    std::swap(ring.normal_x, ring.next_x);
    std::swap(ring.normal_y, ring.next_y);
    extended.ContinueNormals();
  }
  MeanCurvature(ring, 0, count, c.curvature_reach * h);
  const double rounding = c.rounding * scale.kernel_radius * scale.kernel_radius / 9;
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    ring.base[k] = static_cast<float>(rounding * std::clamp<double>(ring.shift[k], -1 / h, 1 / h));
  }
  extended.Continue(ring.base);
  MeanShift(ring, 0, count, c.smoothing_reach * h);
  for (std::size_t k = 0; k < inner.size(); ++k) {
    Point& at = points.position[inner[k]];
    at.x += double{ring.shift[k]} * ring.normal_x[k];
    at.y += double{ring.shift[k]} * ring.normal_y[k];
    points.normal[inner[k]] = {ring.normal_x[k], ring.normal_y[k]};
  }
}

}  // namespace

void FindInterfacePoints(const TileDirectory& directory, const PhaseMap& map,
                         const PhaseField& field, const PointNumbers& numbers,
                         const BodyVertices& vertices, SharedPoints& points) {
  const std::size_t count = numbers.cells + map.cells.size();
  points.position.resize(count);
  points.anchor.resize(count);
  points.normal.resize(count);
  ParallelFor(map.edges.size(), [&](std::size_t k) {
    FindEdgePoint(directory, map.edges[k], field, numbers.edges + static_cast<std::uint32_t>(k),
                  points);
  });
  for (std::size_t k = 0; k < map.cells.size(); ++k) {
    const std::size_t point = numbers.cells + k;
    points.anchor[point] = points.position[point] =
        AnchorOf(directory, map.cells[k], vertices, points);
    points.normal[point] = {};
  }
}

void CollectArcs(const TileDirectory& directory, const PhaseMap& map, const PointNumbers& numbers,
                 std::span<const PhaseRings> phases, Interfaces& interfaces) {
  interfaces.arcs.clear();
  interfaces.points.clear();
  ArcCollector collector(directory, map, numbers, phases, interfaces);
  for (std::size_t k = 0; k < phases.size(); ++k) {
    collector.AddPhase(static_cast<PhaseLabel>(k + 1));
  }
}

void SmoothInterfaces(const Scale& scale, const VirtualPlaneConstants& constants,
                      Interfaces& interfaces, SharedPoints& points) {
  const double min_length = constants.ShortestRing() * scale.spacing;
  PeriodicRings& rings = interfaces.rings;
  rings.sizes().assign(interfaces.arcs.size(), {});
  for (std::size_t k = 0; k < interfaces.arcs.size(); ++k) {
    const PhaseArc& arc = interfaces.arcs[k];
    FillNormals(interfaces.InnerPoints(arc), points);
    if (arc.last - arc.first < 3) continue;
    CopyRing(arc, interfaces, points, interfaces.ring);
    rings.sizes()[k] = SizeOf(interfaces.ring, min_length);
  }
  rings.Allocate();
  ParallelFor(interfaces.arcs.size(), [&](std::size_t k) {
    if (rings.sizes()[k].count == 0) return;
    const PhaseArc& arc = interfaces.arcs[k];
    Smooth(scale, constants, arc, interfaces, rings[k], points);
  });
}

}  // namespace partiemc
