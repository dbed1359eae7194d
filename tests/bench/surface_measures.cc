#include <benchmark/benchmark.h>
#include <oneapi/tbb/task_arena.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "bench/measures.h"
#include "bench/require.h"
#include "partiemc/surface_reconstructor.h"
#include "support/random.h"

namespace partiemc::bench {
namespace {

// Particles in space with spacing 1: nodes of a lattice, each moved by at most .1 along each axis.
class ParticlesInSpace {
 public:
  void AddBall(double radius, double x, double y, double z) {
    AddBox(static_cast<int>(radius) + 1, static_cast<int>(radius) + 1, x, y, z,
           [&](int i, int j, int k) { return i * i + j * j + k * k < radius * radius; });
  }
  void AddSheet(int half_side) {
    AddBox(half_side, 2, 0, 0, 0, [](int, int, int k) { return k < 2; });
  }
  std::span<const double> positions() const { return positions_; }

 private:
  template <typename Inside>
  void AddBox(int half_side, int half_height, double x, double y, double z, Inside is_inside) {
    for (int i = -half_side; i <= half_side; ++i) {
      for (int j = -half_side; j <= half_side; ++j) {
        for (int k = -half_height; k <= half_height; ++k) {
          if (!is_inside(i, j, k)) continue;
          for (const double at : {x + i, y + j, z + k}) {
            positions_.push_back(at + random_.Uniform(-.1, .1));
          }
        }
      }
    }
  }

  support::Random random_{77};
  std::vector<double> positions_;
};

ParticlesInSpace Ball(double count) {
  ParticlesInSpace ball;
  ball.AddBall(std::cbrt(.75 * count / std::numbers::pi), 0, 0, 0);
  return ball;
}

// Four layers of particles.
ParticlesInSpace Sheet(double count) {
  ParticlesInSpace sheet;
  sheet.AddSheet(static_cast<int>(std::sqrt(count / 4) / 2));
  return sheet;
}

// Balls of 93 particles, 12 spacings apart.
ParticlesInSpace Drops(int along) {
  ParticlesInSpace drops;
  support::Random random(7);
  for (int i = 0; i < along; ++i) {
    for (int j = 0; j < along; ++j) {
      for (int k = 0; k < along; ++k) {
        drops.AddBall(2.9, 12 * i + random.Uniform(-.3, .3), 12 * j + random.Uniform(-.3, .3),
                      12 * k + random.Uniform(-.3, .3));
      }
    }
  }
  return drops;
}

void RegisterSurface(const std::string& scene, ParticlesInSpace particles) {
  const auto shared = std::make_shared<const ParticlesInSpace>(std::move(particles));
  for (const SurfacePlacement placement :
       {SurfacePlacement::kMarchingCubes, SurfacePlacement::kVirtualPlane}) {
    const char* const name =
        placement == SurfacePlacement::kMarchingCubes ? "marching_cubes" : "virtual_plane";
    for (const int threads : {1, 2}) {
      Register(absl::StrCat("surface/", scene, "/", name, "/", threads), 1,
               [shared, placement, threads](benchmark::State& state) {
                 tbb::task_arena arena(threads);
                 const auto reconstructor =
                     Require(SurfaceReconstructor::Create({.placement = placement, .spacing = 1}));
                 SurfaceWorkspace workspace;
                 Surface surface;
                 const auto reconstruct = [&] {
                   arena.execute([&] {
                     Require(reconstructor.Reconstruct(
                         {.positions = shared->positions(), .components = 3}, workspace, surface));
                   });
                 };
                 reconstruct();  // Warms up the workspace.
                 for (auto _ : state) reconstruct();
                 state.counters["triangles"] = static_cast<double>(surface.TriangleCount());
               });
    }
  }
}

}  // namespace

void RegisterSurfaces() {
  RegisterSurface("ball_100k", Ball(1e5));
  RegisterSurface("ball_1m", Ball(1e6));
  RegisterSurface("sheet_100k", Sheet(1e5));
  RegisterSurface("drops_93k", Drops(10));
}

}  // namespace partiemc::bench
