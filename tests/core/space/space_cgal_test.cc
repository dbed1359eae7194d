// Surfaces judged by CGAL, which shares no code with their construction and with Validate. Built
// with -DPARTIEMC_CGAL=ON.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vec3.h"
#include "partiemc/surface_reconstructor.h"
#include "simplify/mesh_faults.h"
#include "space/space_particles.h"
#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh3 = CGAL::Surface_mesh<Kernel::Point_3>;
using support::Random;

struct Soup {
  std::vector<Kernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};

Soup SoupOf(const Surface& surface) {
  Soup soup;
  for (std::size_t k = 0; k < surface.PointCount(); ++k) {
    const Vec3 at = Vec3At(surface.points, static_cast<std::uint32_t>(k));
    soup.points.emplace_back(at.x, at.y, at.z);
  }
  for (std::size_t t = 0; t < surface.TriangleCount(); ++t) {
    const std::uint32_t* corners = surface.triangles.data() + 3 * t;
    soup.triangles.push_back({corners[0], corners[1], corners[2]});
  }
  return soup;
}

// The mesh of a surface, whose points have the same indices.
Mesh3 MeshOf(const Surface& surface) {
  const Soup soup = SoupOf(surface);
  Mesh3 mesh;
  pmp::polygon_soup_to_polygon_mesh(soup.points, soup.triangles, mesh);
  return mesh;
}

bool Intersects(const Surface& surface) { return pmp::does_self_intersect(MeshOf(surface)); }

bool HasContacts(const Surface& surface) {
  const std::vector<std::uint8_t> all(surface.TriangleCount(), 1);
  std::vector<simplify::Contact> contacts;
  TriangleGrid grid;
  simplify::FindContacts(surface.points, surface.triangles, all, grid, contacts);
  return !contacts.empty();
}

Surface SurfaceOf(std::uint64_t seed, const SurfaceParameters& parameters) {
  static auto* const workspace = new SurfaceWorkspace;
  Surface surface;
  const support::SpaceParticles particles = support::RandomSpaceScene(seed);
  const absl::Status status = SurfaceReconstructor::Create(parameters)
                                  ->Reconstruct(particles.AsFrame(), *workspace, surface);
  EXPECT_TRUE(status.ok()) << status;
  return surface;
}

class SurfacesByCgal : public ::testing::TestWithParam<SurfaceParameters> {};

TEST_P(SurfacesByCgal, AreClosedManifoldAndDoNotIntersect) {
  for (std::uint64_t seed = 0; seed < support::Tries(40u); ++seed) {
    const Surface surface = SurfaceOf(seed, GetParam());
    const Soup soup = SoupOf(surface);
    ASSERT_TRUE(pmp::is_polygon_soup_a_polygon_mesh(soup.triangles)) << "seed " << seed;
    const Mesh3 mesh = MeshOf(surface);
    ASSERT_TRUE(CGAL::is_closed(mesh)) << "seed " << seed;
    ASSERT_EQ(mesh.number_of_vertices(), surface.PointCount()) << "seed " << seed;
    ASSERT_FALSE(pmp::does_self_intersect(mesh)) << "seed " << seed;
  }
}

// One point of each surface moves, so that some surfaces intersect themselves.
TEST_P(SurfacesByCgal, HaveTheVerdictOfTheChecks) {
  int broken = 0;
  const auto frames = support::Tries(40u);
  for (std::uint64_t seed = 0; seed < frames; ++seed) {
    Surface surface = SurfaceOf(seed, GetParam());
    if (surface.PointCount() == 0) continue;
    Random random(seed);
    const std::size_t moved = random.Below(surface.PointCount());
    for (std::size_t k = 3 * moved; k < 3 * moved + 3; ++k) {
      surface.points[k] += random.Uniform(-2, 2);
    }
    const bool intersects = Intersects(surface);
    EXPECT_EQ(HasContacts(surface), intersects) << "seed " << seed;
    broken += intersects ? 1 : 0;
  }
  EXPECT_GT(broken, static_cast<int>(frames / 10));
  EXPECT_LT(broken, static_cast<int>(frames));
}

INSTANTIATE_TEST_SUITE_P(
    All, SurfacesByCgal,
    ::testing::Values(SurfaceParameters{.placement = SurfacePlacement::kMarchingCubes},
                      SurfaceParameters{.placement = SurfacePlacement::kQef},
                      SurfaceParameters{.placement = SurfacePlacement::kVirtualPlane},
                      SurfaceParameters{.placement = SurfacePlacement::kVirtualPlane,
                                        .simplify = .05}));

}  // namespace
}  // namespace partiemc
