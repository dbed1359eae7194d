// The guarantees of result.h over random frames, each with one or two that follow it. A release is
// tested with PARTIEMC_TRIES=50. Each frame prints its seed when it fails; PARTIEMC_SEED starts
// from that one. What was seen is printed at the end, by placement.
#include <gtest/gtest.h>

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "support/particles.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;

struct Trial {
  std::vector<Particles> frames;  // Figures of one stream.
  ReconstructionParameters parameters;
};

// The next frame of a stream whose particles have ids: they drift, turn and shear, with noise or
// without, now and then in leaps; some vanish, others appear, and they come in another order.
Particles NextFrame(const Particles& before, double spacing, support::Random& random) {
  if (before.size() == 0) return before;
  const double reach = spacing * (random.Chance(0.1) ? 20 : 0.5);
  const double noise = random.Chance(0.5) ? 0 : 0.2 * spacing;
  const double lost_share = random.Chance(0.5) ? 0 : random.Uniform(0, 0.3);
  const double dx = random.Uniform(-reach, reach), dy = random.Uniform(-reach, reach);
  double slopes[4];
  for (double& slope : slopes) slope = random.Uniform(-0.03, 0.03);
  std::uint64_t next_id = 0;
  Particles after;
  const auto add = [&](double x, double y, std::size_t like, std::uint64_t id) {
    after.Add(x, y);
    if (!before.volumes.empty()) after.volumes.push_back(before.volumes[like]);
    after.ids.push_back(id);
  };
  for (std::size_t k = 0; k < before.size(); ++k) {
    next_id = std::max(next_id, before.ids[k] + 1);
    if (random.Chance(lost_share)) continue;
    const double x = before.x(k) - before.x(0), y = before.y(k) - before.y(0);
    add(before.x(k) + dx + slopes[0] * x + slopes[1] * y + random.Uniform(-noise, noise),
        before.y(k) + dy + slopes[2] * x + slopes[3] * y + random.Uniform(-noise, noise), k,
        before.ids[k]);
  }
  for (std::size_t more = random.Below(10); more > 0; --more) {
    const std::size_t beside = random.Below(before.size());
    add(before.x(beside) + random.Uniform(-2, 2) * spacing,
        before.y(beside) + random.Uniform(-2, 2) * spacing, beside, next_id++);
  }
  return support::Permuted(after, random);
}

// A scene and its later frames. Without ids it moves slightly, so that the second frame uses
// remembered normals. With ids, particles move separately, appear and vanish, in two more frames.
std::vector<Particles> MakeFrames(Particles scene, double spacing, std::uint64_t seed) {
  support::Random moves(seed ^ 0x5eed3);
  if (scene.size() == 0 || moves.Chance(0.4)) {
    return {scene, support::Shifted(scene, 0.3 * spacing, -0.3 * spacing)};
  }
  for (std::size_t k = 0; k < scene.size(); ++k) scene.ids.push_back(k);
  std::vector<Particles> frames = {std::move(scene)};
  while (frames.size() < 3) frames.push_back(NextFrame(frames.back(), spacing, moves));
  return frames;
}

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
  trial.frames = MakeFrames(support::Scaled(support::RandomScene(seed), spacing), spacing, seed);
  // Noise and clusters have no spacing worth the name: most frames are given theirs, and those
  // with volumes always.
  if (!trial.frames[0].volumes.empty() || random.Chance(0.7)) trial.parameters.spacing = spacing;
  // Events that change the rings of few frames.
  support::Random rare(seed ^ 0x5eed2);
  if (rare.Chance(0.1)) trial.parameters.min_component_area = rare.Uniform(0, 40);
  if (rare.Chance(0.1)) trial.parameters.min_component_particles = rare.Below(20);
  if (rare.Chance(0.1)) trial.parameters.spacing_rule = SpacingRule::kEveryFrame;
  if (rare.Chance(0.1)) trial.parameters.surface_offset = rare.Uniform(-1, 1);
  return trial;
}

// Figures of one placement.
struct Tally {
  std::uint64_t results = 0, refused = 0;
  std::map<std::string, std::uint64_t> broken;  // By guarantee: "R2", ...
  std::uint64_t crossed = 0, folded = 0;        // Results with at least one.

  void Add(const Result& result, const absl::Status& valid) {
    ++results;
    crossed += result.statistics.self_intersections > 0;
    folded += result.statistics.folded_triangles > 0;
    if (!valid.ok()) ++broken[std::string(valid.message().substr(0, 2))];
  }
};

std::ostream& operator<<(std::ostream& out, const Tally& tally) {
  out << tally.results << " results, " << tally.refused << " frames of too many tiles, "
      << tally.crossed << " with crossings, " << tally.folded << " with folds, broken:";
  if (tally.broken.empty()) out << " none";
  for (const auto& [guarantee, count] : tally.broken) out << ' ' << guarantee << ' ' << count;
  return out;
}

// Runs all frames with each fill. A frame that reaches too many tiles is refused.
void CheckPlacement(const Trial& trial, Placement placement, Tally& tally) {
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
    for (const Particles& particles : trial.frames) {
      const absl::Status status =
          reconstructor->Reconstruct(particles.AsFrame(), state, workspace, result);
      if (absl::IsResourceExhausted(status)) {
        ++tally.refused;
        return;
      }
      ASSERT_TRUE(status.ok()) << Name(placement) << ", " << Name(fill) << ": " << status;
      const absl::Status valid = Validate(result, fill);
      tally.Add(result, valid);
      if (!KeepsGuarantees(placement)) continue;
      EXPECT_TRUE(valid.ok()) << Name(placement) << ", " << Name(fill) << ": " << valid;
      EXPECT_EQ(result.statistics.folded_triangles, 0u);
      EXPECT_EQ(result.statistics.self_intersections, 0u);
    }
    if (!grid) grid = result;
    EXPECT_EQ(DigestRings(result.rings), DigestRings(grid->rings)) << Name(fill);
    if (!KeepsGuarantees(placement)) continue;
    EXPECT_EQ(result.statistics.triangles_grid, grid->mesh.TriangleCount()) << Name(fill);
  }
}

TEST(Guarantees, HoldForRandomFramesAllPlacementsAndAllFills) {
  const std::uint64_t frames = support::Tries(200u);
  const std::uint64_t first = support::FirstSeed();
  std::map<Placement, Tally> tallies;
  for (std::uint64_t seed = first; seed < first + frames; ++seed) {
    SCOPED_TRACE(testing::Message() << "PARTIEMC_SEED=" << seed);
    const Trial trial = MakeTrial(seed);
    for (const Placement placement : AllPlacements()) {
      CheckPlacement(trial, placement, tallies[placement]);
    }
    if (testing::Test::HasFailure()) break;  // The first failing seed is enough.
  }
  for (const auto& [placement, tally] : tallies) {
    std::cout << std::left << std::setw(18) << Name(placement) << tally << '\n';
    EXPECT_LE(tally.refused, frames * 2 / 10) << Name(placement);
  }
}

}  // namespace
}  // namespace partiemc
