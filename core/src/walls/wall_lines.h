// The lines of walls: places on them, distances and directions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/point.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// A straight line of a wall, with the fluid on its left.
struct WallEdge {
  Point from, to;           ///< In cells from the origin of the world.
  Point unit;               ///< Its direction.
  double length = 0;        ///< In cells.
  double start = 0;         ///< Length of the wall up to `from`, in cells.
  std::uint32_t wall = 0;   ///< Index of its wall.
  bool is_endless = false;  ///< The only line of its wall, and not limited to the two points.

  /// To the left: into the fluid.
  Point Left() const { return {-unit.y, unit.x}; }
};

/// A point on a line of a wall: `from` + `share` * (`to` - `from`); `share` is in [0, 1] unless the
/// line is endless.
struct WallPlace {
  std::uint32_t edge = 0;
  double share = 0;
};

/// The place of a wall that is nearest to a point.
struct NearestWall {
  WallPlace place;
  double height = std::numeric_limits<double>::infinity();  ///< In cells; negative in the solid.
};

/// The lines of all walls.
class WallLines {
 public:
  /// Reads the walls of a stream. Requires: Validate has passed them.
  void Build(const std::vector<Wall>& walls, double cell_size);

  std::span<const WallEdge> edges() const { return edges_; }
  std::size_t WallCount() const { return walls_.size(); }
  /// The lines [first, last) of a wall.
  std::span<const WallEdge> EdgesOf(std::size_t wall) const {
    return std::span(edges_).subspan(walls_[wall].first, walls_[wall].last - walls_[wall].first);
  }
  /// Whether the fluid is inside of a polygon: its points run counter-clockwise.
  bool IsTank(std::size_t wall) const { return walls_[wall].is_tank; }

  /// A place in cells, and in world units. The latter is the given point, bit for bit, where
  /// `share` is 0 or 1, and has the given coordinate on a line along an axis.
  Point At(const WallPlace& place) const;
  Point InWorld(const WallPlace& place) const;

  /// The length of the wall up to a place, in cells.
  double Along(const WallPlace& place) const {
    const WallEdge& edge = edges_[place.edge];
    return edge.start + place.share * edge.length;
  }
  /// The length along a wall from one length to another, by the nearer way around a closed wall.
  double Between(std::size_t wall, double from, double to) const;
  /// The place of a wall at a length. Cost: the logarithm of its lines.
  WallPlace PlaceAt(std::size_t wall, double along) const;

  /// The place on one line nearest to a point, and the signed distance.
  NearestWall NearestOn(std::uint32_t edge, const Point& point) const;
  /// The nearest place on some lines. The sign is that of the line which sees the point under the
  /// larger angle if a corner is nearest. Cost: linear in the lines.
  NearestWall Nearest(std::span<const std::uint32_t> edges, const Point& point) const;
  NearestWall NearestOfWall(std::size_t wall, const Point& point) const;

  /// Whether a point is in the solid of a wall; on its lines counts as such. Cost: linear in the
  /// lines of the wall.
  bool IsSolid(std::size_t wall, const Point& point) const;

 private:
  struct Lines {
    std::uint32_t first = 0, last = 0;
    double perimeter = 0;  // 0 for an endless line.
    bool is_tank = false;
  };

  std::vector<WallEdge> edges_;
  std::vector<Point> world_;  // By line: both points in world units.
  std::vector<Lines> walls_;
};

}  // namespace partiemc
