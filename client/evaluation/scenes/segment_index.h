// Nearest segment of an outline, by a uniform grid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/evaluation/scenes/outline.h"

namespace partiemc::evaluation {

/// The segments of an outline, sorted into square cells. Owns a copy of what it needs; safe to
/// query from several threads.
class SegmentIndex {
 public:
  struct Nearest {
    double distance = 0;
    Point point;                ///< On the segment.
    std::uint32_t segment = 0;  ///< Segment k starts at point k of the outline.
  };

  /// `cell` is the wanted width of a cell: about the distance of the queries serves best. Cells are
  /// wider where there would be more than eight for each segment.
  SegmentIndex(const Outline& outline, double cell);

  bool Empty() const { return segments_.empty(); }

  /// The nearest segment to `p`, exact up to rounding; of several the first in the order of cells.
  /// Requires: !Empty(). Cost: the segments of the cells within the distance.
  Nearest Find(Point p) const;

  /// Whether `p` is inside the region (odd number of segments to its right). Cost: all segments of
  /// one row of cells.
  bool Contains(Point p) const;

  /// Distance to the boundary, positive inside.
  double SignedDistance(Point p) const;

  /// Unit normal of a segment, out of the region.
  Point OutwardNormal(std::uint32_t segment) const;

  /// Diagonal of the box around all segments.
  double Extent() const;

  /// Pairs of segments that properly cross, neighbours of a loop left out. In plain double
  /// arithmetic: for statistics, not for proofs. Pairs that only touch are not counted.
  std::size_t CountCrossings() const;

 private:
  struct Segment {
    Point a, b;
    std::uint32_t next;  ///< The segment that starts at b.
  };

  int ColumnOf(double x) const;
  int RowOf(double y) const;
  std::span<const std::uint32_t> Cell(int column, int row) const;
  void SearchRow(Point p, int row, int first, int last, Nearest& best, double& square) const;

  std::vector<Segment> segments_;
  Point low_, high_;
  double cell_ = 1;
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> starts_;   ///< Cell k has members [starts_[k], starts_[k + 1]).
  std::vector<std::uint32_t> members_;  ///< Segments by cell; one may be in several.
};

}  // namespace partiemc::evaluation
