// Triangulates regions bounded by closed loops, without adding a point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/bits.h"
#include "base/point.h"
#include "base/predicates.h"
#include "base/sweep_status.h"
#include "mesh/monotone_pieces.h"
#include "mesh/sweep_events.h"

namespace partiemc {

/// Triangulates the region that lies to the left of all loops: outer loops counter-clockwise, holes
/// clockwise, islands in holes and any number of components allowed, in any order.
///
/// Method: one sweep over the points in the order of SweepsBefore (point.h). Each interval between
/// a left and a right edge on the sweep line holds the piece of the region below it that is still
/// to be triangulated, which is monotone: the sweep cuts the region at each point that would make
/// it otherwise, and the pieces are triangulated as it goes. After Garey, Johnson, Preparata and
/// Tarjan, "Triangulating a simple polygon", Information Processing Letters 7 (1978), and Hertel
/// and Mehlhorn, "Fast triangulation of the plane with respect to simple polygons", Information and
/// Control 64 (1985). Every decision is an exact Orientation.
///
/// The result depends on the input only, bit for bit. One object per thread; it keeps its buffers
/// warm and allocates nothing for an input no larger than one before. Assign a new one to free
/// them.
class Triangulator {
 public:
  /// Appends the triangles, three point indices each, to `triangles`. Loop k runs through the
  /// points loop_points[loop_offsets[k]] up to, but not including, loop_points[loop_offsets[k +
  /// 1]], and back to its first.
  ///
  /// Requires, and checks:
  ///   1. coordinates in the domain of predicates.h, indices and offsets in their ranges, at least
  ///      three points in a loop, and neighbours on a loop at different places;
  ///   2. no two edges cross or overlap, and none runs through a point of another: loops may meet
  ///      each other and themselves, but only at points that both of them name (a "pinch": by the
  ///      same index, or by indices of points at the same place);
  ///   3. the left side of every edge is inside, the right side outside.
  /// Points may be collinear, in any number; several may have equal x or equal y.
  ///
  /// Returns true if and only if the input is so. Then
  ///   - every triangle is strictly counter-clockwise by Orientation;
  ///   - triangles do not overlap and cover exactly the region;
  ///   - their number is n - 2 outers + 2 holes, for n points on the loops, when there is no pinch.
  ///     At a pinch, count the loops that result from turning there so that the region on the left
  ///     is never left or crossed (two squares that share a corner are two loops, even if given as
  ///     one);
  ///   - of several points at one place, the triangles name the one of lowest index.
  /// Otherwise `triangles` is as it was.
  ///
  /// Cost: n log n for the searches, and for the sort where heights crowd, plus n times the square
  /// root of the number of edges that a line meets, with a tiny factor. Memory: about 150 bytes per
  /// point on the loops.
  [[nodiscard]] bool Triangulate(std::span<const double> points,
                                 std::span<const std::uint32_t> loop_points,
                                 std::span<const std::uint32_t> loop_offsets,
                                 std::vector<std::uint32_t>& triangles);

 private:
  /// An edge on the sweep line, directed upward whatever the direction of its loop.
  struct Edge {
    Point lower, upper;

    /// +1 where `point` lies left of the edge, 0 on its line, -1 right of it.
    int SideOf(const Point& point) const { return Orientation(lower, upper, point); }
  };

  /// An edge that begins at the point in hand and rises from it.
  struct RisingEdge {
    Point upper;
    bool is_left;  // Bounds an interval of the region on its left; otherwise on its right.
  };

  /// A maximal part of the sweep line inside the region. Above a merge point, where two intervals
  /// have become one, it holds two pieces until a diagonal from the merge point to the next vertex
  /// of the interval shows which of them ends there: `left_piece` has the merge point as the end of
  /// its right chain, `right_piece` as the end of its left one. Otherwise there is `left_piece`
  /// only.
  struct Interval {
    Edge left, right;
    MonotonePieces::Piece left_piece, right_piece;

    bool IsMerged() const { return !right_piece.IsEmpty(); }
  };

  /// Which intervals a point touches from the inside, after those that end in it were closed.
  struct Surroundings {
    std::uint32_t left = kNoIndex;   // Has the region directly to the left of the point.
    std::uint32_t right = kNoIndex;  // The same to the right. Equal to `left`: the point is inside.
    SweepStatus::Cursor cursor;      // At `right`, if there is one; where new intervals go, if not.
  };

  bool Visit(std::span<const SweepEvent> events);
  std::optional<std::size_t> SplitEdges(std::span<const SweepEvent> events);
  bool RisingEdgesAlternate(const Point& point) const;
  bool Surround(const SweepEvent& vertex, std::size_t ending_edges, Surroundings& found);
  void Advance(const SweepEvent& vertex, const Surroundings& around);
  SweepStatus::Cursor Start(const SweepEvent& vertex, std::span<const RisingEdge> edges,
                            SweepStatus::Cursor cursor);

  std::uint32_t SplitInterval(std::uint32_t id, const SweepEvent& vertex);
  void AddToLeftChain(Interval& interval, const SweepEvent& vertex);
  void AddToRightChain(Interval& interval, const SweepEvent& vertex);
  void Close(std::uint32_t id, const SweepEvent& vertex);

  std::uint32_t NewInterval();

  std::span<const double> points_;
  SweepEvents events_;
  std::vector<RisingEdge> rising_;
  std::vector<Interval> intervals_;
  std::vector<std::uint32_t> unused_intervals_;
  MonotonePieces pieces_;
  SweepStatus status_;
};

}  // namespace partiemc
