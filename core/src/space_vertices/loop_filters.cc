#include "space_vertices/loop_filters.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "base/parallel.h"
#include "space_vertices/window_sums.h"

namespace partiemc::space {
namespace {

/// Copies the loops near a chunk, and fills the last vector with loops without an area. If `bases`
/// is empty, `loops.base` is not set.
void LoadNear(const LoopSurface& surface, std::span<const Vec3> normals,
              std::span<const double> bases, const std::vector<std::uint32_t>& near,
              NearLoops& loops) {
  const auto as_float = [](double value) { return static_cast<float>(value); };
  const Vec3 origin = surface.centres[near[0]];
  for (std::size_t k = 0; k < near.size(); ++k) {
    const Vec3 centre = surface.centres[near[k]] - origin;
    const Vec3& normal = normals[near[k]];
    loops.x[k] = as_float(centre.x), loops.y[k] = as_float(centre.y),
    loops.z[k] = as_float(centre.z);
    loops.area[k] = as_float(surface.areas[near[k]]);
    loops.normal_x[k] = as_float(normal.x), loops.normal_y[k] = as_float(normal.y);
    loops.normal_z[k] = as_float(normal.z);
    if (!bases.empty()) loops.base[k] = as_float(bases[near[k]]);
  }
  for (std::size_t k = near.size(); k % 8 != 0; ++k) {
    loops.x[k] = loops.y[k] = loops.z[k] = loops.area[k] = loops.base[k] = 0;
    loops.normal_x[k] = loops.normal_y[k] = loops.normal_z[k] = 0;
  }
}

/// Calls body(loop, near loops, window) for each loop, in parallel over chunks.
template <typename Body>
void ForEachWindow(const LoopSurface& surface, std::span<const Vec3> normals,
                   std::span<const double> bases, double reach, const Body& body) {
  ParallelFor(surface.windows.chunk_count, [&](std::size_t index) {
    const LoopWindows::Chunk& chunk = surface.windows.chunks[index];
    NearLoops loops;
    LoadNear(surface, normals, bases, chunk.near, loops);
    for (std::uint32_t loop = chunk.begin; loop < chunk.end; ++loop) {
      const double own = reach * surface.SizeOf(loop);
      const auto inverse_square = static_cast<float>(1 / (own * own));
      body(loop, loops, Window{chunk.Of(loop), chunk.self[loop - chunk.begin], inverse_square});
    }
  });
}

}  // namespace

void SmoothNormals(const LoopSurface& surface, std::span<const Vec3> normals, double reach,
                   Stop stop, std::span<Vec3> smooth) {
  ForEachWindow(surface, normals, {}, reach,
                [&](std::size_t i, const NearLoops& loops, const Window& window) {
                  const Vec3 normal = Normalised(SumNormals(loops, window, stop == Stop::kAtEdges));
                  smooth[i] = normal == Vec3{} ? normals[i] : normal;
                });
}

void FindBends(const LoopSurface& surface, std::span<const Vec3> normals, double reach,
               double limit, std::span<double> bends) {
  ForEachWindow(surface, normals, {}, reach,
                [&](std::size_t i, const NearLoops& loops, const Window& window) {
                  const auto [turn, way] = SumBends(loops, window);
                  const double most = limit / surface.SizeOf(i);
                  bends[i] = way > 0 ? std::clamp(2 * turn / way, -most, most) : 0;
                });
}

void SmoothOnPlanes(const LoopSurface& surface, std::span<const Vec3> normals,
                    std::span<const double> bases, double reach, std::span<Vec3> smooth) {
  ForEachWindow(surface, normals, bases, reach,
                [&](std::size_t i, const NearLoops& loops, const Window& window) {
                  const auto [height, total] = SumPlanes(loops, window);
                  const double by = total > 0 ? height / total : bases[i];
                  smooth[i] = surface.centres[i] + by * normals[i];
                });
}

}  // namespace partiemc::space
