#include "walls/wall_lines.h"

#include <algorithm>
#include <cmath>

namespace partiemc {
namespace {

// Two lines whose distances differ by less than this, in cells, are equally near.
constexpr double kTie = 1e-9;

double Cross(const Point& a, const Point& b) { return a.x * b.y - a.y * b.x; }
double Dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y; }
Point Minus(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y}; }

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

}  // namespace

template <typename PointOf>
double WallLines::AddLoop(std::size_t count, double cell_size, PointOf at) {
  Loop loop{.first = static_cast<std::uint32_t>(edges_.size())};
  double area = 0;
  const Point origin = at(0);
  for (std::size_t k = 0; k < (count == 2 ? 1 : count); ++k) {
    const Point a = at(k), b = at(k + 1 < count ? k + 1 : 0);
    WallEdge edge{.from = {a.x / cell_size, a.y / cell_size},
                  .to = {b.x / cell_size, b.y / cell_size}};
    const Point along = Minus(edge.to, edge.from);
    edge.length = std::sqrt(Dot(along, along));
    edge.unit = {along.x / edge.length, along.y / edge.length};
    edge.start = loop.perimeter;
    edge.loop = static_cast<std::uint32_t>(loops_.size());
    edge.solid = static_cast<std::uint32_t>(solids_.size() - 1);
    edge.is_endless = count == 2;
    loop.perimeter += edge.length;
    area += Cross(Minus(a, origin), Minus(b, origin));
    edges_.push_back(edge);
    world_.insert(world_.end(), {a, b});
  }
  loop.last = static_cast<std::uint32_t>(edges_.size());
  if (count == 2) loop.perimeter = 0;
  loops_.push_back(loop);
  solids_.back().last = loop.last;
  return area;
}

void WallLines::Build(const std::vector<Wall>& walls, const Rings* particle_walls,
                      double cell_size) {
  edges_.clear();
  world_.clear();
  loops_.clear();
  solids_.clear();
  for (const Wall& wall : walls) {
    solids_.push_back({.first = static_cast<std::uint32_t>(edges_.size())});
    const double area = AddLoop(wall.points.size() / 2, cell_size,
                                [&](std::size_t k) { return PointAt(wall.points, k); });
    solids_.back().is_inside = area < 0;
  }
  if (particle_walls == nullptr || particle_walls->RingCount() == 0) return;
  solids_.push_back({.first = static_cast<std::uint32_t>(edges_.size()), .is_inside = true});
  for (std::size_t ring = 0; ring < particle_walls->RingCount(); ++ring) {
    // Rings have the solid on their left.
    const std::span<const double> points = particle_walls->RingPoints(ring);
    const std::size_t count = points.size() / 2;
    AddLoop(count, cell_size, [&](std::size_t k) { return PointAt(points, count - 1 - k); });
  }
}

Point WallLines::At(const WallPlace& place) const {
  const WallEdge& edge = edges_[place.edge];
  return {edge.from.x + place.share * (edge.to.x - edge.from.x),
          edge.from.y + place.share * (edge.to.y - edge.from.y)};
}

Point WallLines::InWorld(const WallPlace& place) const {
  const Point &a = world_[2 * place.edge], &b = world_[2 * place.edge + 1];
  if (place.share == 1) return b;
  return {a.x + place.share * (b.x - a.x), a.y + place.share * (b.y - a.y)};
}

double WallLines::Between(std::size_t loop, double from, double to) const {
  const double perimeter = loops_[loop].perimeter;
  return perimeter > 0 ? std::remainder(to - from, perimeter) : to - from;
}

WallPlace WallLines::PlaceAt(std::size_t loop, double along) const {
  const auto [first, last, perimeter] = loops_[loop];
  if (perimeter == 0) return {first, along / edges_[first].length};
  along -= std::floor(along / perimeter) * perimeter;
  const auto of = EdgesOfLoop(loop);
  const auto after = std::ranges::upper_bound(of, along, {}, &WallEdge::start);
  const auto k = static_cast<std::uint32_t>(std::max<std::ptrdiff_t>(after - of.begin(), 1) - 1);
  return {first + k, std::clamp((along - of[k].start) / of[k].length, 0.0, 1.0)};
}

NearestWall WallLines::NearestOn(std::uint32_t edge, const Point& point) const {
  const WallEdge& line = edges_[edge];
  const Point to = Minus(point, line.from);
  const double above = Cross(line.unit, to);
  double share = Dot(line.unit, to) / line.length;
  if (line.is_endless || (share >= 0 && share <= 1)) return {{edge, share}, above};
  share = share < 0 ? 0 : 1;
  const Point from_end = Minus(point, share == 0 ? line.from : line.to);
  return {{edge, share}, std::copysign(std::sqrt(Dot(from_end, from_end)), above)};
}

NearestWall WallLines::Nearest(std::span<const std::uint32_t> edges, const Point& point) const {
  Choice choice(*this);
  for (const std::uint32_t edge : edges) choice.Consider(edge, point);
  return choice.best();
}

NearestWall WallLines::Nearest(std::span<const std::uint32_t> edges, const Point& point,
                               std::size_t solid) const {
  Choice choice(*this);
  for (const std::uint32_t edge : edges) {
    if (edges_[edge].solid == solid) choice.Consider(edge, point);
  }
  return choice.best();
}

NearestWall WallLines::NearestOfLoop(std::size_t loop, const Point& point) const {
  Choice choice(*this);
  for (std::uint32_t edge = loops_[loop].first; edge < loops_[loop].last; ++edge) {
    choice.Consider(edge, point);
  }
  return choice.best();
}

bool WallLines::IsSolid(std::size_t solid, const Point& point) const {
  const auto of = EdgesOfSolid(solid);
  if (of.front().is_endless) return Cross(of[0].unit, Minus(point, of[0].from)) <= 0;
  bool is_inside = false;
  for (const WallEdge& edge : of) {
    if ((edge.from.y <= point.y) == (edge.to.y <= point.y)) continue;
    const double share = (point.y - edge.from.y) / (edge.to.y - edge.from.y);
    const double x = edge.from.x + share * (edge.to.x - edge.from.x);
    if (point.x < x) is_inside = !is_inside;
  }
  return is_inside == solids_[solid].is_inside;
}

}  // namespace partiemc
