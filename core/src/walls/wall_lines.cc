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

void WallLines::Build(const std::vector<Wall>& walls, double cell_size) {
  edges_.clear();
  world_.clear();
  walls_.clear();
  for (const Wall& wall : walls) {
    const std::size_t count = wall.points.size() / 2;
    Lines& lines = walls_.emplace_back();
    lines.first = static_cast<std::uint32_t>(edges_.size());
    double area = 0;
    const Point origin = PointAt(wall.points, 0);
    for (std::size_t k = 0; k < (count == 2 ? 1 : count); ++k) {
      const Point a = PointAt(wall.points, k), b = PointAt(wall.points, k + 1 < count ? k + 1 : 0);
      WallEdge edge{.from = {a.x / cell_size, a.y / cell_size},
                    .to = {b.x / cell_size, b.y / cell_size}};
      const Point along = Minus(edge.to, edge.from);
      edge.length = std::sqrt(Dot(along, along));
      edge.unit = {along.x / edge.length, along.y / edge.length};
      edge.start = lines.perimeter;
      edge.wall = static_cast<std::uint32_t>(walls_.size() - 1);
      edge.is_endless = count == 2;
      lines.perimeter += edge.length;
      area += Cross(Minus(a, origin), Minus(b, origin));
      edges_.push_back(edge);
      world_.insert(world_.end(), {a, b});
    }
    lines.last = static_cast<std::uint32_t>(edges_.size());
    lines.is_tank = area > 0;
    if (count == 2) lines.perimeter = 0;
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

double WallLines::Between(std::size_t wall, double from, double to) const {
  const double perimeter = walls_[wall].perimeter;
  return perimeter > 0 ? std::remainder(to - from, perimeter) : to - from;
}

WallPlace WallLines::PlaceAt(std::size_t wall, double along) const {
  const Lines& lines = walls_[wall];
  if (lines.perimeter == 0) return {lines.first, along / edges_[lines.first].length};
  along -= std::floor(along / lines.perimeter) * lines.perimeter;
  const auto of = EdgesOf(wall);
  const auto after = std::ranges::upper_bound(of, along, {}, &WallEdge::start);
  const auto k = static_cast<std::uint32_t>(std::max<std::ptrdiff_t>(after - of.begin(), 1) - 1);
  return {lines.first + k, std::clamp((along - of[k].start) / of[k].length, 0.0, 1.0)};
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

NearestWall WallLines::NearestOfWall(std::size_t wall, const Point& point) const {
  Choice choice(*this);
  for (std::uint32_t edge = walls_[wall].first; edge < walls_[wall].last; ++edge) {
    choice.Consider(edge, point);
  }
  return choice.best();
}

bool WallLines::IsSolid(std::size_t wall, const Point& point) const {
  const auto of = EdgesOf(wall);
  if (of.front().is_endless) return Cross(of[0].unit, Minus(point, of[0].from)) <= 0;
  bool is_inside = false;
  for (const WallEdge& edge : of) {
    if ((edge.from.y <= point.y) == (edge.to.y <= point.y)) continue;
    const double share = (point.y - edge.from.y) / (edge.to.y - edge.from.y);
    const double x = edge.from.x + share * (edge.to.x - edge.from.x);
    if (point.x < x) is_inside = !is_inside;
  }
  return is_inside != walls_[wall].is_tank;
}

}  // namespace partiemc
