// Regions for geometry tests, as loops with the inside on their left.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "base/point.h"

namespace partiemc::support {

/// Loops in the format of Triangulator and CountTouchingPairs.
struct Region {
  std::vector<double> points;
  std::vector<std::uint32_t> loop_points;
  std::vector<std::uint32_t> loop_offsets{0};

  std::uint32_t AddPoint(const Point& point);
  /// Adds a loop through new points.
  void AddLoop(const std::vector<Point>& loop);
  /// Adds a loop through existing points.
  void AddLoop(const std::vector<std::uint32_t>& indices);

  Point PointAt(std::size_t index) const { return {points[2 * index], points[2 * index + 1]}; }
  std::size_t LoopCount() const { return loop_offsets.size() - 1; }
  std::vector<Point> Loop(std::size_t loop) const;
  /// Multiplies every coordinate by `scale`, then adds `shift`.
  Region Transformed(double scale, double shift) const;
};

/// The region of these loops.
Region RegionOf(const std::vector<std::vector<Point>>& loops);

/// Twice the signed area of one loop, or of all loops.
double DoubleArea(const std::vector<Point>& loop);
double DoubleArea(const Region& region);

using RandomEngine = std::mt19937_64;
double Uniform(RandomEngine& random, double low, double high);

std::vector<Point> Rectangle(double left, double bottom, double right, double top);
std::vector<Point> Reversed(std::vector<Point> loop);
std::vector<Point> RandomStar(RandomEngine& random, std::size_t count);
/// A band of `turns` turns that winds outwards.
std::vector<Point> Spiral(std::size_t points_per_side, double turns);
/// A comb: teeth of random length above a common back, about 4 points each.
std::vector<Point> Comb(RandomEngine& random, std::size_t teeth);
/// The same comb with its teeth hanging down.
std::vector<Point> HangingComb(RandomEngine& random, std::size_t teeth);

/// Contours of a sum of random waves on a lattice of size x size nodes of spacing 1, outside at its
/// rim: rings with holes and islands.
Region RandomContours(RandomEngine& random, std::size_t size);

/// Whether a cell of a lattice is inside.
struct Cells {
  std::size_t width, height;
  std::vector<char> inside;
  bool At(std::ptrdiff_t x, std::ptrdiff_t y) const;
};
Cells RandomCells(RandomEngine& random, std::size_t width, std::size_t height, double density);
/// Boundary of the cells; each lattice point has one index. At a pinch a loop turns left or right
/// at random. `corners_only` omits points in the middle of straight sides.
Region Staircases(const Cells& cells, RandomEngine& random, bool corners_only);

/// Contours of a random field, and as holes the staircases around the inside cells that no contour
/// crosses.
Region RandomBand(RandomEngine& random, std::size_t size);

/// Random closed loops on a small lattice, which rarely bound a region.
Region RandomGarbage(RandomEngine& random, std::size_t lattice_size, std::size_t max_loops,
                     std::size_t max_points);

}  // namespace partiemc::support
