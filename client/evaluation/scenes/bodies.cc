#include "client/evaluation/scenes/bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "client/evaluation/scenes/shapes.h"

namespace partiemc::evaluation {
namespace {

// A piece of one body's outline outside of all others, from crossing to crossing.
struct Arc {
  std::vector<Point> points;
  bool used = false;
};

bool Covered(const std::vector<Body>& bodies, std::size_t frame, std::size_t self, Point p) {
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    if (k != self && bodies[k].Distance(frame, p) < 0) return true;
  }
  return false;
}

// Where the segment from `free` to `covered` enters another body.
Point CrossingPoint(const std::vector<Body>& bodies, std::size_t frame, std::size_t self,
                    Point free, Point covered) {
  for (int round = 0; round < 50; ++round) {
    const Point middle = 0.5 * (free + covered);
    (Covered(bodies, frame, self, middle) ? covered : free) = middle;
  }
  return free;
}

// Adds the free arcs of body `self`, or its whole outline to `outline` if nothing covers any of it.
void CollectArcs(const std::vector<Body>& bodies, std::size_t frame, std::size_t self,
                 std::vector<Arc>& arcs, Outline& outline) {
  const Body& body = bodies[self];
  const std::vector<Point> loop = EllipseLoop(body.CenterAt(frame), body.a, body.b, body.angle);
  const std::size_t count = loop.size();
  std::vector<bool> covered(count);
  for (std::size_t i = 0; i < count; ++i) covered[i] = Covered(bodies, frame, self, loop[i]);
  if (std::find(covered.begin(), covered.end(), true) == covered.end()) {
    outline.AddLoop(loop);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t before = (i + count - 1) % count;
    if (covered[i] || !covered[before]) continue;
    Arc arc;
    arc.points.push_back(CrossingPoint(bodies, frame, self, loop[i], loop[before]));
    std::size_t k = i;
    for (; !covered[k]; k = (k + 1) % count) arc.points.push_back(loop[k]);
    arc.points.push_back(CrossingPoint(bodies, frame, self, arc.points.back(), loop[k]));
    arcs.push_back(std::move(arc));
  }
}

// The unused arc that starts nearest to where `end` is.
Arc* NextArc(std::vector<Arc>& arcs, Point end) {
  Arc* next = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (Arc& arc : arcs) {
    const Point gap = arc.points.front() - end;
    if (!arc.used && Dot(gap, gap) < least) {
      least = Dot(gap, gap);
      next = &arc;
    }
  }
  return next;
}

}  // namespace

Outline UnionOutline(const std::vector<Body>& bodies, std::size_t frame) {
  Outline outline;
  std::vector<Arc> arcs;
  for (std::size_t k = 0; k < bodies.size(); ++k) CollectArcs(bodies, frame, k, arcs, outline);
  for (Arc& first : arcs) {
    if (first.used) continue;
    std::vector<Point> loop;
    for (Arc* arc = &first; arc != nullptr; arc = NextArc(arcs, loop.back())) {
      // The first arc closes the loop when no other starts nearer to the end.
      if (!loop.empty()) {
        const double to_next = Length(arc->points.front() - loop.back());
        if (Length(loop.front() - loop.back()) <= to_next) break;
        loop.pop_back();  // Both arcs hold the crossing.
      }
      loop.insert(loop.end(), arc->points.begin(), arc->points.end());
      arc->used = true;
    }
    loop.pop_back();
    outline.AddLoop(loop);
  }
  return outline;
}

KnownParticles UnionParticles(const std::vector<Body>& bodies,
                              const std::vector<std::vector<Point>>& samples, std::size_t frame) {
  KnownParticles particles;
  std::uint64_t id = 0;
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    for (const Point& sample : samples[k]) {
      const Point p = bodies[k].CenterAt(frame) + sample;
      const bool taken = std::any_of(bodies.begin(), bodies.begin() + static_cast<long>(k),
                                     [&](const Body& b) { return b.Distance(frame, p) < 0; });
      if (!taken) {
        particles.points.push_back(p);
        particles.ids.push_back(id);
      }
      ++id;
    }
  }
  return particles;
}

}  // namespace partiemc::evaluation
