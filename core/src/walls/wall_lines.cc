#include "walls/wall_lines.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/point.h"

namespace partiemc {
namespace {

// Two lines whose distances differ by less than this, in cells, are equally near.
constexpr double kTie = 1e-9;
// Longer lines, in cells, get points at the window, and count as having this length.
constexpr double kLong = 1 << 20;

// The unit vector from a to b. Requires: a != b. First scales the difference to a size near 1,
// because its squares may overflow.
Point UnitFrom(const Point& a, const Point& b) {
  Point along = Minus(b, a);
  along = Times(along, 1 / std::max(std::abs(along.x), std::abs(along.y)));
  return Times(along, 1 / Length(along));
}

// Chooses the nearest of several lines.
class Choice {
 public:
  explicit Choice(const WallLines& lines) : lines_(lines) {}

  void Consider(std::uint32_t edge, const Point& point) {
    const NearestWall other = lines_.NearestOn(edge, point);
    const WallEdge& line = lines_.edges()[edge];
    const double slant = std::abs(Cross(line.unit, Minus(point, line.from)));
    const double distance = std::abs(other.height), best = std::abs(best_.height);
    if (distance > best + kTie || (distance > best - kTie && slant <= slant_)) return;
    best_ = other;
    slant_ = slant;
  }
  const NearestWall& best() const { return best_; }

 private:
  const WallLines& lines_;
  NearestWall best_;
  double slant_ = -1;  // Distance of the point from the endless line.
};

// The part of the line from a to b in a window, if it crosses the window. A point on a side has the
// coordinate of the side.
std::optional<std::pair<Point, Point>> PartIn(const WallLines::Window& window, const Point& a,
                                              const Point& b) {
  std::pair<Point, Point> part{a, b};
  const auto clip = [&](double Point::*axis, double Point::*other, double low, double high) {
    const auto cut = [&](Point& end, const Point& from, double at) {
      const double share = (at - from.*axis) / (end.*axis - from.*axis);
      end.*other = from.*other + share * (end.*other - from.*other);
      end.*axis = at;
    };
    auto& [first, second] = part;
    if (std::max(first.*axis, second.*axis) < low || std::min(first.*axis, second.*axis) > high) {
      return false;
    }
    for (const double at : {low, high}) {
      const auto is_out = [&](const Point& p) { return at == low ? p.*axis < at : p.*axis > at; };
      if (is_out(first)) cut(first, second, at);
      if (is_out(second)) cut(second, first, at);
    }
    return true;
  };
  if (!clip(&Point::x, &Point::y, window.low.x, window.high.x)) return std::nullopt;
  if (!clip(&Point::y, &Point::x, window.low.y, window.high.y)) return std::nullopt;
  return part;
}

}  // namespace

void WallLines::AddLine(const Point& a, const Point& b, double cell_size, Loop& loop,
                        bool is_precise) {
  WallEdge edge{.from = {a.x / cell_size, a.y / cell_size},
                .to = {b.x / cell_size, b.y / cell_size}};
  if (edge.from == edge.to) return;
  edge.unit = UnitFrom(edge.from, edge.to);
  edge.length = std::abs(Dot(edge.unit, Minus(edge.to, edge.from)));
  edge.start = loop.perimeter;
  edge.share_size = is_precise ? edge.length : std::min(edge.length, kLong);
  edge.loop = static_cast<std::uint32_t>(loops_.size());
  edge.solid = static_cast<std::uint32_t>(solids_.size() - 1);
  loop.perimeter += edge.share_size;
  edges_.push_back(edge);
  world_.insert(world_.end(), {a, b});
}

void WallLines::AddLines(const Point& a, const Point& b, double cell_size, const Window& window,
                         Loop& loop) {
  const double longest = std::max(std::abs(b.x - a.x), std::abs(b.y - a.y)) / cell_size;
  const Window world{Times(window.low, cell_size), Times(window.high, cell_size)};
  const auto part = longest > kLong ? PartIn(world, a, b) : std::nullopt;
  if (!part) return AddLine(a, b, cell_size, loop);
  AddLine(a, part->first, cell_size, loop);
  AddLine(part->first, part->second, cell_size, loop, /*is_precise=*/true);
  AddLine(part->second, b, cell_size, loop);
}

template <typename PointOf>
double WallLines::AddLoop(std::size_t count, double cell_size, const Window& window, PointOf at) {
  Loop loop{.first = static_cast<std::uint32_t>(edges_.size())};
  double area = 0;
  const Point origin = at(0);
  Point before = origin;
  for (std::size_t k = 1; k <= count; ++k) {
    const Point next = k < count ? at(k) : origin;
    area += Cross(Times(Minus(before, origin), 1 / cell_size),
                  Times(Minus(next, origin), 1 / cell_size));
    const bool is_one =
        before.x / cell_size == next.x / cell_size && before.y / cell_size == next.y / cell_size;
    if (is_one) continue;  // `before` stays, so that the lines join.
    AddLines(before, next, cell_size, window, loop);
    before = next;
  }
  loop.last = static_cast<std::uint32_t>(edges_.size());
  if (loop.last == loop.first) return area;
  loops_.push_back(loop);
  solids_.back().last = loop.last;
  return area;
}

void WallLines::AddEndless(const Point& a, const Point& b, double cell_size, const Window& window) {
  const Point unit = UnitFrom(a, b);
  const Point middle = Times(Plus(window.low, window.high), cell_size / 2);
  const Point from = Plus(a, Times(unit, Dot(Minus(middle, a), unit)));
  const auto first = static_cast<std::uint32_t>(edges_.size());
  edges_.push_back({.from = Times(from, 1 / cell_size),
                    .to = Plus(Times(from, 1 / cell_size), unit),
                    .unit = unit,
                    .length = 1,
                    .share_size = 1,
                    .loop = static_cast<std::uint32_t>(loops_.size()),
                    .solid = static_cast<std::uint32_t>(solids_.size() - 1),
                    .is_endless = true});
  world_.insert(world_.end(), {from, Times(unit, cell_size)});
  loops_.push_back({first, first + 1, 0});
  solids_.back().last = first + 1;
}

void WallLines::Build(const GivenWalls& walls, double cell_size, const Window& window) {
  edges_.clear();
  world_.clear();
  loops_.clear();
  solids_.clear();
  const auto begin_solid = [&](bool is_inside) {
    const auto first = static_cast<std::uint32_t>(edges_.size());
    solids_.push_back({first, first, is_inside});
  };
  const auto end_solid = [&] {
    if (solids_.back().first == solids_.back().last) solids_.pop_back();
  };
  for (const Wall& wall : walls.fixed) {
    const auto at = [&](std::size_t k) { return PointAt(wall.points, k); };
    begin_solid(false);
    if (wall.points.size() == 4) {
      AddEndless(at(0), at(1), cell_size, window);
      continue;
    }
    const double area = AddLoop(wall.points.size() / 2, cell_size, window, at);
    solids_.back().is_inside = walls.are_obstacles || area < 0;
    end_solid();
  }
  if (walls.of_particles == nullptr) return;
  begin_solid(true);
  for (std::size_t ring = 0; ring < walls.of_particles->RingCount(); ++ring) {
    // Rings have the solid on their left.
    const std::span<const double> points = walls.of_particles->RingPoints(ring);
    const std::size_t count = points.size() / 2;
    AddLoop(count, cell_size, window,
            [&](std::size_t k) { return PointAt(points, count - 1 - k); });
  }
  end_solid();
}

Point WallLines::At(const WallPlace& place) const {
  const WallEdge& edge = edges_[place.edge];
  return Plus(edge.from, Times(edge.Span(), place.share));
}

Point WallLines::InWorld(const WallPlace& place) const {
  const Point &a = world_[2 * place.edge], &b = world_[2 * place.edge + 1];
  if (edges_[place.edge].is_endless) return Plus(a, Times(b, place.share));
  if (place.share == 1) return b;
  return Plus(a, Times(Minus(b, a), place.share));
}

double WallLines::Between(std::size_t loop, double from, double to) const {
  const double perimeter = loops_[loop].perimeter;
  return perimeter > 0 ? std::remainder(to - from, perimeter) : to - from;
}

WallPlace WallLines::PlaceAt(std::size_t loop, double along) const {
  const auto [first, last, perimeter] = loops_[loop];
  if (perimeter == 0) return {first, along / edges_[first].share_size};
  along -= std::floor(along / perimeter) * perimeter;
  const auto of = EdgesOfLoop(loop);
  const auto after = std::ranges::upper_bound(of, along, {}, &WallEdge::start);
  const auto k = static_cast<std::uint32_t>(std::max<std::ptrdiff_t>(after - of.begin(), 1) - 1);
  return {first + k, std::clamp((along - of[k].start) / of[k].share_size, 0.0, 1.0)};
}

NearestWall WallLines::NearestOn(std::uint32_t edge, const Point& point) const {
  const WallEdge& line = edges_[edge];
  const Point from = Minus(point, line.from), to = Minus(point, line.to);
  const double ahead = Dot(line.unit, from);
  // From the nearer end, because the farther one is less precise.
  const double above = Cross(line.unit, std::abs(ahead) < line.length / 2 ? from : to);
  // Differences from both ends, because one may be too far away to be precise.
  const bool is_before = ahead < 0;
  const bool is_after = Dot(line.unit, to) > 0;
  if (line.is_endless || !(is_before || is_after)) {
    const double share = ahead / line.length;
    return {{edge, line.is_endless ? share : std::min(share, 1.0)}, above};
  }
  return {{edge, is_before ? 0.0 : 1.0}, std::copysign(Length(is_before ? from : to), above)};
}

NearestWall WallLines::Nearest(std::span<const std::uint32_t> edges, const Point& point) const {
  Choice choice(*this);
  for (const std::uint32_t edge : edges) choice.Consider(edge, point);
  return choice.best();
}

NearestWall WallLines::NearestAlong(const WallPlace& place, double reach,
                                    const Point& point) const {
  Choice choice(*this);
  const auto [first, last, perimeter] = loops_[edges_[place.edge].loop];
  const double along = Along(place);
  choice.Consider(place.edge, point);
  if (perimeter == 0) return choice.best();
  const std::uint32_t count = last - first;
  for (const bool forward : {true, false}) {
    for (std::uint32_t k = 1; k < count; ++k) {
      const std::uint32_t at = place.edge - first + (forward ? k : count - k);
      const WallEdge& edge = edges_[first + at % count];
      const double end = forward ? edge.start : edge.start + edge.share_size;
      const double length = forward ? end - along : along - end;
      if (length - std::floor(length / perimeter) * perimeter > reach) break;
      choice.Consider(first + at % count, point);
    }
  }
  return choice.best();
}

std::optional<Point> WallLines::AboveCorner(std::uint32_t floor, std::uint32_t side,
                                            double height) const {
  // The cosines of the turn in corners of 150 and of 30 degrees.
  constexpr double kFlat = .867, kSharp = -.867;
  constexpr double kJoint = .05;  // Lines may end this far before their crossing, in cells.
  const WallEdge &a = edges_[floor], &b = edges_[side];
  const double cosine = Dot(a.unit, b.unit), sine = Cross(a.unit, b.unit);
  if (cosine > kFlat || cosine < kSharp) return std::nullopt;
  const Point between = Minus(b.from, a.from);
  const double on_a = Cross(between, b.unit) / sine, on_b = Cross(between, a.unit) / sine;
  const auto ends_at = [](const WallEdge& edge, double at) {
    return edge.is_endless || (at > -kJoint && at < edge.length + kJoint);
  };
  if (!ends_at(a, on_a) || !ends_at(b, on_b)) return std::nullopt;
  // On the bisector: both heights of the crossing plus t (left_a + left_b) are t (1 + cosine).
  const Point crossing = Plus(a.from, Times(a.unit, on_a));
  return Plus(crossing, Times(Plus(a.Left(), b.Left()), height / (1 + cosine)));
}

bool WallLines::IsBehindEndless(std::size_t solid, const Point& point) const {
  const WallEdge& line = edges_[solids_[solid].first];
  return Cross(line.unit, Minus(point, line.from)) <= 0;
}

}  // namespace partiemc
