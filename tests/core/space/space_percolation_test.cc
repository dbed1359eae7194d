// Bodies that reach their own image in a periodic box: surfaces are cut at its faces.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/vec3.h"
#include "partiemc/arena.h"
#include "partiemc/partiemc.h"
#include "space/surface_stream.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Known;
using support::Random;
using testing::SpaceParticles;
using testing::SurfaceStream;
using testing::TrackedParticles;

PeriodicBox BoxOf(double x, double y, double z, const Vec3& origin = {}) {
  PeriodicBox box;
  const std::array<double, 3> lengths{x, y, z}, origins{origin.x, origin.y, origin.z};
  for (std::size_t k = 0; k < 3; ++k) {
    if (lengths[k] > 0) box.axes[k] = PeriodicAxis{origins[k], lengths[k]};
  }
  return box;
}

template <typename Particles>
Particles Wrapped(Particles particles, const PeriodicBox& box) {
  for (std::size_t k = 0; k < particles.xyz.size(); ++k) {
    double& at = particles.xyz[k];
    const auto& axis = box.axes[k % 3];
    if (axis) at -= axis->length * std::floor((at - axis->origin) / axis->length);
  }
  return particles;
}

double Coordinate(const Surface& surface, std::size_t point, std::size_t axis) {
  return surface.points[3 * point + axis];
}

Surface SurfaceOf(const SpaceParticles& particles, const SurfaceParameters& parameters) {
  SurfaceWorkspace workspace;
  Surface surface;
  const auto reconstructor = SurfaceReconstructor::Create(parameters);
  EXPECT_TRUE(reconstructor.ok()) << reconstructor.status();
  if (!reconstructor.ok()) return surface;
  const absl::Status status = reconstructor->Reconstruct(particles.AsFrame(), workspace, surface);
  EXPECT_TRUE(status.ok()) << status;
  const absl::Status valid = Validate(surface);
  EXPECT_TRUE(valid.ok()) << valid;
  return surface;
}

Surface InBox(const SpaceParticles& particles, const PeriodicBox& box) {
  return SurfaceOf(particles, {.placement = SurfacePlacement::kVirtualPlane, .box = box});
}

struct Sums {
  double area = 0, volume = 0;
  std::uint64_t particles = 0;
};

Sums SumsOf(const Surface& surface) {
  Sums sums;
  for (const ShellMeasures& measures : surface.measures) {
    sums.area += measures.area;
    sums.volume += measures.volume;
    sums.particles += measures.particles;
  }
  return sums;
}

/// The particles of a lattice with one particle in the middle of each cube, where keep(point).
template <typename Keep>
SpaceParticles Filled(int x, int y, int z, double shake, Random& random, Keep keep) {
  SpaceParticles particles;
  for (int k = 0; k < z; ++k) {
    for (int j = 0; j < y; ++j) {
      for (int i = 0; i < x; ++i) {
        const Vec3 at{i + .5, j + .5, k + .5};
        if (!keep(at)) continue;
        const double a = random.Uniform(-shake, shake), b = random.Uniform(-shake, shake);
        particles.Add(at + Vec3{a, b, random.Uniform(-shake, shake)});
      }
    }
  }
  return particles;
}

/// Largest distance of a point of the outline on one face from the outline on the opposite face,
/// along the axes of the face. Only points of cut triangles with a neighbour off the face count:
/// the points at which the face cuts the free surface.
struct FaceOutlines {
  std::array<std::vector<std::array<double, 2>>, 2> points;
};

FaceOutlines OutlinesOn(const Surface& surface, const PeriodicBox& box, std::size_t axis) {
  std::vector<std::uint8_t> on_free(surface.PointCount());
  std::size_t cut = 0;
  for (std::size_t t = 0; t < surface.TriangleCount(); ++t) {
    if (cut < surface.cuts.size() && surface.cuts[cut] == t) {
      ++cut;
      continue;
    }
    for (int k = 0; k < 3; ++k) on_free[surface.triangles[3 * t + k]] = 1;
  }
  FaceOutlines outlines;
  for (std::size_t p = 0; p < surface.PointCount(); ++p) {
    if (on_free[p] == 0) continue;
    for (std::size_t side = 0; side < 2; ++side) {
      const double face = box.axes[axis]->origin + side * box.axes[axis]->length;
      if (std::abs(Coordinate(surface, p, axis) - face) > 1e-4) continue;
      outlines.points[side].push_back({Coordinate(surface, p, (axis + 1) % 3),
                                       Coordinate(surface, p, (axis + 2) % 3)});
    }
  }
  return outlines;
}

double Mismatch(const FaceOutlines& outlines) {
  double worst = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    for (const auto& a : outlines.points[side]) {
      double nearest = 1e300;
      for (const auto& b : outlines.points[1 - side]) {
        nearest = std::min(nearest, std::hypot(a[0] - b[0], a[1] - b[1]));
      }
      worst = std::max(worst, nearest);
    }
  }
  return worst;
}

TEST(SurfacePercolation, FlatLayerIsCutAtFourFaces) {
  Random random(1);
  const PeriodicBox box = BoxOf(30, 24, 60);
  const SpaceParticles layer =
      Filled(30, 24, 30, 0, random, [](const Vec3& at) { return at.z > 20; });
  const Surface surface = InBox(layer, box);
  ASSERT_EQ(surface.ShellCount(), 1u);
  const Sums sums = SumsOf(surface);
  std::printf("volume %.6f, area %.6f, outlines %.2e %.2e, cuts %zu\n",
              sums.volume / static_cast<double>(layer.size()), sums.area / (2 * 30 * 24),
              Mismatch(OutlinesOn(surface, box, 0)), Mismatch(OutlinesOn(surface, box, 1)),
              surface.cuts.size());
}

TEST(SurfacePercolation, WavyLayer) {
  Random random(1);
  const PeriodicBox box = BoxOf(40, 24, 0);
  const SpaceParticles layer =
      Filled(40, 24, 30, .2, random, [](const Vec3& at) { return at.z < 14 + 4*std::sin(2*M_PI*(at.x+7)/40); });
  const Surface surface = InBox(layer, box);
  const Sums sums = SumsOf(surface);
  std::printf("shells %zu volume %.6f, area %.6f, outlines %.2e %.2e, cuts %zu\n", surface.ShellCount(),
              sums.volume / static_cast<double>(layer.size()), sums.area / (2 * 40 * 24),
              Mismatch(OutlinesOn(surface, box, 0)), Mismatch(OutlinesOn(surface, box, 1)),
              surface.cuts.size());
}

TEST(SurfacePercolation, FullBoxWithCavity) {
  Random random(1);
  const PeriodicBox box = BoxOf(30, 30, 30);
  for (const double x : {15., 0.}) {
  const SpaceParticles layer =
      Filled(30, 30, 30, .1, random, [&](const Vec3& at) { return std::hypot(std::remainder(at.x-x,30), at.y-15, at.z-15) > 7; });
  const Surface surface = InBox(layer, box);
  const Sums sums = SumsOf(surface);
  std::printf("shells %zu volume %.6f, area %.6f, outlines %.2e %.2e, cuts %zu\n", surface.ShellCount(),
              sums.volume / static_cast<double>(layer.size()), sums.area / (4 * M_PI * 49),
              Mismatch(OutlinesOn(surface, box, 0)), Mismatch(OutlinesOn(surface, box, 1)),
              surface.cuts.size());
  }
}

}  // namespace
}  // namespace partiemc
