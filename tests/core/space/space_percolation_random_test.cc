// Random frames with bodies that reach their own image in a periodic box: every surface is valid
// and cut at the faces only.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <utility>

#include "base/vec3.h"
#include "partiemc/partiemc.h"
#include "partiemc/surface_reconstructor.h"
#include "space/periodic_bodies.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::BoxOf;
using support::Filled;
using support::Random;
using support::SpaceParticles;
using support::SumsOf;
using support::Uniform;
using support::Wrapped;

/// A frame and its box: a scene wrapped into a small box, noise of any density, layers with waves,
/// holes and balls, or columns along several axes.
std::pair<SpaceParticles, PeriodicBox> RandomPeriodicFrame(std::uint64_t seed, double radius) {
  Random random(7919 * seed);
  const double least = 4 * radius;
  const auto length = [&] {
    const double any = least * random.Uniform(1, 2);
    return random.Chance(.5) ? std::ceil(any) : any;
  };
  const Vec3 lengths{length(), length(), length()};
  SpaceParticles particles;
  switch (random.Below(4)) {
    case 0:
      particles = support::RandomSpaceScene(seed);
      break;
    case 1:
      particles = Uniform(
          static_cast<std::size_t>(random.Uniform(.02, 1.2) * lengths.x * lengths.y * least),
          {lengths.x, lengths.y, least}, random);
      break;
    case 2: {
      const double height = random.Uniform(1, 10), wave = random.Uniform(0, 5),
                   gap = random.Chance(.3) ? .3 : 0;
      particles = Filled(static_cast<int>(lengths.x), static_cast<int>(lengths.y), 16, .2, random,
                         [&](const Vec3& at) {
                           const double top = height + wave * std::sin(2 * M_PI * at.x / lengths.x);
                           return at.z < top && !random.Chance(gap);
                         });
      for (std::size_t k = random.Below(5); k > 0; --k) {
        const double x = random.Uniform(0, lengths.x), y = random.Uniform(0, lengths.y);
        const Vec3 centre{x, y, random.Uniform(0, lengths.z)};
        particles.Add(support::Ball(centre, random.Uniform(.5, 4), .2, random));
      }
      particles.Add(Uniform(random.Below(30), lengths, random));
      break;
    }
    default:
      for (std::size_t k = random.Below(3) + 1; k > 0; --k) {
        const Vec3 along{random.Chance(.5) ? lengths.x : 0, random.Chance(.5) ? lengths.y : 0,
                         random.Chance(.5) ? lengths.z : 0};
        const double steps = std::ceil(Length(along)), thickness = random.Uniform(.3, 2.5);
        const double x = random.Uniform(0, lengths.x), y = random.Uniform(0, lengths.y);
        const Vec3 from{x, y, random.Uniform(0, lengths.z)};
        for (double step = 0; step < steps; ++step) {
          particles.Add(support::Ball(from + (step / steps) * along, thickness, .2, random));
        }
      }
  }
  Vec3 origin;
  if (particles.size() > 0) origin = particles.At(random.Below(particles.size()));
  if (random.Chance(.3))
    origin = {std::floor(origin.x), std::floor(origin.y), std::floor(origin.z)};
  PeriodicBox box = BoxOf(random.Chance(.8) ? lengths.x : 0, random.Chance(.8) ? lengths.y : 0,
                          random.Chance(.8) ? lengths.z : 0, origin);
  if (box == PeriodicBox()) box.axes[2] = PeriodicAxis{origin.z, lengths.z};
  return {Wrapped(particles, box), box};
}

/// The shells that are cut lie in the box, and each has points on a face.
void ExpectCutsOnFaces(const Surface& surface, const PeriodicBox& box) {
  for (const std::uint32_t cut : surface.cuts) {
    bool is_on_face = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!box.axes[axis]) continue;
      const double origin = box.axes[axis]->origin, length = box.axes[axis]->length;
      const auto all_at = [&](double face) {
        for (std::size_t k = 0; k < 3; ++k) {
          const double at = surface.points[3 * surface.triangles[3 * cut + k] + axis];
          if (std::abs(at - face) > 1e-4 + 1e-9 * std::abs(face)) return false;
        }
        return true;
      };
      is_on_face = is_on_face || all_at(origin) || all_at(origin + length);
    }
    ASSERT_TRUE(is_on_face);
  }
}

/// Reconstructs and checks a random frame. Returns whether anything is cut.
bool CheckRandomFrame(std::uint64_t seed, SurfaceWorkspace& workspace) {
  SCOPED_TRACE(seed);
  Random random(seed);
  const double radius = random.Chance(.3) ? 3 : random.Uniform(1.8, 2.5);
  const auto [particles, box] = RandomPeriodicFrame(seed, radius);
  if (particles.size() == 0) return false;
  SurfaceParameters parameters{.box = box};
  parameters.placement = seed % 4 == 0   ? SurfacePlacement::kMarchingCubes
                         : seed % 4 == 1 ? SurfacePlacement::kQef
                                         : SurfacePlacement::kVirtualPlane;
  parameters.kernel_radius = radius;
  parameters.cell_size = random.Chance(.5) ? 1 : random.Uniform(.6, 1.2);
  parameters.simplify = random.Chance(.2) ? .1 : 0;
  parameters.min_component_particles = random.Chance(.3) ? random.Below(12) : 0;
  const auto created = SurfaceReconstructor::Create(parameters);
  EXPECT_TRUE(created.ok()) << created.status();
  if (!created.ok()) return false;
  SurfaceState state;
  Surface surface;
  const absl::Status status = created->Reconstruct(particles.AsFrame(), state, workspace, surface);
  EXPECT_TRUE(status.ok()) << status;
  const absl::Status valid = Validate(surface);
  EXPECT_TRUE(valid.ok()) << valid;
  EXPECT_LE(SumsOf(surface).particles, particles.size());
  ExpectCutsOnFaces(surface, box);
  return !surface.cuts.empty();
}

TEST(SurfacePercolation, RandomFramesKeepTheGuarantees) {
  std::uint64_t with_cuts = 0;
  const std::uint64_t frames = support::Tries(60u);
  SurfaceWorkspace workspace;
  for (std::uint64_t seed = 1; seed <= frames && !HasFailure(); ++seed) {
    with_cuts += CheckRandomFrame(seed, workspace) ? 1 : 0;
  }
  std::printf("%llu frames, %llu with cuts\n", static_cast<unsigned long long>(frames),
              static_cast<unsigned long long>(with_cuts));
  EXPECT_GT(with_cuts, frames / 3);
}

// The simplification makes degenerate triangles of one shell, and triangles of others that
// intersect. It once compared only the first shell again.
TEST(SurfacePercolation, SimplifiedShellsAreComparedAfterDegenerateOnes) {
  SurfaceWorkspace workspace;
  CheckRandomFrame(1769, workspace);
}

}  // namespace
}  // namespace partiemc
