// Finds pairs of triangles whose boxes intersect.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "check/triangle_contact.h"

namespace partiemc {

/// A uniform grid that finds the pairs of triangles in space whose boxes intersect.
class TriangleGrid {
 public:
  TriangleGrid() = default;
  TriangleGrid(std::span<const double> points, std::span<const std::uint32_t> triangles) {
    Build(points, triangles);
  }

  /// Replaces the triangles, and keeps the buffers. Requires: finite coordinates.
  void Build(std::span<const double> points, std::span<const std::uint32_t> triangles);

  /// The number of pairs of triangles that ForEachPair examines: the pairs in each cell, summed
  /// over the cells. A pair with several common cells counts once for each.
  std::uint64_t PairsOfCells() const;

  /// Calls visit(a, b), a < b, once for each pair of triangles whose boxes intersect, until `visit`
  /// returns false. The order of the pairs is fixed.
  template <typename Visit>
  void ForEachPair(Visit visit) const;

 private:
  struct Box {
    std::array<double, 3> low, high;
  };
  struct Entry {
    std::uint64_t cell;
    std::uint32_t triangle;
  };

  std::uint64_t CellOf(double value, int axis) const {
    return static_cast<std::uint64_t>((value - low_[axis]) / edge_);
  }
  static std::uint64_t Key(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
    return (z << 42) | (y << 21) | x;
  }
  /// The number of cells of size edge_ that boxes reach, summed over the boxes.
  double Reached() const;
  /// Whether `cell` is the lowest cell of the intersection of two boxes. ForEachPair visits the
  /// pair only in this cell, so once.
  bool IsFirstOf(std::uint64_t cell, const Box& a, const Box& b) const;

  std::vector<Box> boxes_;
  std::vector<Entry> entries_;
  std::array<double, 3> low_{};
  double edge_ = 1;
};

inline void TriangleGrid::Build(std::span<const double> points,
                                std::span<const std::uint32_t> triangles) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  boxes_.resize(triangles.size() / 3);
  low_.fill(kInfinity);
  std::array<double, 3> high{-kInfinity, -kInfinity, -kInfinity};
  double extents = 0;
  for (std::size_t t = 0; t < boxes_.size(); ++t) {
    Box& box = boxes_[t];
    box.low.fill(kInfinity);
    box.high.fill(-kInfinity);
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        const double value = points[3 * std::size_t{triangles[3 * t + k]} + axis];
        box.low[axis] = std::min(box.low[axis], value);
        box.high[axis] = std::max(box.high[axis], value);
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      low_[axis] = std::min(low_[axis], box.low[axis]);
      high[axis] = std::max(high[axis], box.high[axis]);
      extents += box.high[axis] - box.low[axis];
    }
  }
  entries_.clear();
  if (boxes_.empty()) return;
  double extent = 0;
  for (int axis = 0; axis < 3; ++axis) extent = std::max(extent, high[axis] - low_[axis]);
  // The lower bounds keep each coordinate of a cell below 2^21, the bits of a key.
  edge_ = std::max({extents / 3 / static_cast<double>(boxes_.size()), extent / 0x1p20,
                    std::numeric_limits<double>::min()});
  constexpr double kMostCells = 16;  // For each triangle.
  double reached = Reached();
  for (; reached > kMostCells * static_cast<double>(boxes_.size()); reached = Reached()) edge_ *= 2;
  entries_.reserve(static_cast<std::size_t>(reached));
  for (std::uint32_t t = 0; t < boxes_.size(); ++t) {
    const Box& box = boxes_[t];
    for (auto z = CellOf(box.low[2], 2); z <= CellOf(box.high[2], 2); ++z) {
      for (auto y = CellOf(box.low[1], 1); y <= CellOf(box.high[1], 1); ++y) {
        for (auto x = CellOf(box.low[0], 0); x <= CellOf(box.high[0], 0); ++x) {
          entries_.push_back({Key(x, y, z), t});
        }
      }
    }
  }
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.triangle < b.triangle;
  });
}

inline double TriangleGrid::Reached() const {
  double reached = 0;
  for (const Box& box : boxes_) {
    double cells = 1;
    for (int axis = 0; axis < 3; ++axis) {
      cells *= static_cast<double>(CellOf(box.high[axis], axis) - CellOf(box.low[axis], axis) + 1);
    }
    reached += cells;
  }
  return reached;
}

inline std::uint64_t TriangleGrid::PairsOfCells() const {
  std::uint64_t pairs = 0;
  for (std::size_t first = 0, last = 0; first < entries_.size(); first = last) {
    while (last < entries_.size() && entries_[last].cell == entries_[first].cell) ++last;
    pairs += std::uint64_t{last - first} * (last - first - 1) / 2;
  }
  return pairs;
}

inline bool TriangleGrid::IsFirstOf(std::uint64_t cell, const Box& a, const Box& b) const {
  std::array<std::uint64_t, 3> first;
  for (int axis = 0; axis < 3; ++axis)
    first[axis] = CellOf(std::max(a.low[axis], b.low[axis]), axis);
  return cell == Key(first[0], first[1], first[2]);
}

template <typename Visit>
void TriangleGrid::ForEachPair(Visit visit) const {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Box& a = boxes_[entries_[i].triangle];
    for (std::size_t j = i + 1; j < entries_.size() && entries_[j].cell == entries_[i].cell; ++j) {
      const Box& b = boxes_[entries_[j].triangle];
      bool is_apart = false;
      for (int axis = 0; axis < 3; ++axis) {
        is_apart = is_apart || a.low[axis] > b.high[axis] || b.low[axis] > a.high[axis];
      }
      if (is_apart || !IsFirstOf(entries_[i].cell, a, b)) continue;
      if (!visit(entries_[i].triangle, entries_[j].triangle)) return;
    }
  }
}

}  // namespace partiemc
