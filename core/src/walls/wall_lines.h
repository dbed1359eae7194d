// The lines of walls: places on them, distances and directions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/point.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"

namespace partiemc {

/// A straight line of a wall, with the fluid on its left.
struct WallEdge {
  Point from, to;         ///< In cells from the origin of the world.
  Point unit;             ///< Its direction.
  double length = 0;      ///< In cells.
  double start = 0;       ///< Length of the loop up to `from`, in cells.
  double share_size = 0;  ///< Length that counts along the loop, in cells; limited for long lines.
  std::uint32_t loop = 0, solid = 0;
  bool is_endless = false;  ///< The only line of its loop, and not limited to the two points.

  /// From `from` to `to`, exact also for an endless line, whose `to` is rounded.
  Point Span() const { return is_endless ? unit : Point{to.x - from.x, to.y - from.y}; }
  /// To the left: into the fluid.
  Point Left() const { return {-unit.y, unit.x}; }
};

/// A point on a line of a wall: `from` + `share` * Span(); `share` is in [0, 1] unless the
/// line is endless.
struct WallPlace {
  std::uint32_t edge = 0;
  double share = 0;
};

/// The place on the walls that is nearest to a point.
struct NearestWall {
  WallPlace place;
  double height = std::numeric_limits<double>::infinity();  ///< In cells; negative in the solid.
};

/// The walls of a frame.
struct GivenWalls {
  std::span<const Wall> fixed;
  const Rings* of_particles = nullptr;  ///< Outlines of wall particles; null: none.
  /// Polygons are obstacles, however they are oriented: rounding may turn the image of a thin
  /// obstacle around.
  bool are_obstacles = false;
};

/// The lines of all walls. They form loops: closed polygons, and endless lines. One or more loops
/// bound a solid: a wall, or the body of wall particles.
class WallLines {
 public:
  /// Where places must be precise, in cells.
  struct Window {
    Point low, high;
  };

  /// Reads the walls of a stream, and the outlines of wall particles if there are any. Long lines
  /// get further points at the sides of the window, because shares of a long line are not precise.
  /// Successive points that round to the same cell coordinates become one. Requires: Validate has
  /// passed the walls. A slanted line is off by 2^-52 of the distance of its points.
  void Build(const GivenWalls& walls, double cell_size, const Window& window);

  std::span<const WallEdge> edges() const { return edges_; }
  std::size_t SolidCount() const { return solids_.size(); }
  std::span<const WallEdge> EdgesOfLoop(std::size_t loop) const {
    return std::span(edges_).subspan(loops_[loop].first, loops_[loop].last - loops_[loop].first);
  }
  /// Whether the solid is bounded by one endless line.
  bool IsEndless(std::size_t solid) const { return edges_[solids_[solid].first].is_endless; }
  /// If true, the points inside of an odd number of its closed loops are solid, else all others.
  bool IsSolidInside(std::size_t solid) const { return solids_[solid].is_inside; }

  /// A place in cells, and in world units. In world units, ends of a line that is not endless have
  /// the bits of the given points, and places on a line along an axis have its given coordinate.
  Point At(const WallPlace& place) const;
  Point InWorld(const WallPlace& place) const;

  /// The length of the loop up to a place, in cells. Long lines outside of the window count as
  /// shorter (WallEdge::share_size).
  double Along(const WallPlace& place) const {
    const WallEdge& edge = edges_[place.edge];
    return edge.start + place.share * edge.share_size;
  }
  /// The signed length along a loop from one length to another, by the shorter way around a closed
  /// one.
  double Between(std::size_t loop, double from, double to) const;
  /// The place of a loop at a length. Cost: the logarithm of its lines.
  WallPlace PlaceAt(std::size_t loop, double along) const;

  /// The place on one line nearest to a point, and the distance, negative to the right of the line.
  NearestWall NearestOn(std::uint32_t edge, const Point& point) const;
  /// The nearest place on some lines. If a corner is nearest, two lines are equally near; the line
  /// whose endless extension is farther from the point counts. Cost: linear in the lines.
  NearestWall Nearest(std::span<const std::uint32_t> edges, const Point& point) const;
  /// The place nearest to `point` on the part of a loop within `reach` cells of `place`, measured
  /// along the loop, with ties as in Nearest. Cost: linear in the lines of this part.
  NearestWall NearestAlong(const WallPlace& place, double reach, const Point& point) const;

  /// The point `height` above both lines, in cells, if they are the walls of a corner of 30 to 150
  /// degrees: if the fluid is between them, and they meet, or end just before.
  std::optional<Point> AboveCorner(std::uint32_t floor, std::uint32_t side, double height) const;

  /// Whether a point is in the solid of an endless line, or on the line.
  bool IsBehindEndless(std::size_t solid, const Point& point) const;

 private:
  struct Loop {
    std::uint32_t first = 0, last = 0;
    double perimeter = 0;  // 0 for an endless line.
  };
  struct Solid {
    std::uint32_t first = 0, last = 0;
    bool is_inside = false;
  };

  void AddEndless(const Point& a, const Point& b, double cell_size, const Window& window);
  // Adds a loop through points that `at` returns for 0 <= k < count. Returns twice its area.
  template <typename PointOf>
  double AddLoop(std::size_t count, double cell_size, const Window& window, PointOf at);
  // Adds lines from a to b, in world units.
  void AddLines(const Point& a, const Point& b, double cell_size, const Window& window, Loop& loop);
  // `is_precise`: in the window, where lengths along the loop must be right.
  void AddLine(const Point& a, const Point& b, double cell_size, Loop& loop,
               bool is_precise = false);

  std::vector<WallEdge> edges_;
  // By line: both points in world units; of an endless line, a point and its step for a share of 1.
  std::vector<Point> world_;
  std::vector<Loop> loops_;
  std::vector<Solid> solids_;
};

}  // namespace partiemc
