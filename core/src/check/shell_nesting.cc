#include "check/shell_nesting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>

#include "base/expansion.h"
#include "base/point.h"
#include "base/predicates.h"
#include "base/predicates_in_space.h"
#include "base/vec3.h"

namespace partiemc {
namespace {

// Work, in units of WorkLimit, for a triangle above or below a point, and for each shell around
// another one. The second is large because the list of these shells takes memory.
constexpr std::uint64_t kWorkOfTriangle = 8, kWorkOfContaining = 1 << 10;

// --- Orientation --------------------------------------------------------------------------------

/// An exact sum of any number of doubles (Shewchuk's Grow-Expansion).
class LongSum {
 public:
  void Add(double term) {
    double carry = term;
    std::size_t kept = 0;
    for (const double component : components_) {
      const Rounded sum = TwoSum(carry, component);
      carry = sum.value;
      if (sum.error != 0) components_[kept++] = sum.error;
    }
    components_.resize(kept);
    if (carry != 0) components_.push_back(carry);
  }
  void AddProduct(double a, double b, double c) {
    const Rounded product = TwoProduct(a, b);
    for (const double factor : {product.error, product.value}) {
      const Rounded term = TwoProduct(factor, c);
      Add(term.error);
      Add(term.value);
    }
  }
  int Sign() const { return components_.empty() ? 0 : SignOf(components_.back()); }

 private:
  std::vector<double> components_;
};

int OrientationExactly(const Surface& surface, std::size_t shell) {
  LongSum volume;
  for (std::size_t t = surface.triangle_offsets[shell]; t < surface.triangle_offsets[shell + 1];
       ++t) {
    const Vec3 a = Vec3At(surface.points, surface.triangles[3 * t]);
    const Vec3 b = Vec3At(surface.points, surface.triangles[3 * t + 1]);
    const Vec3 c = Vec3At(surface.points, surface.triangles[3 * t + 2]);
    volume.AddProduct(a.x, b.y, c.z);
    volume.AddProduct(-a.x, b.z, c.y);
    volume.AddProduct(a.y, b.z, c.x);
    volume.AddProduct(-a.y, b.x, c.z);
    volume.AddProduct(a.z, b.x, c.y);
    volume.AddProduct(-a.z, b.y, c.x);
  }
  return volume.Sign();
}

int OrientationOf(const Surface& surface, std::size_t shell) {
  const Vec3 origin = Vec3At(surface.points, surface.point_offsets[shell]);
  double volume = 0, magnitude = 0;
  const std::size_t first = surface.triangle_offsets[shell];
  const std::size_t last = surface.triangle_offsets[shell + 1];
  for (std::size_t t = first; t < last; ++t) {
    const Vec3 a = Vec3At(surface.points, surface.triangles[3 * t]) - origin;
    const Vec3 b = Vec3At(surface.points, surface.triangles[3 * t + 1]) - origin;
    const Vec3 c = Vec3At(surface.points, surface.triangles[3 * t + 2]) - origin;
    volume += Dot(a, Cross(b, c));
    magnitude += (std::abs(a.x) + std::abs(a.y) + std::abs(a.z)) *
                 (std::abs(b.x) + std::abs(b.y) + std::abs(b.z)) *
                 (std::abs(c.x) + std::abs(c.y) + std::abs(c.z));
  }
  // Each term has fewer than 16 rounding errors, and the sum one for each triangle.
  const double bound = 0x1p-52 * (16 + static_cast<double>(last - first)) * magnitude;
  if (std::abs(volume) > bound) return SignOf(volume);
  return OrientationExactly(surface, shell);
}

// --- Nesting ------------------------------------------------------------------------------------

// The shadow of a triangle is its projection along z. A vertical line through a point p passes the
// triangle if it passes the shadow. So that no line runs through a corner or side of a shadow, p is
// moved by (e, e^2) with an infinitely small e > 0.

/// The side of the moved p relative to the line from a to b: +1 left, -1 right. Requires: a != b.
int SideOfMoved(const Point& a, const Point& b, const Point& p) {
  if (const int side = Orientation(a, b, p); side != 0) return side;
  // If p is on the line, moving p by e along x brings it to the left of a line that runs down.
  if (a.y != b.y) return a.y > b.y ? 1 : -1;
  return b.x > a.x ? 1 : -1;
}

/// If the vertical line through p passes the triangle: the orientation of its shadow, +1 or -1.
/// Else 0.
int PassesShadow(const std::array<Point, 3>& shadow, const Point& p) {
  const int turn = Orientation(shadow[0], shadow[1], shadow[2]);
  if (turn == 0) return 0;
  for (int k = 0; k < 3; ++k) {
    if (SideOfMoved(shadow[k], shadow[(k + 1) % 3], p) != turn) return 0;
  }
  return turn;
}

/// Lists the triangles in each column of a grid over x and y.
class Columns {
 public:
  explicit Columns(const Surface& surface) {
    const std::size_t count = surface.TriangleCount();
    double right = 0, top = 0;
    left_ = right = surface.points[0];
    bottom_ = top = surface.points[1];
    for (std::size_t k = 0; k < surface.PointCount(); ++k) {
      left_ = std::min(left_, surface.points[3 * k]);
      right = std::max(right, surface.points[3 * k]);
      bottom_ = std::min(bottom_, surface.points[3 * k + 1]);
      top = std::max(top, surface.points[3 * k + 1]);
    }
    // The bounds give at most a column for each triangle, also for long and narrow surfaces.
    const double width = right - left_, height = top - bottom_, all = static_cast<double>(count);
    edge_ = std::max({2 * std::sqrt(width / all * height), 4 * std::max(width, height) / all,
                      std::numeric_limits<double>::min()});
    constexpr double kMostReached = 6;  // Columns for each triangle.
    for (;; edge_ *= 2) {
      columns_ = 1 + static_cast<std::uint64_t>(width / edge_);
      rows_ = 1 + static_cast<std::uint64_t>(height / edge_);
      if (columns_ * rows_ == 1 || Reached(surface) <= kMostReached * all) break;
    }
    triangles_.resize(columns_ * rows_);
    for (std::uint32_t t = 0; t < count; ++t) AddTriangle(surface, t);
  }

  const std::vector<std::uint32_t>& At(const Vec3& p) const {
    return triangles_[Row(p.y) * columns_ + Column(p.x)];
  }

 private:
  std::uint64_t Column(double x) const {
    return std::min(static_cast<std::uint64_t>((x - left_) / edge_), columns_ - 1);
  }
  std::uint64_t Row(double y) const {
    return std::min(static_cast<std::uint64_t>((y - bottom_) / edge_), rows_ - 1);
  }
  /// The columns that a triangle reaches.
  struct Range {
    std::uint64_t first_row, last_row, first_column, last_column;
  };
  Range RangeOf(const Surface& surface, std::uint32_t t) const {
    const Vec3 a = Vec3At(surface.points, surface.triangles[3 * t]);
    const Vec3 b = Vec3At(surface.points, surface.triangles[3 * t + 1]);
    const Vec3 c = Vec3At(surface.points, surface.triangles[3 * t + 2]);
    return {Row(std::min({a.y, b.y, c.y})), Row(std::max({a.y, b.y, c.y})),
            Column(std::min({a.x, b.x, c.x})), Column(std::max({a.x, b.x, c.x}))};
  }
  /// The number of columns that triangles reach, summed over the triangles.
  double Reached(const Surface& surface) const {
    double reached = 0;
    for (std::uint32_t t = 0; t < surface.TriangleCount(); ++t) {
      const Range range = RangeOf(surface, t);
      reached += static_cast<double>((range.last_row - range.first_row + 1) *
                                     (range.last_column - range.first_column + 1));
    }
    return reached;
  }
  void AddTriangle(const Surface& surface, std::uint32_t t) {
    const Range range = RangeOf(surface, t);
    for (std::uint64_t row = range.first_row; row <= range.last_row; ++row) {
      for (std::uint64_t column = range.first_column; column <= range.last_column; ++column) {
        triangles_[row * columns_ + column].push_back(t);
      }
    }
  }

  double left_ = 0, bottom_ = 0, edge_ = 1;
  std::uint64_t columns_ = 1, rows_ = 1;
  std::vector<std::vector<std::uint32_t>> triangles_;
};

/// The other shells around `shell`: the winding number around its first point is not 0.
std::vector<std::uint32_t> Containing(const Surface& surface, const Columns& columns,
                                      const std::vector<std::uint32_t>& shell_of,
                                      std::uint32_t shell) {
  const Vec3 p = Vec3At(surface.points, surface.point_offsets[shell]);
  std::map<std::uint32_t, int> winding;
  for (const std::uint32_t t : columns.At(p)) {
    if (shell_of[t] == shell) continue;
    const Vec3 a = Vec3At(surface.points, surface.triangles[3 * t]);
    const Vec3 b = Vec3At(surface.points, surface.triangles[3 * t + 1]);
    const Vec3 c = Vec3At(surface.points, surface.triangles[3 * t + 2]);
    const int turn = PassesShadow({Point{a.x, a.y}, Point{b.x, b.y}, Point{c.x, c.y}}, {p.x, p.y});
    // Only triangles above p count: p is on their lower side. If p is in the plane of a triangle,
    // the vertical line does not pass the triangle at p, because triangles do not touch.
    if (turn == 0 || SideOfPlane(a, b, c, p) != -turn) continue;
    winding[shell_of[t]] += turn;
  }
  std::vector<std::uint32_t> containing;
  for (const auto& [other, turns] : winding) {
    if (turns != 0) containing.push_back(other);
  }
  return containing;
}

}  // namespace

std::vector<int> OrientationsOf(const Surface& surface) {
  std::vector<int> orientations;
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    orientations.push_back(OrientationOf(surface, shell));
  }
  return orientations;
}

std::vector<std::uint32_t> ShellsAround(const Surface& surface, WorkLimit* limit) {
  std::vector<std::uint32_t> around(surface.ShellCount(), kNoShell);
  if (around.size() < 2) return around;
  std::vector<std::uint32_t> shell_of(surface.TriangleCount());
  for (std::uint32_t shell = 0; shell < around.size(); ++shell) {
    std::fill(shell_of.begin() + surface.triangle_offsets[shell],
              shell_of.begin() + surface.triangle_offsets[shell + 1], shell);
  }
  const Columns columns(surface);
  WorkCounter work(limit);
  std::vector<std::vector<std::uint32_t>> containing;
  for (std::uint32_t shell = 0; shell < around.size(); ++shell) {
    const Vec3 first = Vec3At(surface.points, surface.point_offsets[shell]);
    work.Add(kWorkOfTriangle * columns.At(first).size());
    containing.push_back(Containing(surface, columns, shell_of, shell));
    work.Add(kWorkOfContaining * containing.back().size());
  }
  work.Finish();
  for (std::uint32_t shell = 0; shell < around.size(); ++shell) {
    // The innermost of these shells lies in all others, so more shells contain it than any other.
    for (const std::uint32_t other : containing[shell]) {
      if (around[shell] == kNoShell ||
          containing[other].size() > containing[around[shell]].size()) {
        around[shell] = other;
      }
    }
  }
  return around;
}

}  // namespace partiemc
