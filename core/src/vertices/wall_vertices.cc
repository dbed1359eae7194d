#include "vertices/wall_vertices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "base/point.h"
#include "vertices/placement.h"
#include "vertices/vertices.h"

namespace partiemc {
namespace {

// A low stretch between contacts becomes wet if it has fewer free vertices than this.
constexpr std::size_t kShortStretch = 6;
// The cosine of about 5 degrees. Corners that turn by less need no vertex.
constexpr double kStraight = .996;
// A vertex moves to a corner only if it and its neighbour are at most this far away, in cells.
constexpr double kMostMove = 2;
// In cells. A corner this far outside of a cell still counts as in it.
constexpr double kCornerTolerance = 1e-9;

bool AreEqual(const Point& a, const Point& b) {
  return std::abs(a.x - b.x) < kCornerTolerance && std::abs(a.y - b.y) < kCornerTolerance;
}

// A crossed lattice edge, from its node inside the outline to its node outside.
struct CrossedEdge {
  TilePlace inside, outside;
  Point from, to;
};

class WallVertexFinder {
 public:
  WallVertexFinder(const VertexInput& input, RingVertices& vertices)
      : input_(input), walls_(*input.walls), lines_(walls_.lines()), v_(vertices) {}

  bool Find(std::size_t ring) {
    const std::size_t first = input_.topology.offsets[ring];
    const std::size_t last = input_.topology.offsets[ring + 1];
    bool meets_wall = false;
    for (std::size_t k = first; k < last; ++k) {
      FindEdge(k);
      meets_wall |= v_.walls.kind[2 * k] == VertexKind::kWall;
    }
    for (std::size_t k = first; k < last; ++k) FindCell(k, k + 1 < last ? k + 1 : first);
    if (meets_wall) {
      WetShortStretches(2 * first, 2 * last);
      MoveToCorners(2 * first, 2 * last);
      if (IsFlat(2 * first, 2 * last)) FixAtAnchors(2 * first, 2 * last);
    }
    return meets_wall;
  }

 private:
  const ActiveCell& CellOf(std::size_t segment) const { return input_.planes[segment].cell; }

  CrossedEdge EdgeOf(std::size_t segment) const {
    const ActiveCell& cell = CellOf(segment);
    const int edge = input_.crossings.segments[input_.topology.segments[segment]].entry;
    const int i = cell.i + (edge == 1), j = cell.j + (edge == 2);
    const int along_x = ~edge & 1, along_y = edge & 1;
    const TileDirectory& directory = input_.bins.tiles;
    CrossedEdge crossed{Normalise(directory, cell.tile, i, j),
                        Normalise(directory, cell.tile, i + along_x, j + along_y),
                        {},
                        {}};
    const Point origin = CellOrigin(directory, cell);
    crossed.from = {origin.x + (edge == 1), origin.y + (edge == 2)};
    crossed.to = {crossed.from.x + along_x, crossed.from.y + along_y};
    if (!IsInside(input_.crossings, crossed.inside)) {
      std::swap(crossed.inside, crossed.outside);
      std::swap(crossed.from, crossed.to);
    }
    return crossed;
  }

  // Where a crossed edge, from its inside node on, first meets a wall, unless it leaves the fluid
  // before. If no line near the tile crosses an edge into the solid: the place nearest to the
  // outside node.
  std::optional<WallPlace> FindWall(std::uint32_t tile, const CrossedEdge& edge) const {
    const double above = walls_.HeightAt(edge.inside), below = walls_.HeightAt(edge.outside);
    if (above <= 0 || below > 0) return std::nullopt;
    const Point way = Minus(edge.to, edge.from);
    std::optional<WallPlace> place;
    double first = 2;
    for (const std::uint32_t k : walls_.EdgesNear(tile)) {
      const WallEdge& line = lines_.edges()[k];
      const Point along = line.Span(), to = Minus(line.from, edge.from);
      const double divisor = Cross(way, along);
      if (divisor == 0) continue;
      const double at = Cross(to, along) / divisor, share = Cross(to, way) / divisor;
      if (!(at >= 0 && at <= 1 && at < first)) continue;
      if (!line.is_endless && !(share >= 0 && share <= 1)) continue;
      first = at;
      place = WallPlace{k, share};
    }
    const double in = walls_.FluidAt(input_.level_set, edge.inside);
    const double out = walls_.FluidAt(input_.level_set, edge.outside);
    if (out >= 0 && in < 0 && std::min(first, 1.0) > in / (in - out)) return std::nullopt;
    return place ? *place : walls_.Nearest(tile, edge.to).place;
  }

  void SetWall(std::size_t vertex, const WallPlace& place, VertexKind kind) {
    v_.walls.kind[vertex] = kind;
    v_.walls.place[vertex] = place;
    v_.point[vertex] = lines_.At(place);
    const Point up = lines_.edges()[place.edge].Left();
    v_.normal[vertex] = {static_cast<float>(-up.x), static_cast<float>(-up.y)};
    if (v_.size.empty()) return;
    const double size = walls_.SizeAt(input_.bins.tiles, v_.walls.tile[vertex], v_.point[vertex]);
    if (size > 0) v_.size[vertex] = static_cast<float>(size);
  }

  void FindEdge(std::size_t segment) {
    const std::size_t vertex = 2 * segment;
    const CrossedEdge edge = EdgeOf(segment);
    const ActiveCell& cell = CellOf(segment);
    const bool is_near = walls_.HeightAt({cell.tile, cell.i, cell.j}) < WallField::kMostHeight;
    v_.walls.tile[vertex] = is_near ? cell.tile : kNoTile;
    v_.walls.kind[vertex] = VertexKind::kFree;
    const std::optional<WallPlace> place =
        is_near ? FindWall(cell.tile, edge) : std::optional<WallPlace>();
    v_.walls.is_wet[vertex] = place.has_value();
    if (!place) {
      KeepAnchorOffWalls(cell, edge.from, v_.root[vertex]);
      return;
    }
    SetWall(vertex, *place, VertexKind::kWall);
    // The anchor stays on the lattice edge, away from its nodes.
    const Point &a = edge.from, &b = edge.to, &at = v_.point[vertex];
    const double share = std::clamp((at.x - a.x) * (b.x - a.x) + (at.y - a.y) * (b.y - a.y),
                                    kEdgeMargin, 1 - kEdgeMargin);
    v_.root[vertex] = {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
  }

  // Moves an anchor on an edge that is behind a wall towards the inside node of the edge.
  void KeepAnchorOffWalls(const ActiveCell& cell, const Point& inside, Point& anchor) const {
    constexpr int kMostSteps = 4;
    if (!IsNearWall(cell)) return;
    for (int step = 0; step < kMostSteps && IsBehindWall(cell.tile, anchor); ++step) {
      const Point half = Times(Plus(anchor, inside), .5);
      if (Length(Minus(half, inside)) < kEdgeMargin) return;
      anchor = half;
    }
  }

  void FindCell(std::size_t segment, std::size_t next) {
    const std::size_t vertex = 2 * segment + 1;
    const ActiveCell& cell = CellOf(segment);
    const bool from_wall = v_.walls.is_wet[2 * segment] != 0;
    const bool to_wall = v_.walls.is_wet[2 * next] != 0;
    v_.walls.tile[vertex] = v_.walls.tile[2 * segment];
    v_.walls.is_wet[vertex] = to_wall;
    v_.walls.kind[vertex] = VertexKind::kFree;
    const Point &a = v_.point[2 * segment], &b = v_.point[2 * next];
    const Point middle{(a.x + b.x) / 2, (a.y + b.y) / 2};
    if (from_wall && to_wall) {
      SetWall(vertex, PlaceInCell(cell, a, b), VertexKind::kWall);
    } else if (from_wall || to_wall) {
      SetWall(vertex, walls_.Nearest(cell.tile, middle).place, VertexKind::kContact);
    }
    const bool is_free = v_.walls.kind[vertex] == VertexKind::kFree;
    v_.root[vertex] = AnchorInCell(segment, next, is_free ? v_.root[vertex] : v_.point[vertex]);
  }

  // The point of the segment's cell nearest to a vertex. If it is behind a wall, a point on the way
  // from the middle of the segment to its inside node.
  Point AnchorInCell(std::size_t segment, std::size_t next, const Point& vertex) const {
    const ActiveCell& cell = CellOf(segment);
    const auto clamped = [&](const Point& point) {
      return ClampToCell(input_.bins.tiles, cell,
                         input_.crossings.segments[input_.topology.segments[segment]], point);
    };
    const Point anchor = clamped(vertex);
    if (!IsNearWall(cell) || !IsBehindWall(cell.tile, anchor)) return anchor;
    const Point inside = EdgeOf(segment).from;
    const Point middle = Times(Plus(v_.root[2 * segment], v_.root[2 * next]), .5);
    for (const double share : {0.0, .5, .75, .875}) {
      const Point point = clamped(Plus(middle, Times(Minus(inside, middle), share)));
      if (!IsBehindWall(cell.tile, point)) return point;
    }
    return anchor;
  }

  // Whether a wall may be in a cell.
  bool IsNearWall(const ActiveCell& cell) const {
    constexpr double kDiagonal = 1.5;
    return std::abs(walls_.HeightAt({cell.tile, cell.i, cell.j})) < kDiagonal;
  }

  // The sharpest corner of the walls in a cell that is behind no wall and not at `a` or `b`, the
  // edge vertices of the cell. Without such a corner, the place nearest to the middle of `a` and
  // `b`.
  WallPlace PlaceInCell(const ActiveCell& cell, const Point& a, const Point& b) const {
    constexpr std::size_t kMostLines = 16;  // Crossings of further lines are not found.
    const Point origin = CellOrigin(input_.bins.tiles, cell);
    const auto is_in = [&](const Point& at) {
      const double x = at.x - origin.x, y = at.y - origin.y;
      return std::min(x, y) >= -kCornerTolerance && std::max(x, y) <= 1 + kCornerTolerance;
    };
    WallPlace best = walls_.Nearest(cell.tile, {(a.x + b.x) / 2, (a.y + b.y) / 2}).place;
    double straightest = 1;  // Cosine of the turn.
    const auto consider = [&](const WallPlace& place, const WallEdge& from, const WallEdge& to) {
      const Point at = lines_.At(place);
      if (!is_in(at) || AreEqual(at, a) || AreEqual(at, b)) return;
      const double cosine = Dot(from.unit, to.unit);
      if (cosine >= straightest || IsBehindWall(cell.tile, at)) return;
      straightest = cosine;
      best = place;
    };
    std::array<std::uint32_t, kMostLines> near;
    std::size_t count = 0;
    for (const std::uint32_t k : walls_.EdgesNear(cell.tile)) {
      const WallEdge& line = lines_.edges()[k];
      if (!line.is_endless) {
        const auto of = lines_.EdgesOfLoop(line.loop);
        const WallEdge& next = &line + 1 == of.data() + of.size() ? of.front() : *(&line + 1);
        consider({k, 1}, line, next);
      }
      const Point middle{origin.x + .5, origin.y + .5};
      const bool is_near = std::abs(lines_.NearestOn(k, middle).height) < .75;
      if (is_near && count < kMostLines) near[count++] = k;
    }
    for (std::size_t n = 0; n < count; ++n) {
      for (std::size_t m = n + 1; m < count; ++m) ConsiderCrossing(near[n], near[m], consider);
    }
    return best;
  }

  // Considers the crossing of two lines, if they bound different solids.
  template <typename Consider>
  void ConsiderCrossing(std::uint32_t of_a, std::uint32_t of_b, Consider consider) const {
    const WallEdge &a = lines_.edges()[of_a], &b = lines_.edges()[of_b];
    const Point along_a = a.Span(), along_b = b.Span();
    const double divisor = Cross(along_a, along_b);
    if (a.solid == b.solid || divisor == 0) return;
    const Point to = Minus(b.from, a.from);
    const double on_a = Cross(to, along_b) / divisor, on_b = Cross(to, along_a) / divisor;
    const auto is_on = [](const WallEdge& e, double at) {
      return e.is_endless || (at >= 0 && at <= 1);
    };
    if (is_on(a, on_a) && is_on(b, on_b)) consider(WallPlace{of_a, on_a}, a, b);
  }

  // In a corner of a tank, a few vertices of the fluid's outline may be just off the walls. Makes
  // these vertices, and the contacts before and after them, vertices on walls.
  void WetShortStretches(std::size_t first, std::size_t last) {
    const std::size_t count = last - first;
    const auto at = [&](std::size_t k) { return first + k % count; };
    for (std::size_t contact = 0; contact < count; ++contact) {
      if (v_.walls.kind[at(contact)] != VertexKind::kContact) continue;
      if (v_.walls.is_wet[at(contact)] != 0) continue;  // The ring runs along the wall from here.
      std::size_t end = contact + 1;
      while (end < contact + kShortStretch && IsLow(at(end))) ++end;
      if (v_.walls.kind[at(end)] != VertexKind::kContact) continue;
      for (std::size_t k = contact; k <= end; ++k) {
        v_.walls.is_wet[at(k)] = 1;
        v_.walls.kind[at(k)] = VertexKind::kWall;
        if (k == contact || k == end) continue;
        SetWall(at(k), walls_.Nearest(v_.walls.tile[at(k)], v_.point[at(k)]).place,
                VertexKind::kWall);
      }
    }
  }

  // Whether a ring has nearly no area: all its vertices may lie on one line of a wall. Rounding
  // would then decide whether it is turned inside out.
  bool IsFlat(std::size_t first, std::size_t last) const {
    constexpr double kLeastArea = 1e-4;  // In cells.
    double twice = 0;
    for (std::size_t k = first; k < last; ++k) {
      const Point& next = v_.point[k + 1 < last ? k + 1 : first];
      twice += Cross(Minus(v_.point[k], v_.point[first]), Minus(next, v_.point[first]));
    }
    return std::abs(twice) < 2 * kLeastArea;
  }

  // Returns the vertices of a ring to their anchors, off the walls.
  void FixAtAnchors(std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      v_.walls.kind[k] = VertexKind::kFixed;
      v_.walls.is_wet[k] = 0;
      v_.point[k] = v_.root[k];
    }
  }

  // Whether a free vertex is nearly on a wall.
  bool IsLow(std::size_t vertex) const {
    if (v_.walls.kind[vertex] != VertexKind::kFree || v_.walls.tile[vertex] == kNoTile)
      return false;
    const double height = walls_.Nearest(v_.walls.tile[vertex], v_.root[vertex]).height;
    return std::abs(height) < WallField::kReach / 2 * input_.scale.spacing * v_.SizeOf(vertex);
  }

  // A corner of a tank may lie in a cell whose nodes are all outside. The ring then passes from one
  // line to the other without a vertex at the corner, so the nearer of its two vertices moves to
  // the corner.
  void MoveToCorners(std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const std::size_t next = k + 1 < last ? k + 1 : first;
      if (v_.walls.is_wet[k] == 0) continue;
      const std::optional<WallPlace> corner = CornerBetween(k, next);
      if (!corner) continue;
      const Point at = lines_.At(*corner);
      if (AreEqual(v_.point[k], at) || AreEqual(v_.point[next], at)) continue;
      const double to_k = Length(Minus(v_.point[k], at));
      const double to_next = Length(Minus(v_.point[next], at));
      const auto may_move = [&](std::size_t vertex) {
        return v_.walls.kind[vertex] == VertexKind::kWall && !IsCorner(v_.walls.place[vertex]);
      };
      const std::size_t nearer = to_k < to_next ? k : next, other = to_k < to_next ? next : k;
      const std::size_t moved = may_move(nearer) ? nearer : other;
      if (!may_move(moved) || std::max(to_k, to_next) > kMostMove) continue;
      v_.walls.place[moved] = *corner;
      v_.point[moved] = at;
    }
  }

  bool IsCorner(const WallPlace& place) const {
    return !lines_.edges()[place.edge].is_endless && (place.share == 0 || place.share == 1);
  }

  // The sharpest corner of the walls between the places of two successive vertices that is behind
  // no wall.
  std::optional<WallPlace> CornerBetween(std::size_t k, std::size_t next) const {
    const WallPlace &from = v_.walls.place[k], &to = v_.walls.place[next];
    const WallEdge &a = lines_.edges()[from.edge], &b = lines_.edges()[to.edge];
    if (from.edge == to.edge) return std::nullopt;
    std::optional<WallPlace> sharpest;
    double straightest = kStraight;
    const auto consider = [&](const WallPlace& place, const WallEdge& before,
                              const WallEdge& after) {
      const double cosine = Dot(before.unit, after.unit);
      if (cosine >= straightest || IsBehindWall(v_.walls.tile[k], lines_.At(place))) return;
      straightest = cosine;
      sharpest = place;
    };
    if (a.loop != b.loop) {
      ConsiderCrossing(from.edge, to.edge, consider);
      return sharpest;
    }
    const auto of = lines_.EdgesOfLoop(a.loop);
    const auto start = static_cast<std::size_t>(&a - of.data());
    const double whole = lines_.Between(a.loop, lines_.Along(from), lines_.Along(to));
    for (std::size_t step = 0; step < of.size(); ++step) {
      const WallEdge& before = of[(start + step) % of.size()];
      const WallEdge& after = of[(start + step + 1) % of.size()];
      const double length = lines_.Between(a.loop, lines_.Along(from), after.start);
      if (length < 0 || length > whole) break;
      const auto edge = static_cast<std::uint32_t>(&before - lines_.edges().data());
      consider({edge, 1}, before, after);
    }
    return sharpest;
  }

  // Whether a point is in a solid near the tile, deeper than rounding but less than two cells.
  bool IsBehindWall(std::uint32_t tile, const Point& point) const {
    bool is_behind = false;
    walls_.ForEachSolidNear(tile, point, [&](std::size_t, const NearestWall& nearest) {
      is_behind |=
          nearest.height < -10 * kCornerTolerance && nearest.height > -WallField::kMostHeight / 2;
    });
    return is_behind;
  }

  const VertexInput& input_;
  const WallField& walls_;
  const WallLines& lines_;
  RingVertices& v_;
};

}  // namespace

bool FindWallVertices(const VertexInput& input, std::size_t ring, RingVertices& vertices) {
  return WallVertexFinder(input, vertices).Find(ring);
}

}  // namespace partiemc
