#include "check/shell_nesting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>

#include "base/cancellation.h"
#include "base/expansion.h"
#include "base/point.h"
#include "base/predicates.h"
#include "base/predicates_in_space.h"
#include "base/vec3.h"

namespace partiemc {
namespace {

// Work, in units of WorkLimit, for a tested box, for a triangle above or below a point, and for
// each shell around another one. The last is large because the list of these shells takes memory.
constexpr std::uint64_t kWorkOfBox = 4, kWorkOfTriangle = 8, kWorkOfContaining = 1 << 10;

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
// triangle if it passes the shadow. The point p is moved by (e, e^2) with an infinitely small,
// positive e, so no line runs through a corner or side of a shadow.

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

/// Finds the shells whose bounding boxes contain a point. Only these can wind around the point, but
/// all shells of a stack along z share the columns of Columns.
class ShellBoxes {
 public:
  explicit ShellBoxes(const Surface& surface)
      : boxes_(surface.ShellCount()), order_(boxes_.size()), bounds_(boxes_.size()) {
    for (std::size_t shell = 0; shell < boxes_.size(); ++shell) {
      for (std::size_t k = 3 * std::size_t{surface.triangle_offsets[shell]};
           k < 3 * std::size_t{surface.triangle_offsets[shell + 1]}; ++k) {
        const Vec3 corner = Vec3At(surface.points, surface.triangles[k]);
        boxes_[shell].Add({corner, corner});
      }
    }
    std::iota(order_.begin(), order_.end(), 0);
    Build(0, order_.size());
  }

  /// Writes the shells whose closed boxes contain p, ascending. Returns the number of tested boxes.
  std::size_t FindAt(const Vec3& p, std::vector<std::uint32_t>& found) const {
    found.clear();
    const std::size_t tested = Find(0, order_.size(), p, found);
    std::sort(found.begin(), found.end());
    return tested;
  }

 private:
  struct Box {
    static constexpr double kInfinity = std::numeric_limits<double>::infinity();

    void Add(const Box& other) {
      low = Lower(low, other.low);
      high = Upper(high, other.high);
    }
    bool Contains(const Vec3& p) const {
      return low.x <= p.x && p.x <= high.x && low.y <= p.y && p.y <= high.y && low.z <= p.z &&
             p.z <= high.z;
    }

    Vec3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
  };

  static std::size_t MiddleOf(std::size_t first, std::size_t last) {
    return first + (last - first) / 2;
  }

  /// Makes a tree of these places in `order_`: the middle one is the root, the places before and
  /// after it are the two subtrees.
  void Build(std::size_t first, std::size_t last) {
    if (first == last) return;
    ThrowIfCancelled();
    Box lows, bounds;
    for (std::size_t k = first; k < last; ++k) {
      const Box& box = boxes_[order_[k]];
      lows.Add({box.low, box.low});
      bounds.Add(box);
    }
    const Vec3 spread = lows.high - lows.low;
    const auto axis = spread.z >= std::max(spread.x, spread.y) ? &Vec3::z
                      : spread.y >= spread.x                   ? &Vec3::y
                                                               : &Vec3::x;
    const std::size_t middle = MiddleOf(first, last);
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double low_a = boxes_[a].low.*axis, low_b = boxes_[b].low.*axis;
                       return low_a < low_b || (low_a == low_b && a < b);
                     });
    bounds_[middle] = bounds;
    Build(first, middle);
    Build(middle + 1, last);
  }

  std::size_t Find(std::size_t first, std::size_t last, const Vec3& p,
                   std::vector<std::uint32_t>& found) const {
    if (first == last) return 0;
    const std::size_t middle = MiddleOf(first, last);
    if (!bounds_[middle].Contains(p)) return 1;
    if (boxes_[order_[middle]].Contains(p)) found.push_back(order_[middle]);
    return 2 + Find(first, middle, p, found) + Find(middle + 1, last, p, found);
  }

  std::vector<Box> boxes_;            // By shell.
  std::vector<std::uint32_t> order_;  // The shells, by place in the tree.
  std::vector<Box> bounds_;           // By place: the bounding box of its subtree.
};

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

  /// The triangles of a shell in the column of p, ascending.
  std::span<const std::uint32_t> At(const Vec3& p, const Surface& surface,
                                    std::uint32_t shell) const {
    const std::vector<std::uint32_t>& all = triangles_[Row(p.y) * columns_ + Column(p.x)];
    const auto first = std::lower_bound(all.begin(), all.end(), surface.triangle_offsets[shell]);
    return {first, std::lower_bound(first, all.end(), surface.triangle_offsets[shell + 1])};
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
    ThrowIfCancelled();
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

/// The winding number of a shell around p. `triangles`: those of the shell in the column of p.
int WindingAround(const Surface& surface, std::span<const std::uint32_t> triangles, const Vec3& p) {
  int winding = 0;
  for (const std::uint32_t t : triangles) {
    const Vec3 a = Vec3At(surface.points, surface.triangles[3 * t]);
    const Vec3 b = Vec3At(surface.points, surface.triangles[3 * t + 1]);
    const Vec3 c = Vec3At(surface.points, surface.triangles[3 * t + 2]);
    const int turn = PassesShadow({Point{a.x, a.y}, Point{b.x, b.y}, Point{c.x, c.y}}, {p.x, p.y});
    // Only triangles above p count: p is on their lower side. If p is in the plane of a triangle,
    // the vertical line does not pass the triangle at p, because triangles do not touch.
    if (turn != 0 && SideOfPlane(a, b, c, p) == -turn) winding += turn;
  }
  return winding;
}

}  // namespace

std::vector<int> OrientationsOf(const Surface& surface) {
  std::vector<int> orientations;
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    ThrowIfCancelled();
    orientations.push_back(OrientationOf(surface, shell));
  }
  return orientations;
}

std::vector<std::uint32_t> ShellsAround(const Surface& surface, WorkLimit* limit) {
  std::vector<std::uint32_t> around(surface.ShellCount(), kNoShell);
  if (around.size() < 2) return around;
  const Columns columns(surface);
  const ShellBoxes boxes(surface);
  WorkCounter work(limit);
  // By shell: the other shells around it, those that wind around its first point.
  std::vector<std::vector<std::uint32_t>> containing(around.size());
  std::vector<std::uint32_t> candidates;
  for (std::uint32_t shell = 0; shell < around.size(); ++shell) {
    ThrowIfCancelled();
    const Vec3 first = Vec3At(surface.points, surface.point_offsets[shell]);
    work.Add(kWorkOfBox * boxes.FindAt(first, candidates));
    for (const std::uint32_t other : candidates) {
      if (other == shell) continue;
      const auto triangles = columns.At(first, surface, other);
      work.Add(kWorkOfTriangle * triangles.size());
      if (WindingAround(surface, triangles, first) == 0) continue;
      containing[shell].push_back(other);
      work.Add(kWorkOfContaining);
    }
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
