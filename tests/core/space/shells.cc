#include "space/shells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace partiemc::support {

Shell BoxShell(const Vec3& low, const Vec3& high) {
  Shell shell;
  for (int k = 0; k < 8; ++k) {
    shell.points.push_back(
        {k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z});
  }
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kSides = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& side : kSides) {
    for (const std::uint32_t k : {0, 1, 2, 0, 2, 3}) shell.triangles.push_back(side[k]);
  }
  return shell;
}

Shell BallShell(const Vec3& centre, double radius, int rounds) {
  const double golden = (1 + std::sqrt(5.0)) / 2;
  Shell shell;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-golden, golden}) {
      shell.points.push_back({0, a, b});
      shell.points.push_back({a, b, 0});
      shell.points.push_back({b, 0, a});
    }
  }
  // The faces of the icosahedron: corners at a distance of 2 from each other.
  for (std::uint32_t i = 0; i < 12; ++i) {
    for (std::uint32_t j = 0; j < 12; ++j) {
      for (std::uint32_t k = 0; k < 12; ++k) {
        const Vec3 &a = shell.points[i], &b = shell.points[j], &c = shell.points[k];
        const bool is_face = std::abs(Length(a - b) - 2) < .1 && std::abs(Length(b - c) - 2) < .1 &&
                             std::abs(Length(c - a) - 2) < .1;
        if (is_face && i < j && i < k && Dot(a, Cross(b, c)) > 0) {
          shell.triangles.insert(shell.triangles.end(), {i, j, k});
        }
      }
    }
  }
  for (int round = 0; round < rounds; ++round) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [found, is_new] =
          middles.emplace(std::minmax(a, b), static_cast<std::uint32_t>(shell.points.size()));
      if (is_new) shell.points.push_back(.5 * (shell.points[a] + shell.points[b]));
      return found->second;
    };
    std::vector<std::uint32_t> finer;
    for (std::size_t t = 0; t < shell.triangles.size(); t += 3) {
      const std::uint32_t a = shell.triangles[t], b = shell.triangles[t + 1],
                          c = shell.triangles[t + 2];
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca});
    }
    shell.triangles = finer;
  }
  for (Vec3& point : shell.points) point = centre + radius * Normalised(point);
  return shell;
}

Shell InsideOut(Shell shell) {
  for (std::size_t t = 0; t < shell.triangles.size(); t += 3) {
    std::swap(shell.triangles[t], shell.triangles[t + 1]);
  }
  return shell;
}

void AddShell(const Shell& shell, std::uint32_t outer, Surface& surface) {
  const auto first = static_cast<std::uint32_t>(surface.PointCount());
  for (const Vec3& point : shell.points) {
    surface.points.insert(surface.points.end(), {point.x, point.y, point.z});
    surface.normals.insert(surface.normals.end(), {0, 0, 1});
  }
  for (const std::uint32_t point : shell.triangles) surface.triangles.push_back(first + point);
  surface.point_offsets.push_back(static_cast<std::uint32_t>(surface.PointCount()));
  surface.triangle_offsets.push_back(static_cast<std::uint32_t>(surface.TriangleCount()));
  surface.outer_of.push_back(outer);
  Measure(surface);
}

void Measure(Surface& surface) {
  surface.measures.assign(surface.ShellCount(), {});
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    ShellMeasures& of = surface.measures[shell];
    Vec3 moment;
    const Vec3 origin = Vec3At(surface.points, surface.point_offsets[shell]);
    for (std::size_t t = surface.triangle_offsets[shell]; t < surface.triangle_offsets[shell + 1];
         ++t) {
      const Vec3 a = Vec3At(surface.points, surface.triangles[3 * t]) - origin;
      const Vec3 b = Vec3At(surface.points, surface.triangles[3 * t + 1]) - origin;
      const Vec3 c = Vec3At(surface.points, surface.triangles[3 * t + 2]) - origin;
      const double part = Dot(a, Cross(b, c)) / 6;
      of.area += Length(Cross(b - a, c - a)) / 2;
      of.volume += part;
      moment = moment + (part / 4) * (a + b + c);
    }
    of.centroid_x = origin.x + moment.x / of.volume;
    of.centroid_y = origin.y + moment.y / of.volume;
    of.centroid_z = origin.z + moment.z / of.volume;
  }
}

}  // namespace partiemc::support
