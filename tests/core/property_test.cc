// The guarantees of result.h over random frames. PARTIEMC_FRAMES sets how many: the default is for
// every day, 10000 for a release. Each frame prints its seed when it fails; PARTIEMC_SEED starts
// from that one.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "support/particles.h"

namespace partiemc {
namespace {

using support::Particles;

std::uint64_t NumberFromEnvironment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

struct Trial {
  Particles particles;
  ReconstructionParameters parameters;
};

Trial MakeTrial(std::uint64_t seed) {
  support::Random random(seed ^ 0x5eed);
  Trial trial;
  trial.parameters.kernel_radius = random.Chance(0.5) ? 3 : random.Uniform(1.5, 8);
  trial.parameters.cell_size = random.Chance(0.5) ? 1 : random.Uniform(0.4, 4);
  trial.parameters.normal_memory = random.Chance(0.5);
  if (random.Chance(0.3)) trial.parameters.clean = random.Chance(0.5);
  if (random.Chance(0.2)) {
    trial.parameters.reference_radius = random.Uniform(0.1, 0.9) * trial.parameters.kernel_radius;
  }
  constexpr double kSpacings[] = {1, 0.0303, 1e-9, 1e7};
  const double spacing = kSpacings[random.Below(4)];
  trial.particles = support::Scaled(support::RandomScene(seed), spacing);
  // Noise and clusters have no spacing worth the name: most frames are given theirs, and those
  // with volumes always.
  if (!trial.particles.volumes.empty() || random.Chance(0.7)) trial.parameters.spacing = spacing;
  return trial;
}

// Runs two frames, so that the second one has a memory; the second is the first, moved a little.
// Returns whether the frame was reconstructed; one that reaches too many tiles is not.
bool CheckPlacement(const Trial& trial, Placement placement) {
  ReconstructionParameters parameters = trial.parameters;
  parameters.placement = placement;
  const FrameLimits limits{.max_tiles = 600};
  Workspace workspace;
  std::optional<Result> grid;
  for (const Fill fill :
       {Fill::kGrid, Fill::kGreedy, Fill::kConforming, Fill::kPolygon, Fill::kNone}) {
    parameters.fill = fill;
    const auto reconstructor = Reconstructor::Create(parameters, limits);
    EXPECT_TRUE(reconstructor.ok()) << reconstructor.status();
    State state;
    Result result;
    for (const double shift : {0.0, 0.3}) {
      const double distance = shift * parameters.spacing.value_or(0);
      const Particles particles = support::Shifted(trial.particles, distance, -distance);
      const absl::Status status =
          reconstructor->Reconstruct(particles.AsFrame(), state, workspace, result);
      if (absl::IsResourceExhausted(status)) return false;
      EXPECT_TRUE(status.ok()) << status;
      if (!status.ok()) return false;
      if (placement == Placement::kFarthestParticle) continue;
      const absl::Status valid = Validate(result);
      EXPECT_TRUE(valid.ok()) << Name(placement) << ", " << Name(fill) << ": " << valid;
      EXPECT_EQ(result.statistics.folded_triangles, 0u);
    }
    if (!grid) grid = result;
    EXPECT_EQ(DigestRings(result.rings), DigestRings(grid->rings)) << Name(fill);
    if (placement == Placement::kFarthestParticle) continue;
    EXPECT_EQ(result.statistics.triangles_grid, grid->mesh.TriangleCount()) << Name(fill);
  }
  return true;
}

TEST(Guarantees, HoldForRandomFramesAllPlacementsAndAllFills) {
  const std::uint64_t frames = NumberFromEnvironment("PARTIEMC_FRAMES", 200);
  const std::uint64_t first = NumberFromEnvironment("PARTIEMC_SEED", 1);
  std::uint64_t reconstructed = 0;
  for (std::uint64_t seed = first; seed < first + frames; ++seed) {
    SCOPED_TRACE(testing::Message() << "PARTIEMC_SEED=" << seed);
    const Trial trial = MakeTrial(seed);
    bool done = true;
    for (const Placement placement : AllPlacements())
      done = CheckPlacement(trial, placement) && done;
    reconstructed += done;
    if (testing::Test::HasFailure()) break;  // The first seed tells more than a flood.
  }
  EXPECT_GE(reconstructed, frames * 8 / 10);
}

}  // namespace
}  // namespace partiemc
