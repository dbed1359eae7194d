#include "space_vertices/loop_filters.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "base/parallel.h"

namespace partiemc::space {
namespace {

double Square(double value) { return value * value; }

double WindowWeight(const Vec3& to, double reach_square) {
  return Square(std::max(0.0, 1 - Dot(to, to) / reach_square));
}

/// max(0, cosine)^32.
double Agreement(double cosine) {
  double power = std::max(0.0, cosine);
  for (int k = 0; k < 5; ++k) power *= power;
  return power;
}

template <typename Body>
void ForEachLoop(const LoopSurface& surface, const Body& body) {
  ParallelFor(surface.windows.ChunkCount(), [&](std::size_t chunk) {
    const std::size_t first = chunk * LoopWindows::kLoopsAtOnce;
    const std::size_t last =
        std::min(first + LoopWindows::kLoopsAtOnce, surface.windows.loop_count);
    for (std::size_t loop = first; loop < last; ++loop) body(loop);
  });
}

}  // namespace

void SmoothNormals(const LoopSurface& surface, std::span<const Vec3> normals, double reach,
                   Stop stop, std::span<Vec3> smooth) {
  const double square = reach * reach;
  ForEachLoop(surface, [&](std::size_t i) {
    Vec3 sum;
    for (const std::uint32_t j : surface.windows.Of(i)) {
      double weight =
          surface.areas[j] * WindowWeight(surface.centres[j] - surface.centres[i], square);
      if (stop == Stop::kAtEdges) weight *= Agreement(Dot(normals[i], normals[j]));
      sum = sum + weight * normals[j];
    }
    const Vec3 normal = Normalised(sum);
    smooth[i] = normal == Vec3{} ? normals[i] : normal;
  });
}

void FindBends(const LoopSurface& surface, std::span<const Vec3> normals, double reach,
               double limit, std::span<double> bends) {
  const double square = reach * reach;
  ForEachLoop(surface, [&](std::size_t i) {
    double turn = 0, way = 0;
    for (const std::uint32_t j : surface.windows.Of(i)) {
      const Vec3 to = surface.centres[j] - surface.centres[i];
      const double weight = surface.areas[j] * WindowWeight(to, square);
      const Vec3 tangent = to - Dot(to, normals[i]) * normals[i];
      turn += weight * Dot(normals[j] - normals[i], tangent);
      way += weight * Dot(tangent, tangent);
    }
    bends[i] = way > 0 ? std::clamp(2 * turn / way, -limit, limit) : 0;
  });
}

void SmoothOnPlanes(const LoopSurface& surface, std::span<const Vec3> normals,
                    std::span<const double> bases, double reach, std::span<Vec3> smooth) {
  const double square = reach * reach;
  ForEachLoop(surface, [&](std::size_t i) {
    double height = 0, total = 0;
    for (const std::uint32_t j : surface.windows.Of(i)) {
      const Vec3 to = surface.centres[j] - surface.centres[i];
      const double weight =
          surface.areas[j] * WindowWeight(to, square) * Agreement(Dot(normals[i], normals[j]));
      height += weight * (.5 * Dot(normals[i] + normals[j], to) + bases[j]);
      total += weight;
    }
    const double by = total > 0 ? height / total : bases[i];
    smooth[i] = surface.centres[i] + by * normals[i];
  });
}

}  // namespace partiemc::space
