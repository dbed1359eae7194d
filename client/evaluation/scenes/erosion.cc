#include "client/evaluation/scenes/erosion.h"

#include <algorithm>
#include <cmath>

#include "client/evaluation/scenes/segment_index.h"
#include "client/evaluation/scenes/trigonometry.h"

namespace partiemc::evaluation {
namespace {

// A point of the eroded outline is `depth` away from the outline, but for this part of it: the
// chords of a curved outline cut it a little shorter.
constexpr double kTolerance = 2e-3;

// Corners of arcs around reentrant corners turn by this much, in radians: a chord is then less than
// 1e-3 radii away from its arc.
constexpr double kArcStep = 0.08;

// A point of the outline moved inward along the normal there.
struct Candidate {
  Point point;
  Point along;  // Direction of the eroded outline, unit length.
};

Point InwardOf(Point along) { return {-along.y, along.x}; }

void AppendArc(Point center, Point from, Point to, double depth, std::vector<Candidate>& out) {
  const double turn = std::atan2(Cross(from, to), Dot(from, to));
  if (turn >= 0) return;  // Convex or straight: the moved segments overlap.
  const int pieces = static_cast<int>(-turn / kArcStep);
  for (int k = 1; k <= pieces; ++k) {
    const Direction d = DirectionOf(turn * k / (pieces + 1));
    const Point along = {d.cosine * from.x - d.sine * from.y, d.sine * from.x + d.cosine * from.y};
    out.push_back({center + depth * InwardOf(along), along});
  }
}

std::vector<Candidate> Candidates(std::span<const Point> loop, double depth) {
  std::vector<Candidate> candidates;
  const auto direction = [&](std::size_t i) {
    const Point along = loop[(i + 1) % loop.size()] - loop[i];
    return (1 / Length(along)) * along;
  };
  Point before = direction(loop.size() - 1);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Point along = direction(i);
    AppendArc(loop[i], before, along, depth, candidates);
    candidates.push_back({loop[i] + depth * InwardOf(along), along});
    candidates.push_back({loop[(i + 1) % loop.size()] + depth * InwardOf(along), along});
    before = along;
  }
  return candidates;
}

// Where the lines through two candidates meet: the convex corner that was cut off between them.
bool Corner(const Candidate& a, const Candidate& b, Point& corner) {
  const double sine = Cross(a.along, b.along);
  if (sine < 0.02) return false;
  corner = a.point + (Cross(b.point - a.point, b.along) / sine) * a.along;
  return Dot(corner - a.point, a.along) >= 0 && Dot(b.point - corner, b.along) >= 0;
}

std::vector<Point> Join(const std::vector<Candidate>& kept, double depth) {
  std::vector<Point> loop;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const Candidate& next = kept[(i + 1) % kept.size()];
    if (loop.empty() || Length(kept[i].point - loop.back()) > 1e-9 * depth) {
      loop.push_back(kept[i].point);
    }
    if (Point corner; Corner(kept[i], next, corner)) loop.push_back(corner);
  }
  return loop;
}

}  // namespace

Outline ErodedOutline(const Outline& outline, double depth) {
  const SegmentIndex index(outline, depth / 2);
  const double least = (1 - kTolerance) * depth;
  Outline eroded;
  for (std::size_t k = 0; k < outline.LoopCount(); ++k) {
    std::vector<Candidate> kept = Candidates(outline.Loop(k), depth);
    std::erase_if(kept, [&](const Candidate& c) { return index.SignedDistance(c.point) < least; });
    const std::vector<Point> loop = Join(kept, depth);
    if (loop.size() < 3) return {};
    // A jump across a waist that has vanished leaves the curve at `depth` from the outline.
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point middle = 0.5 * (loop[i] + loop[(i + 1) % loop.size()]);
      const double distance = index.SignedDistance(middle);
      if (std::abs(distance - depth) > 5 * kTolerance * depth) return {};
    }
    eroded.AddLoop(loop);
  }
  return eroded;
}

}  // namespace partiemc::evaluation
