#include "mesh/triangulate.h"

#include <algorithm>
#include <utility>

namespace partiemc {
namespace {

MonotonePieces::Vertex VertexOf(const SweepEvent& event) { return {event.point, event.index}; }

}  // namespace

bool Triangulator::Triangulate(std::span<const double> points,
                               std::span<const std::uint32_t> loop_points,
                               std::span<const std::uint32_t> loop_offsets,
                               std::vector<std::uint32_t>& triangles) {
  points_ = points;
  const std::size_t size_before = triangles.size();
  intervals_.clear();
  unused_intervals_.clear();
  pieces_.Clear(triangles);
  status_.Clear();

  if (!events_.Collect(points, loop_points, loop_offsets)) return false;
  const std::span<const SweepEvent> events = events_.events();
  for (auto begin = events.begin(); begin != events.end();) {
    const auto end = std::find_if(begin + 1, events.end(), [&](const SweepEvent& event) {
      return event.point != begin->point;
    });
    if (!Visit(std::span(begin, end))) {
      triangles.resize(size_before);
      return false;
    }
    begin = end;
  }
  return true;
}

/// Moves the sweep line past one point; `events` are the passages of loops through it. Returns
/// false if the requirements are broken here. Comparing each vertex with its neighbours on the
/// sweep line finds every crossing: the first crossing exchanges two neighbouring edges. Afterwards
/// no edge can be inserted between the two, and the edge that ends first ends on the wrong side of
/// the other.
bool Triangulator::Visit(std::span<const SweepEvent> events) {
  const SweepEvent& vertex = events.front();
  const std::optional<std::size_t> ending_edges = SplitEdges(events);
  if (!ending_edges.has_value() || !RisingEdgesAlternate(vertex.point)) return false;
  Surroundings around;
  if (!Surround(vertex, *ending_edges, around)) return false;

  // The rising edges must fit: directly left of the point, and directly right of it, the places
  // below and above are both inside the region, or both outside.
  const bool inside_on_left = around.left != kNoIndex;
  const bool inside_on_right = around.right != kNoIndex;
  if (rising_.empty()) {
    if (inside_on_left != inside_on_right) return false;
  } else if (rising_.front().is_left == inside_on_left ||
             rising_.back().is_left != inside_on_right) {
    return false;
  }
  Advance(vertex, around);
  return true;
}

/// Collects the edges that rise from a point, from left to right. Returns the number of edges that
/// end in the point, or nullopt if an edge has length 0.
std::optional<std::size_t> Triangulator::SplitEdges(std::span<const SweepEvent> events) {
  const Point point = events.front().point;
  rising_.clear();
  for (const SweepEvent& event : events) {
    const Point previous = PointAt(points_, event.previous);
    const Point next = PointAt(points_, event.next);
    if (previous == point || next == point) return std::nullopt;
    // The region lies to the left of the loop, so an edge on which the loop descends is a left
    // edge.
    if (SweepsBefore(point, previous)) rising_.push_back({previous, true});
    if (SweepsBefore(point, next)) rising_.push_back({next, false});
  }
  if (rising_.size() > 1) {
    std::sort(rising_.begin(), rising_.end(), [&](const RisingEdge& a, const RisingEdge& b) {
      return Orientation(point, a.upper, b.upper) < 0;
    });
  }
  return 2 * events.size() - rising_.size();
}

bool Triangulator::RisingEdgesAlternate(const Point& point) const {
  for (std::size_t i = 1; i < rising_.size(); ++i) {
    if (rising_[i - 1].is_left == rising_[i].is_left) return false;
    if (Orientation(point, rising_[i - 1].upper, rising_[i].upper) == 0) return false;
  }
  return true;
}

/// Finds the intervals around a point and closes the intervals that end in it. Returns false if the
/// point lies inside an edge, or if not all ending edges were found.
bool Triangulator::Surround(const SweepEvent& vertex, std::size_t ending_edges,
                            Surroundings& found) {
  const Point& point = vertex.point;
  found.cursor = status_.FindFirstNot(
      [&](std::uint32_t id) { return intervals_[id].right.SideOf(point) < 0; });
  std::size_t ended = 0;
  if (!status_.IsEnd(found.cursor)) {
    const std::uint32_t id = status_.At(found.cursor);
    const Interval& interval = intervals_[id];
    if (interval.left.SideOf(point) < 0) {
      found.left = id;
      if (interval.right.SideOf(point) > 0) {
        found.right = id;
        return ending_edges == 0;
      }
      if (interval.right.upper != point) return false;
      ++ended;
      found.cursor = status_.Next(found.cursor);
    }
  }
  while (!status_.IsEnd(found.cursor)) {
    const std::uint32_t id = status_.At(found.cursor);
    const Interval& interval = intervals_[id];
    const int left_side = interval.left.SideOf(point);
    if (left_side > 0) break;
    if (left_side < 0 || interval.left.upper != point) return false;
    ++ended;
    const int right_side = interval.right.SideOf(point);
    if (right_side > 0) {
      found.right = id;
      break;
    }
    if (right_side < 0 || interval.right.upper != point) return false;
    ++ended;
    Close(id, vertex);
    found.cursor = status_.Erase(found.cursor);
  }
  return ended == ending_edges;
}

/// Updates the intervals at the point:
///   - inside an interval: splits this interval, and starts an interval between each inner pair of
///     rising edges;
///   - else the interval on the left continues with the leftmost rising edge as its right edge, and
///     the interval on the right with the rightmost rising edge as its left edge;
///   - if no edge rises and there are intervals on both sides: merges the two intervals;
///   - each remaining pair of rising edges starts a new interval.
void Triangulator::Advance(const SweepEvent& vertex, const Surroundings& around) {
  SweepStatus::Cursor cursor = around.cursor;
  std::span<const RisingEdge> starting = rising_;
  if (around.left != kNoIndex && !starting.empty()) starting = starting.subspan(1);
  if (around.right != kNoIndex && !starting.empty()) starting = starting.first(starting.size() - 1);

  if (around.left != kNoIndex && around.left == around.right) {
    const std::uint32_t upper = SplitInterval(around.left, vertex);
    cursor = Start(vertex, starting, status_.Next(cursor));
    status_.Insert(cursor, upper);
    return;
  }
  if (around.left != kNoIndex) AddToRightChain(intervals_[around.left], vertex);
  if (around.right != kNoIndex) AddToLeftChain(intervals_[around.right], vertex);
  if (rising_.empty()) {
    if (around.left == kNoIndex) return;
    Interval& merged = intervals_[around.left];
    const Interval& other = intervals_[around.right];
    merged.right = other.right;
    merged.right_piece = other.left_piece;
    unused_intervals_.push_back(around.right);
    status_.Erase(cursor);
    return;
  }
  if (around.left != kNoIndex) {
    intervals_[around.left].right = {vertex.point, rising_.front().upper};
  }
  if (around.right != kNoIndex) {
    intervals_[around.right].left = {vertex.point, rising_.back().upper};
  }
  Start(vertex, starting, cursor);
}

/// Starts an interval between each pair of successive `edges`; returns the cursor after them.
SweepStatus::Cursor Triangulator::Start(const SweepEvent& vertex, std::span<const RisingEdge> edges,
                                        SweepStatus::Cursor cursor) {
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2) {
    const std::uint32_t id = NewInterval();
    Interval& interval = intervals_[id];
    interval.left = {vertex.point, edges[i].upper};
    interval.right = {vertex.point, edges[i + 1].upper};
    interval.left_piece = pieces_.Start(VertexOf(vertex));
    cursor = status_.Insert(cursor, id);
  }
  return cursor;
}

/// Splits an interval at a vertex inside it. The diagonal from the vertex to the last vertex of the
/// interval cuts its piece in two. Returns the new interval, to the right of interval `id`.
std::uint32_t Triangulator::SplitInterval(std::uint32_t id, const SweepEvent& vertex) {
  const std::uint32_t right_id = NewInterval();
  Interval& left = intervals_[id];
  Interval& right = intervals_[right_id];
  right.right = left.right;
  right.left = {vertex.point, rising_.back().upper};
  left.right = {vertex.point, rising_.front().upper};
  if (left.IsMerged()) {
    right.left_piece = left.right_piece;
    left.right_piece = {};
  } else {
    // On the side of the chain of the last vertex, the new piece starts with that vertex only. On
    // the other side, the rest of the piece continues.
    const MonotonePieces::Piece fresh = pieces_.Start(pieces_.LastVertex(left.left_piece));
    right.left_piece = fresh;
    if (left.left_piece.is_left_chain) std::swap(left.left_piece, right.left_piece);
  }
  pieces_.AddToRightChain(left.left_piece, VertexOf(vertex));
  pieces_.AddToLeftChain(right.left_piece, VertexOf(vertex));
  return right_id;
}

void Triangulator::AddToLeftChain(Interval& interval, const SweepEvent& vertex) {
  if (interval.IsMerged()) {
    pieces_.Finish(interval.left_piece, VertexOf(vertex));
    interval.left_piece = interval.right_piece;
    interval.right_piece = {};
  }
  pieces_.AddToLeftChain(interval.left_piece, VertexOf(vertex));
}

void Triangulator::AddToRightChain(Interval& interval, const SweepEvent& vertex) {
  if (interval.IsMerged()) pieces_.Finish(interval.right_piece, VertexOf(vertex));
  pieces_.AddToRightChain(interval.left_piece, VertexOf(vertex));
}

void Triangulator::Close(std::uint32_t id, const SweepEvent& vertex) {
  Interval& interval = intervals_[id];
  if (interval.IsMerged()) pieces_.Finish(interval.right_piece, VertexOf(vertex));
  pieces_.Finish(interval.left_piece, VertexOf(vertex));
  unused_intervals_.push_back(id);
}

std::uint32_t Triangulator::NewInterval() {
  if (unused_intervals_.empty()) {
    intervals_.emplace_back();
    return static_cast<std::uint32_t>(intervals_.size() - 1);
  }
  const std::uint32_t id = unused_intervals_.back();
  unused_intervals_.pop_back();
  intervals_[id] = {};
  return id;
}

}  // namespace partiemc
