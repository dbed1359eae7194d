#include "support/wall_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace partiemc::support {

Wall PolygonWall(double x, double y, double radius, int count, double turn, bool is_tank) {
  Wall wall;
  for (int k = 0; k < count; ++k) {
    const double angle = turn + (is_tank ? 2 : -2) * std::numbers::pi * k / count;
    wall.points.push_back(x + radius * std::cos(angle));
    wall.points.push_back(y + radius * std::sin(angle));
  }
  return wall;
}

std::vector<Wall> RandomWalls(Random& random, const Particles& particles) {
  double left = 0, right = 1, low = 0, high = 1;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    left = k == 0 ? particles.x(k) : std::min(left, particles.x(k));
    right = k == 0 ? particles.x(k) : std::max(right, particles.x(k));
    low = k == 0 ? particles.y(k) : std::min(low, particles.y(k));
    high = k == 0 ? particles.y(k) : std::max(high, particles.y(k));
  }
  const double extent = std::clamp(std::max(right - left, high - low), 4.0, 80.0);
  std::vector<Wall> walls;
  const std::size_t count = 1 + random.Below(3);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t near = random.Below(std::max<std::size_t>(particles.size(), 1));
    const double x = particles.size() > 0 ? particles.x(near) : 0;
    const double y = particles.size() > 0 ? particles.y(near) : 0;
    const double angle = random.Uniform(0, 2 * std::numbers::pi);
    const double turn = random.Chance(.3) ? 0 : angle;
    const int corners = static_cast<int>(3 + random.Below(58));
    if (random.Chance(.4)) {
      const double along = random.Uniform(.01, 10);
      walls.push_back({{x, y, x + along * std::cos(turn), y + along * std::sin(turn)}});
    } else if (random.Chance(.5)) {
      walls.push_back(PolygonWall(x, y, random.Uniform(.3, .8) * extent, corners, turn, true));
    } else {
      walls.push_back(PolygonWall(x, y, random.Uniform(.02, .4) * extent, corners, turn, false));
    }
  }
  return walls;
}

double HeightAbove(const Wall& wall, double x, double y) {
  const std::size_t count = wall.points.size() / 2;
  const auto at = [&](std::size_t k) { return &wall.points[2 * (k % count)]; };
  if (count == 2) {
    const double dx = at(1)[0] - at(0)[0], dy = at(1)[1] - at(0)[1];
    return (dx * (y - at(0)[1]) - dy * (x - at(0)[0])) / std::hypot(dx, dy);
  }
  double distance = 1e300, winding = 0, area = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double ax = at(k)[0] - x, ay = at(k)[1] - y;
    const double bx = at(k + 1)[0] - x, by = at(k + 1)[1] - y;
    const double dx = bx - ax, dy = by - ay;
    const double share = std::clamp(-(ax * dx + ay * dy) / (dx * dx + dy * dy), 0.0, 1.0);
    distance = std::min(distance, std::hypot(ax + share * dx, ay + share * dy));
    winding += std::atan2(ax * by - ay * bx, ax * bx + ay * by);
    area += ax * by - ay * bx;
  }
  const bool is_inside = std::abs(winding) > std::numbers::pi;
  return is_inside == (area > 0) ? distance : -distance;
}

}  // namespace partiemc::support
