// Triangulates regions bounded by closed loops, without adding points.
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

/// Triangulates the region to the left of all loops. Outer loops run counter-clockwise, holes
/// clockwise. Islands in holes and several components are allowed. The order of loops is arbitrary.
///
/// Method: one sweep over the points in the order of SweepsBefore (point.h). The sweep line crosses
/// the region in intervals, each between a left and a right edge. An interval holds the piece of
/// the region below it that is not triangulated yet. The sweep cuts the region such that every
/// piece is monotone, and triangulates the pieces on the way. Every decision is an exact
/// Orientation.
///
/// Sources: Garey, Johnson, Preparata and Tarjan, "Triangulating a simple polygon", Information
/// Processing Letters 7 (1978). Hertel and Mehlhorn, "Fast triangulation of the plane with respect
/// to simple polygons", Information and Control 64 (1985).
///
/// Deterministic, bit for bit. Reuses its buffers: an input no larger than an earlier one
/// allocates nothing. Use one object per thread.
class Triangulator {
 public:
  /// Appends the triangles, three point indices each, to `triangles`. Loop k is closed and has the
  /// points loop_points[i] with loop_offsets[k] <= i < loop_offsets[k + 1].
  ///
  /// Requires, and checks:
  ///   1. coordinates in the domain of predicates.h, indices and offsets in range, at least three
  ///      points in each loop, and neighbours on a loop at different positions;
  ///   2. no two edges cross or overlap, and no edge contains a point of another edge. Loops may
  ///      meet each other and themselves only at points that both name (a "pinch"): by the same
  ///      index, or by indices of points at the same position;
  ///   3. the left side of every edge is inside, the right side outside.
  /// Any number of points may be collinear, or have equal x or y.
  ///
  /// Returns true if and only if the input meets these requirements. Then
  ///   - every triangle is strictly counter-clockwise by Orientation;
  ///   - the triangles do not overlap and cover exactly the region;
  ///   - their number is n - 2 outers + 2 holes for n points on the loops. At a pinch, loops count
  ///     as if each turned there without crossing the region: two squares that share a corner are
  ///     two loops, even if they were given as one;
  ///   - the triangles name the lowest index of several points at the same position.
  /// Otherwise returns false and leaves `triangles` unchanged.
  ///
  /// Cost: n log n for searching and sorting, plus n times the square root of the largest number of
  /// edges on the sweep line, with a tiny factor. Memory: about 150 bytes for each point.
  [[nodiscard]] bool Triangulate(std::span<const double> points,
                                 std::span<const std::uint32_t> loop_points,
                                 std::span<const std::uint32_t> loop_offsets,
                                 std::vector<std::uint32_t>& triangles);

 private:
  /// An edge on the sweep line, directed upward, independent of the direction of its loop.
  struct Edge {
    Point lower, upper;

    /// +1 if `point` lies left of the edge, 0 if on its line, -1 if right of it.
    int SideOf(const Point& point) const { return Orientation(lower, upper, point); }
  };

  /// An edge that rises from the current point.
  struct RisingEdge {
    Point upper;
    bool is_left;  // Whether the edge is the left end of an interval, not the right end.
  };

  /// A maximal part of the sweep line inside the region. An interval usually has one piece,
  /// `left_piece`. After a merge point, at which two intervals became one, it has two pieces until
  /// its next vertex: the diagonal from the merge point to that vertex finishes one of the pieces.
  /// The merge point ends the right chain of `left_piece` and the left chain of `right_piece`.
  struct Interval {
    Edge left, right;
    MonotonePieces::Piece left_piece, right_piece;

    bool IsMerged() const { return !right_piece.IsEmpty(); }
  };

  /// The intervals next to a point. The intervals that end in the point are already closed.
  struct Surroundings {
    std::uint32_t left = kNoIndex;  // Directly left of the point.
    std::uint32_t right =
        kNoIndex;                // Directly right of it; equal to `left` if the point is inside.
    SweepStatus::Cursor cursor;  // At `right` if set, else where new intervals are inserted.
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
