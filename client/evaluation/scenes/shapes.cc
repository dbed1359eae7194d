#include "client/evaluation/scenes/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <utility>
#include <vector>

#include "client/evaluation/scenes/trigonometry.h"

namespace partiemc::evaluation {
namespace {

using Loop = std::vector<Point>;

constexpr std::array<std::string_view, 19> kTuning = {
    "disc",   "square",    "ell",     "annulus",   "gear",        "horseshoe", "star",
    "bar",    "two-discs", "ellipse", "rectangle", "cross",       "triangle",  "blob-with-holes",
    "clover", "frame",     "lens",    "comb",      "two-ellipses"};
constexpr std::array<std::string_view, 10> kValidation = {
    "egg",  "tee",       "crescent",  "stairs", "drop",
    "bean", "half-disc", "trapezoid", "window", "three-discs"};
constexpr std::array<std::string_view, 10> kLatticeShapes = {
    "square", "ell", "bar", "cross", "rectangle", "frame", "comb", "tee", "stairs", "window"};

// Gaps between two bodies, in spacings: well below two kernel radii, so that only the guard keeps
// the level set from joining them.
constexpr double kDiscGap = 2.5;
constexpr double kEllipseGap = 2.0;
constexpr double kThreeDiscGap = 2.3;

Outline Single(const Loop& loop) {
  Outline outline;
  outline.AddLoop(loop);
  return outline;
}

Loop Reversed(Loop loop) {
  std::reverse(loop.begin(), loop.end());
  return loop;
}

Loop Scaled(Loop loop, double scale, Point shift = {}) {
  for (Point& p : loop) p = scale * (p + shift);
  return loop;
}

double StepsFor(double length) { return std::ceil(length / kCurveStep); }

void AppendArc(Point center, double radius, double from, double to, Loop& loop) {
  const double steps = StepsFor(radius * std::abs(to - from));
  for (double k = 0; k <= steps; ++k) {
    const Direction d = DirectionOf(from + (to - from) * k / steps);
    loop.push_back({center.x + radius * d.cosine, center.y + radius * d.sine});
  }
}

Loop Circle(Point center, double radius) { return EllipseLoop(center, radius, radius, 0); }

// radius(angle) around the origin; `size` is about its largest value.
template <typename Radius>
Loop Polar(double size, Radius radius) {
  Loop loop;
  const double steps = StepsFor(4 * kPi * size);
  for (double k = 0; k < steps; ++k) {
    const double angle = 2 * kPi * k / steps;
    const Direction d = DirectionOf(angle);
    const double r = radius(angle);
    loop.push_back({r * d.cosine, r * d.sine});
  }
  return loop;
}

// Corners at whole numbers of units, a unit being the whole number of spacings that brings the area
// nearest; around the middle of their box.
Outline Blocks(std::initializer_list<Loop> loops, double area) {
  double units = 0;
  Point high;
  for (const Loop& loop : loops) {
    units += SignedArea(loop);
    for (const Point& p : loop) high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  const double unit = std::max(1.0, std::round(std::sqrt(area / units)));
  const Point middle = {std::floor(high.x * unit / 2), std::floor(high.y * unit / 2)};
  Outline outline;
  for (const Loop& loop : loops) outline.AddLoop(Scaled(loop, unit, (-1 / unit) * middle));
  return outline;
}

Loop BoxLoop(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

// A box of whole spacings, `aspect` times as wide as high.
Outline Box(double height, double area) {
  const double rows = std::round(height);
  const double columns = std::round(area / rows);
  const Point low = {-std::floor(columns / 2), -std::floor(rows / 2)};
  return Single(BoxLoop(low.x, low.y, low.x + columns, low.y + rows));
}

Outline Annulus(double area) {
  const double inner = 0.45;
  const double radius = std::sqrt(area / (kPi * (1 - inner * inner)));
  Outline outline = Single(Circle({}, radius));
  outline.AddLoop(Reversed(Circle({}, inner * radius)));
  return outline;
}

// Nine teeth with slanted flanks: convex and concave corners in turn.
Outline Gear(double area) {
  constexpr int kTeeth = 9;
  Loop loop;
  for (int tooth = 0; tooth < kTeeth; ++tooth) {
    for (const auto& [at, radius] : {std::pair{0.0, 0.8}, {0.3, 0.8}, {0.45, 1.0}, {0.85, 1.0}}) {
      const Direction d = DirectionOf(2 * kPi * (tooth + at) / kTeeth);
      loop.push_back({radius * d.cosine, radius * d.sine});
    }
  }
  return Single(Scaled(loop, std::sqrt(area / SignedArea(loop))));
}

// An arc of 270 degrees with a thickness of half its radius and round ends.
Outline Horseshoe(double area) {
  constexpr double kHalf = 0.25;
  constexpr double kFrom = kPi / 4;
  constexpr double kTo = 7 * kPi / 4;
  const double radius = std::sqrt(area / (2 * kHalf * (kTo - kFrom) + kPi * kHalf * kHalf));
  const auto end = [&](double angle) {
    const Direction d = DirectionOf(angle);
    return Point{radius * d.cosine, radius * d.sine};
  };
  Loop loop;
  AppendArc({}, (1 + kHalf) * radius, kFrom, kTo, loop);
  loop.pop_back();
  AppendArc(end(kTo), kHalf * radius, kTo, kTo + kPi, loop);
  loop.pop_back();
  AppendArc({}, (1 - kHalf) * radius, kTo, kFrom, loop);
  loop.pop_back();
  AppendArc(end(kFrom), kHalf * radius, kFrom + kPi, kFrom + 2 * kPi, loop);
  loop.pop_back();
  return Single(loop);
}

Outline Star(double area) {
  Loop loop;
  for (int k = 0; k < 10; ++k) {
    const Direction d = DirectionOf(kPi * k / 5 + 0.3);
    const double radius = k % 2 == 0 ? 1 : 0.5;
    loop.push_back({radius * d.cosine, radius * d.sine});
  }
  return Single(Scaled(loop, std::sqrt(area / SignedArea(loop))));
}

Outline Triangle(double area) {
  const Loop loop = {{-0.9, -0.6}, {1.1, -0.5}, {-0.3, 1.1}};
  return Single(Scaled(loop, std::sqrt(area / SignedArea(loop))));
}

Outline TwoDiscs(double area) {
  const double radius = std::sqrt(area / (kPi * (1 + 0.7 * 0.7)));
  Outline outline = Single(Circle({-radius - kDiscGap / 2, 0}, radius));
  outline.AddLoop(Circle({0.7 * radius + kDiscGap / 2, 0}, 0.7 * radius));
  return outline;
}

Outline TwoEllipses(double area) {
  const double size = std::sqrt(area / (kPi * (0.6 + 0.5 * 0.8)));
  Outline outline = Single(EllipseLoop({0, -0.6 * size - kEllipseGap / 2}, size, 0.6 * size, 0));
  outline.AddLoop(EllipseLoop({0, 0.5 * size + kEllipseGap / 2}, 0.8 * size, 0.5 * size, 0));
  return outline;
}

Outline BlobWithHoles(double area) {
  constexpr double kHoles = 0.04 + 0.0225 + 0.0144;
  const double size = std::sqrt(area / (kPi * (1 + 0.0072 + 0.00125 - kHoles)));
  Outline outline = Single(Polar(1.2 * size, [size](double angle) {
    return size * (1 + 0.12 * Sine(3 * angle + 0.4) + 0.05 * Sine(5 * angle));
  }));
  outline.AddLoop(Reversed(Circle({0.45 * size, 0.1 * size}, 0.2 * size)));
  outline.AddLoop(Reversed(Circle({-0.4 * size, 0.35 * size}, 0.15 * size)));
  outline.AddLoop(Reversed(Circle({-0.25 * size, -0.45 * size}, 0.12 * size)));
  return outline;
}

Outline Clover(double area) {
  constexpr double kDepth = 0.35;
  const double size = std::sqrt(area / (kPi * (1 + kDepth * kDepth / 2)));
  return Single(Polar((1 + kDepth) * size, [size](double angle) {
    return size * (1 + kDepth * Sine(4 * angle + 0.7));
  }));
}

// What two discs of radius r have in common whose centres are 1.2 r apart: two sharp tips.
Outline Lens(double area) {
  constexpr double half = 0.92729521800161219;  // acos(0.6)
  const double radius = std::sqrt(area / (2 * half - 2 * 0.6 * 0.8));
  Loop loop;
  AppendArc({-0.6 * radius, 0}, radius, -half, half, loop);
  loop.pop_back();
  AppendArc({0.6 * radius, 0}, radius, kPi - half, kPi + half, loop);
  loop.pop_back();
  return Single(loop);
}

// A disc without what it shares with another of its size, 0.7 radii away: two sharp tips, one side
// concave.
Outline Crescent(double area) {
  constexpr double kHalf = 1.2132252231493863;  // acos(0.35)
  const double shared = 2 * kHalf - 0.35 * std::sqrt(4 - 0.49);
  const double radius = std::sqrt(area / (kPi - shared));
  Loop loop;
  AppendArc({}, radius, kHalf, 2 * kPi - kHalf, loop);
  loop.pop_back();
  AppendArc({0.7 * radius, 0}, radius, kPi + kHalf, kPi - kHalf, loop);
  loop.pop_back();
  return Single(loop);
}

// A disc and its two tangents from a point two radii away.
Outline Drop(double area) {
  const double radius = std::sqrt(area / (std::sqrt(3.0) + 2 * kPi / 3));
  Loop loop = {{2 * radius, 0}};
  AppendArc({}, radius, kPi / 3, 5 * kPi / 3, loop);
  return Single(loop);
}

Outline HalfDisc(double area) {
  Loop loop;
  AppendArc({}, std::sqrt(2 * area / kPi), -kPi / 2, kPi / 2, loop);
  return Single(loop);
}

Outline Egg(double area) {
  constexpr double kShift = 0.25;
  const double size = std::sqrt(area / (kPi * (1 + kShift * kShift / 2)));
  return Single(Polar((1 + kShift) * size,
                      [size](double angle) { return size * (1 + kShift * Sine(angle + 0.2)); }));
}

Outline Bean(double area) {
  const double size = std::sqrt(area / (kPi * (1 + (0.3 * 0.3 + 0.12 * 0.12) / 2)));
  return Single(Polar(1.4 * size, [size](double angle) {
    return size * (1 + 0.3 * Sine(2 * angle) + 0.12 * Sine(3 * angle + 1));
  }));
}

Outline Trapezoid(double area) {
  const Loop loop = {{-1, -0.5}, {1.2, -0.6}, {0.5, 0.7}, {-0.4, 0.6}};
  return Single(Scaled(loop, std::sqrt(area / SignedArea(loop))));
}

Outline ThreeDiscs(double area) {
  const double radius = std::sqrt(area / (kPi * (1 + 0.8 * 0.8 + 0.6 * 0.6)));
  Outline outline = Single(Circle({}, radius));
  outline.AddLoop(Circle({1.8 * radius + kThreeDiscGap, 0}, 0.8 * radius));
  outline.AddLoop(Circle({0, -1.6 * radius - kThreeDiscGap}, 0.6 * radius));
  return outline;
}

Outline SparseShape(std::string_view shape, double area) {
  if (shape == "disc") return Single(Circle({}, std::sqrt(area / kPi)));
  if (shape == "square") return Box(std::sqrt(area), area);
  if (shape == "ell") {
    return Blocks({{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}}, area);
  }
  if (shape == "annulus") return Annulus(area);
  if (shape == "gear") return Gear(area);
  if (shape == "horseshoe") return Horseshoe(area);
  if (shape == "star") return Star(area);
  if (shape == "bar") return Box(6, area);
  if (shape == "two-discs") return TwoDiscs(area);
  if (shape == "ellipse") {
    const double b = std::sqrt(area / (2 * kPi));
    return Single(EllipseLoop({}, 2 * b, b, 0.5));
  }
  if (shape == "rectangle") return Box(std::sqrt(area / 2), area);
  if (shape == "cross") {
    return Blocks({{{1, 0},
                    {2, 0},
                    {2, 1},
                    {3, 1},
                    {3, 2},
                    {2, 2},
                    {2, 3},
                    {1, 3},
                    {1, 2},
                    {0, 2},
                    {0, 1},
                    {1, 1}}},
                  area);
  }
  if (shape == "triangle") return Triangle(area);
  if (shape == "blob-with-holes") return BlobWithHoles(area);
  if (shape == "clover") return Clover(area);
  if (shape == "frame") return Blocks({BoxLoop(0, 0, 5, 5), Reversed(BoxLoop(2, 1, 4, 3))}, area);
  if (shape == "lens") return Lens(area);
  if (shape == "comb") {
    return Blocks({{{0, 0},
                    {5, 0},
                    {5, 4},
                    {4, 4},
                    {4, 1},
                    {3, 1},
                    {3, 4},
                    {2, 4},
                    {2, 1},
                    {1, 1},
                    {1, 4},
                    {0, 4}}},
                  area);
  }
  if (shape == "two-ellipses") return TwoEllipses(area);
  if (shape == "egg") return Egg(area);
  if (shape == "tee") {
    return Blocks({{{1, 0}, {2, 0}, {2, 2}, {3, 2}, {3, 3}, {0, 3}, {0, 2}, {1, 2}}}, area);
  }
  if (shape == "crescent") return Crescent(area);
  if (shape == "stairs") {
    return Blocks({{{0, 0}, {3, 0}, {3, 1}, {2, 1}, {2, 2}, {1, 2}, {1, 3}, {0, 3}}}, area);
  }
  if (shape == "drop") return Drop(area);
  if (shape == "bean") return Bean(area);
  if (shape == "half-disc") return HalfDisc(area);
  if (shape == "trapezoid") return Trapezoid(area);
  if (shape == "window") {
    return Blocks(
        {BoxLoop(0, 0, 7, 5), Reversed(BoxLoop(1, 1, 3, 4)), Reversed(BoxLoop(4, 1, 6, 4))}, area);
  }
  if (shape == "three-discs") return ThreeDiscs(area);
  std::abort();  // Our own tables hold no other name.
}

}  // namespace

std::span<const std::string_view> TuningShapes() { return kTuning; }
std::span<const std::string_view> ValidationShapes() { return kValidation; }

bool FitsLattice(std::string_view shape) {
  return std::find(kLatticeShapes.begin(), kLatticeShapes.end(), shape) != kLatticeShapes.end();
}

Outline MakeShape(std::string_view shape, double area, double straight_step) {
  return Densify(SparseShape(shape, area), straight_step);
}

std::vector<Point> EllipseLoop(Point center, double a, double b, double angle) {
  const Direction turn = DirectionOf(angle);
  const double steps = StepsFor(2 * kPi * std::max(a, b));
  Loop loop;
  for (double k = 0; k < steps; ++k) {
    const Direction d = DirectionOf(2 * kPi * k / steps);
    const Point p = {a * d.cosine, b * d.sine};
    loop.push_back({center.x + turn.cosine * p.x - turn.sine * p.y,
                    center.y + turn.sine * p.x + turn.cosine * p.y});
  }
  return loop;
}

}  // namespace partiemc::evaluation
