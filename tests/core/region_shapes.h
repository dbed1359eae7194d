// Regions for tests of the geometry: as loops with the inside on their left.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "base/point.h"

namespace partiemc::testing {

/// Loops as Triangulator and CountTouchingPairs take them.
struct Region {
  std::vector<double> points;
  std::vector<std::uint32_t> loop_points;
  std::vector<std::uint32_t> loop_offsets{0};

  std::uint32_t AddPoint(const Point& point);
  /// A loop through new points.
  void AddLoop(const std::vector<Point>& loop);
  /// A loop through points that are there already.
  void AddLoop(const std::vector<std::uint32_t>& indices);

  Point PointAt(std::size_t index) const { return {points[2 * index], points[2 * index + 1]}; }
  std::size_t LoopCount() const { return loop_offsets.size() - 1; }
  std::vector<Point> Loop(std::size_t loop) const;
  /// Every coordinate multiplied by `scale`, then moved by `shift`.
  Region Transformed(double scale, double shift) const;
};

/// Twice the signed area, of the loop or of all loops; about the loop's own first point.
double DoubleArea(const std::vector<Point>& loop);
double DoubleArea(const Region& region);

using Random = std::mt19937_64;
double Uniform(Random& random, double low, double high);

std::vector<Point> Rectangle(double left, double bottom, double right, double top);
std::vector<Point> Reversed(std::vector<Point> loop);
std::vector<Point> RandomStar(Random& random, std::size_t count);
/// A band of `turns` turns that winds outwards.
std::vector<Point> Spiral(std::size_t points_per_side, double turns);
/// Teeth of random length above a common back, about 4 points each. Every tooth begins on its own.
std::vector<Point> Comb(Random& random, std::size_t teeth);
/// The teeth of a comb turned round the back: all hang down from it.
std::vector<Point> HangingComb(Random& random, std::size_t teeth);

/// Contours of a sum of random waves on a lattice of size x size nodes of spacing 1, outside at its
/// rim: rings with holes and islands.
Region RandomContours(Random& random, std::size_t size);

/// Whether a cell of a lattice is inside.
struct Cells {
  std::size_t width, height;
  std::vector<char> inside;
  bool At(std::ptrdiff_t x, std::ptrdiff_t y) const;
};
Cells RandomCells(Random& random, std::size_t width, std::size_t height, double density);
/// Boundary of the cells, lattice points named once. At a pinch the loops go on at random, left or
/// right. `corners_only` leaves out points in the middle of straight sides.
Region Staircases(const Cells& cells, Random& random, bool corners_only);

/// Contours of a random field, and as holes the staircases round the cells inside that they do not
/// run through.
Region RandomBand(Random& random, std::size_t size);

/// A random number of random closed loops on a small lattice: hardly ever a region.
Region RandomGarbage(Random& random, std::size_t lattice_size, std::size_t max_loops,
                     std::size_t max_points);

}  // namespace partiemc::testing
