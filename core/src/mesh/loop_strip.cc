#include "mesh/loop_strip.h"

#include <cstddef>

#include "base/predicates.h"

namespace partiemc {
namespace {

double SquaredDistance(const Point& a, const Point& b) {
  const double dx = a.x - b.x;
  const double dy = a.y - b.y;
  return dx * dx + dy * dy;
}

std::size_t Nearest(std::span<const double> points, std::span<const std::uint32_t> loop,
                    const Point& point) {
  std::size_t nearest = 0;
  double least = SquaredDistance(PointAt(points, loop[0]), point);
  for (std::size_t k = 1; k < loop.size(); ++k) {
    const double distance = SquaredDistance(PointAt(points, loop[k]), point);
    if (distance >= least) continue;
    least = distance;
    nearest = k;
  }
  return nearest;
}

}  // namespace

/// Lists the vertices in the order of the walkers. The region lies to the left of both loops, so
/// one walker follows its loop and the other walks against its loop. Returns false if a coordinate
/// is outside the domain of predicates.h.
bool LoopStrip::Collect(std::span<const double> points, std::span<const std::uint32_t> loop,
                        std::span<const std::uint32_t> other) {
  bool in_domain = true;
  const auto add = [&](std::vector<Vertex>& vertices, std::uint32_t index) {
    const Point point = PointAt(points, index);
    in_domain = in_domain && InPredicateDomain(point.x) && InPredicateDomain(point.y);
    vertices.push_back({point, index});
  };
  loop_.clear();
  for (const std::uint32_t index : loop) add(loop_, index);
  loop_.push_back(loop_.front());

  other_.clear();
  const std::size_t start = Nearest(points, other, loop_.front().point);
  for (std::size_t k = start + 1; k-- > 0;) add(other_, other[k]);
  for (std::size_t k = other.size(); k-- > start;) add(other_, other[k]);
  return in_domain;
}

/// The turning number of a loop: counter-clockwise minus clockwise turns through the heading
/// "right", counted at the local minima and maxima in the order of SweepsBefore.
int LoopStrip::Turns(std::span<const Vertex> vertices) {
  int turns = 0;
  for (std::size_t k = 1; k < vertices.size(); ++k) {
    const Point& before = vertices[k - 1].point;
    const Point& point = vertices[k].point;
    const Point& after = vertices[k + 1 < vertices.size() ? k + 1 : 1].point;
    const bool came_down = SweepsBefore(point, before);
    if (came_down != SweepsBefore(point, after)) continue;
    const int turn = Orientation(before, point, after);
    if ((turn > 0) == came_down) turns += turn;
  }
  return turns;
}

bool LoopStrip::Triangulate(std::span<const double> points, std::span<const std::uint32_t> loop,
                            std::span<const std::uint32_t> other,
                            std::vector<std::uint32_t>& triangles) {
  if (!Collect(points, loop, other)) return false;
  const int turns = Turns(loop_);
  if ((turns != 1 && turns != -1) || Turns(other_) != turns) return false;
  const std::size_t size_before = triangles.size();
  // Every point joins the front once, and every triangle removes one point of it, so there are at
  // most `count` triangles.
  const std::size_t count = loop.size() + other.size();
  triangles.resize(size_before + 3 * count);
  std::uint32_t* next = triangles.data() + size_before;
  const auto emit = [&next](const Vertex& a, const Vertex& b, const Vertex& c) {
    next[0] = a.index;
    next[1] = b.index;
    next[2] = c.index;
    next += 3;
  };

  front_.resize(count + 2);
  Vertex* first = front_.data() + loop.size();
  Vertex* last = first + 1;
  *first = loop_.front();
  *last = other_.front();
  auto on_loop = loop_.cbegin() + 1;
  auto on_other = other_.cbegin() + 1;
  while (on_loop != loop_.cend() || on_other != other_.cend()) {
    // The walker whose next point is nearer to the other walker advances.
    const bool along_loop =
        on_other == other_.cend() ||
        (on_loop != loop_.cend() && SquaredDistance(on_loop->point, last->point) <=
                                        SquaredDistance(on_other->point, first->point));
    if (along_loop) {
      const Vertex& vertex = *on_loop++;
      for (; first != last && Orientation(first[0].point, vertex.point, first[1].point) > 0;
           ++first) {
        emit(first[0], vertex, first[1]);
      }
      *--first = vertex;
    } else {
      const Vertex& vertex = *on_other++;
      for (; first != last && Orientation(vertex.point, last[0].point, last[-1].point) > 0;
           --last) {
        emit(vertex, last[0], last[-1]);
      }
      *++last = vertex;
    }
  }
  if (last - first == 1) return true;
  triangles.resize(size_before);
  return false;
}

}  // namespace partiemc
