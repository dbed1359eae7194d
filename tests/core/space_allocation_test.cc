// Allocations of surfaces: a frame like one before must allocate nothing.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <tuple>
#include <vector>

#include "core/heap_counts.h"
#include "core/tracked_frames.h"
#include "partiemc/partiemc.h"
#include "partiemc/surface_reconstructor.h"
#include "support/random.h"

namespace partiemc {
namespace {

using support::allocations;
using support::TrackedFrames;

class WarmSurface : public testing::TestWithParam<std::tuple<SurfacePlacement, int, bool, Sizes>> {
};

TEST_P(WarmSurface, AllocatesNothing) {
  const auto placement = std::get<SurfacePlacement>(GetParam());
  const int threads = std::get<int>(GetParam());
  const bool is_tracked = std::get<bool>(GetParam());
  const auto sizes = std::get<Sizes>(GetParam());
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
  tbb::task_arena arena(threads);
  const auto reconstructor = SurfaceReconstructor::Create(
      {.placement = placement, .sizes = sizes, .clean = true, .min_component_particles = 2});
  ASSERT_TRUE(reconstructor.ok());
  // Balls that meet, with spray; then a few particles, then none.
  std::vector<std::vector<double>> frames;
  support::Random random(1);
  for (int k = 0; k < 3; ++k) {
    std::vector<double>& xyz = frames.emplace_back();
    for (int p = 0; p < 24 * 12 * 12; ++p) {
      const double x = p % 24 - 6, y = p / 24 % 12 - 6, z = p / 288 - 6;
      const double shifted = x - 9 - k;
      if (x * x + y * y + z * z > 25 && shifted * shifted + y * y + z * z > 20) continue;
      xyz.insert(xyz.end(), {x + random.Uniform(0, .2), y, z});
    }
    for (int p = 0; p < 90; ++p) xyz.push_back(random.Uniform(-20, 20));
  }
  frames.push_back({0, 0, 0, 1, 0, 0});
  frames.emplace_back();
  std::vector<std::vector<float>> volumes(frames.size());
  for (std::size_t k = 0; k < frames.size() && sizes == Sizes::kOwn; ++k) {
    for (std::size_t p = 0; p < frames[k].size() / 3; ++p) {
      volumes[k].push_back(p % 7 == 0 ? 8 : p % 5 == 0 ? .3f : 1);
    }
  }
  const TrackedFrames tracked(frames, volumes);
  SurfaceWorkspace workspace;
  Surface surface;
  SurfaceState state;
  std::size_t before = 0;
  for (int round = 0; round < 3; ++round) {
    before = allocations;
    for (std::size_t k = 0; k < frames.size(); ++k) {
      arena.execute([&] {
        const Frame frame = tracked.At(k, is_tracked);
        const absl::Status status =
            is_tracked ? reconstructor->Reconstruct(frame, state, workspace, surface)
                       : reconstructor->Reconstruct(frame, workspace, surface);
        ASSERT_TRUE(status.ok());
        ASSERT_EQ(surface.TriangleCount() > 0, !frames[k].empty());
      });
    }
    if (round == 0) {
      EXPECT_GT(allocations, before) << "nothing is counted";
    }
  }
  EXPECT_EQ(allocations - before, 0u) << "in " << frames.size() << " frames";
}

INSTANTIATE_TEST_SUITE_P(Placements, WarmSurface,
                         testing::Combine(testing::Values(SurfacePlacement::kMarchingCubes,
                                                          SurfacePlacement::kQef,
                                                          SurfacePlacement::kVirtualPlane),
                                          testing::Values(1, 2), testing::Bool(),
                                          testing::Values(Sizes::kEqual, Sizes::kOwn)));

// A layer that percolates, with a drop and lone particles; then without the layer, so that nothing
// is copied or cut unless the box wraps or has walls. Each frame has another box.
class WarmPeriodicSurface : public testing::TestWithParam<std::tuple<bool, Sizes, bool>> {};
INSTANTIATE_TEST_SUITE_P(WrapsAtWalls, WarmPeriodicSurface,
                         testing::Combine(testing::Bool(),
                                          testing::Values(Sizes::kEqual, Sizes::kOwn),
                                          testing::Bool()));

TEST_P(WarmPeriodicSurface, AllocatesNothing) {
  const auto [wraps, sizes, has_walls] = GetParam();
  SurfaceParameters parameters{
      .placement = SurfacePlacement::kVirtualPlane,
      .kernel_radius = 2,
      .sizes = sizes,
      .box = PeriodicBox{.axes = {PeriodicAxis{0, 16}, PeriodicAxis{0, 12.5}}, .wraps = wraps}};
  if (has_walls) parameters.wall_planes = {{.axis = 2, .position = .2}};
  const auto reconstructor = SurfaceReconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok());
  std::vector<std::vector<double>> frames;
  support::Random random(1);
  for (int k = 0; k < 4; ++k) {
    std::vector<double>& xyz = frames.emplace_back();
    for (int p = 0; p < 16 * 12 * (k < 3 ? 6 + k : 0); ++p) {
      xyz.insert(xyz.end(), {p % 16 + .2 * k, p / 16 % 12 + random.Uniform(0, .2), p / 192 + .5});
    }
    for (int p = 0; p < 64; ++p) {
      xyz.insert(xyz.end(), {p % 4 + 6. * k, p / 4 % 4 - 2., p / 16 + 17.});
    }
    // Lone particles at a wall become ellipsoids with points on the wall. The cut then moves, and
    // Validate, which allocates, checks the surface.
    for (int p = 0; p < 60; ++p) {
      xyz.push_back(random.Uniform(has_walls && p % 3 == 2 ? 4 : 0, 30));
    }
  }
  std::vector<std::vector<float>> volumes(frames.size());
  for (std::size_t k = 0; k < frames.size() && sizes == Sizes::kOwn; ++k) {
    for (std::size_t p = 0; p < frames[k].size() / 3; ++p) {
      volumes[k].push_back(p % 7 == 0 ? 2 : p % 5 == 0 ? .3f : 1);
    }
  }
  const TrackedFrames tracked(frames, volumes);
  SurfaceWorkspace workspace;
  Surface surface;
  SurfaceState state;
  std::size_t before = 0;
  for (int round = 0; round < 4; ++round) {
    before = allocations;
    for (std::size_t k = 0; k < frames.size(); ++k) {
      Frame frame = tracked.At(k);
      frame.box = PeriodicBox{.axes = {PeriodicAxis{0, 16}, PeriodicAxis{.1 * k, 12.5 + .1 * k}}};
      const absl::Status status = reconstructor->Reconstruct(frame, state, workspace, surface);
      ASSERT_TRUE(status.ok()) << status;
      if (!has_walls) {
        ASSERT_EQ(surface.cuts.empty(), k == 3 && !wraps);
      }
    }
  }
  EXPECT_EQ(allocations - before, 0u);
}

}  // namespace
}  // namespace partiemc
