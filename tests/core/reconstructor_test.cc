#include "partiemc/reconstructor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "support/reconstruct.h"

namespace partiemc {
namespace {

using support::Particles;
using support::ReconstructOnce;

Reconstructor Make(const ReconstructionParameters& parameters, const FrameLimits& limits = {}) {
  return *Reconstructor::Create(parameters, limits);
}

TEST(Reconstructor, AFrameWithoutParticlesIsAnEmptyResult) {
  for (const Placement placement : AllPlacements()) {
    for (const std::optional<double> spacing : {std::optional<double>(), std::optional(0.1)}) {
      const Result result = ReconstructOnce({.placement = placement, .spacing = spacing}, Frame{});
      EXPECT_EQ(result.rings.RingCount(), 0u);
      EXPECT_EQ(result.mesh.TriangleCount(), 0u);
      EXPECT_EQ(result.statistics.area, 0);
      EXPECT_TRUE(Validate(result).ok());
    }
  }
}

TEST(Reconstructor, ALoneParticleIsARingOfItsOwnWhereTheSpacingIsGiven) {
  for (const double x : {0.0, 0.05, 31.999, 1e4}) {
    const Result result = ReconstructOnce({.spacing = 0.1}, support::Lattice(1, 1, x, -x));
    ASSERT_EQ(result.rings.RingCount(), 1u);
    EXPECT_EQ(result.rings.measures[0].particle_count, 1u);
    EXPECT_NEAR(result.rings.measures[0].centroid_x, x, 0.02);
    EXPECT_NEAR(result.rings.measures[0].centroid_y, -x, 0.02);
    EXPECT_GT(result.rings.measures[0].area, 0.2 * 0.01);
    EXPECT_LT(result.rings.measures[0].area, 4 * 0.01);
    EXPECT_TRUE(Validate(result).ok()) << Validate(result);
  }
}

TEST(Reconstructor, NothingIsDecidedUntilAFrameHasABody) {
  const Reconstructor reconstructor = Make({});
  Particles equal;
  for (int k = 0; k < 5; ++k) equal.Add(2, 3);
  State state;
  Workspace workspace;
  Result result;
  for (const Particles& undecided : {Particles{}, support::Lattice(1, 1), equal}) {
    ASSERT_TRUE(reconstructor.Reconstruct(undecided.AsFrame(), state, workspace, result).ok());
    EXPECT_EQ(result.rings.RingCount(), 0u);
    EXPECT_EQ(result.statistics.particles, undecided.size());
    EXPECT_EQ(result.statistics.cell_size, 0);
    EXPECT_EQ(state, State{});
  }
  const Particles lattice = support::Scaled(support::Lattice(6, 6), 0.25);
  ASSERT_TRUE(reconstructor.Reconstruct(lattice.AsFrame(), state, workspace, result).ok());
  EXPECT_EQ(state.spacing, 0.25);
  EXPECT_EQ(state.cell_size, 0.25);
  EXPECT_EQ(result.rings.RingCount(), 1u);
  // Once decided, an empty frame is an empty result and the lattice stays.
  ASSERT_TRUE(reconstructor.Reconstruct(Frame{}, state, workspace, result).ok());
  EXPECT_EQ(result.rings.RingCount(), 0u);
  EXPECT_EQ(state.cell_size, 0.25);
}

TEST(Reconstructor, DegenerateSetsOfParticlesKeepEveryPromise) {
  support::Random random(1);
  Particles equal_pair;
  equal_pair.Add(1, 1);
  equal_pair.Add(1, 1);
  Particles pair;
  pair.Add(0, 0);
  pair.Add(1, 0);
  const Particles sets[] = {equal_pair,
                            pair,
                            support::Collinear(random, 30),
                            support::Lattice(40, 1),
                            support::Lattice(1, 40),
                            support::WithDuplicates(support::Disc(5), random, 200),
                            support::Noise(random, 300, 0.01),
                            support::Clusters(random, 5, 20)};
  for (const Particles& particles : sets) {
    for (const Placement placement : AllPlacements()) {
      const Result result = ReconstructOnce({.placement = placement, .spacing = 1.0}, particles);
      if (!KeepsGuarantees(placement)) continue;
      EXPECT_GT(result.rings.RingCount(), 0u);
      EXPECT_TRUE(Validate(result).ok()) << Name(placement) << ": " << Validate(result);
    }
  }
}

TEST(Reconstructor, LimitsBeyondWhatCanBeCountedAreRefusedByName) {
  constexpr std::size_t kParticles = FrameLimits::kMostParticles, kTiles = FrameLimits::kMostTiles;
  EXPECT_TRUE(Reconstructor::Create({}, {kParticles, kTiles}).ok());
  const auto refused = [](const FrameLimits& limits) {
    const absl::Status status = Reconstructor::Create({}, limits).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    const auto violation = FindViolation(status);
    return violation ? violation->field + " " + violation->value + " " + violation->rule : "";
  };
  EXPECT_EQ(refused({kParticles + 1, 100}),
            "limits.max_particles 1000000001 must be at most 1000000000");
  EXPECT_EQ(refused({100, kTiles + 1}), "limits.max_tiles 1000001 must be at most 1000000");
}

TEST(Reconstructor, ABadFrameLeavesTheStateAsItWasAndTheResultEmpty) {
  const Reconstructor reconstructor =
      Make({.placement = Placement::kVirtualPlane}, {.max_particles = 5000, .max_tiles = 500});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Particles with_nan = support::MovingBody(1);
  with_nan.xy[17] = nan;
  Particles far = support::MovingBody(1);
  far.Add(1e12, 0);
  Particles many_tiles;
  for (int k = 0; k < 2000; ++k) many_tiles.Add(1000.0 * k, 0);
  Particles too_many = support::Lattice(100, 100);
  Particles bad_volumes = support::MovingBody(1);
  bad_volumes.volumes.assign(bad_volumes.size(), 1.0f);
  bad_volumes.volumes[3] = -1;
  Particles wild_volumes = bad_volumes;
  wild_volumes.volumes[3] = 1e9f;
  State state, undisturbed;
  Workspace workspace, other;
  Result result, expected;
  for (int k = 0; k < 4; ++k) {
    const Particles body = support::MovingBody(k);
    ASSERT_TRUE(reconstructor.Reconstruct(body.AsFrame(), undisturbed, other, expected).ok());
    ASSERT_TRUE(reconstructor.Reconstruct(body.AsFrame(), state, workspace, result).ok());
    EXPECT_EQ(result, expected);
    for (const Particles* bad :
         {&with_nan, &far, &many_tiles, &too_many, &bad_volumes, &wild_volumes}) {
      const State before = state;
      const absl::Status status =
          reconstructor.Reconstruct(bad->AsFrame(), state, workspace, result);
      EXPECT_FALSE(status.ok());
      EXPECT_TRUE(FindViolation(status).has_value()) << status;
      EXPECT_EQ(state, before);
      EXPECT_EQ(result, Result{});
    }
  }
}

TEST(Reconstructor, LimitsAreInclusive) {
  const Particles particles = support::Lattice(10, 10);
  State state;
  Workspace workspace;
  Result result;
  EXPECT_TRUE(Make({}, {.max_particles = 100})
                  .Reconstruct(particles.AsFrame(), state, workspace, result)
                  .ok());
  const std::size_t tiles = result.statistics.tiles;
  EXPECT_TRUE(Make({}, {.max_tiles = tiles})
                  .Reconstruct(particles.AsFrame(), state, workspace, result)
                  .ok());
  const absl::Status particles_status =
      Make({}, {.max_particles = 99}).Reconstruct(particles.AsFrame(), state, workspace, result);
  EXPECT_EQ(particles_status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(FindViolation(particles_status)->reason, kReasonTooManyParticles);
  const absl::Status tiles_status =
      Make({}, {.max_tiles = tiles - 1}).Reconstruct(particles.AsFrame(), state, workspace, result);
  EXPECT_EQ(tiles_status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(FindViolation(tiles_status)->reason, kReasonTooManyTiles);
}

class Recorder : public StageObserver {
 public:
  void StageBegins(Stage stage) override { Tell('+', stage); }
  void StageEnds(Stage stage) override { Tell('-', stage); }
  std::vector<std::string> told;

 private:
  void Tell(char what, Stage stage) { told.emplace_back(1, what).append(Name(stage)); }
};

TEST(Reconstructor, TellsAnObserverTheStagesInTheirOrder) {
  const Reconstructor reconstructor = Make({});
  State state;
  Workspace workspace;
  Result result;
  Recorder recorder;
  const Particles particles = support::Disc(4);
  ASSERT_TRUE(
      reconstructor
          .Reconstruct(particles.AsFrame(), state, workspace, result, {.observer = &recorder})
          .ok());
  EXPECT_EQ(recorder.told, (std::vector<std::string>{
                               "+bins", "-bins", "+field", "-field", "+crossings", "-crossings",
                               "+rings", "-rings", "+normals", "-normals", "+vertices", "-vertices",
                               "+identities", "-identities", "+mesh", "-mesh"}));
}

TEST(Reconstructor, AnObserverChangesNothing) {
  const Particles particles = support::Disc(4);
  State state;
  Workspace workspace;
  Result result;
  Recorder recorder;
  ASSERT_TRUE(
      Make({})
          .Reconstruct(particles.AsFrame(), state, workspace, result, {.observer = &recorder})
          .ok());
  EXPECT_EQ(result, ReconstructOnce({}, particles));
}

TEST(Reconstructor, ARectangleOfParticlesHasTheVolumeOfItsParticles) {
  // The first frame of a dam break: 34 x 67 particles at spacing 0.0303.
  for (const auto& [columns, rows, h] :
       {std::tuple(34, 67, 0.0303), std::tuple(60, 60, 1.0), std::tuple(100, 30, 250.0)}) {
    const Particles particles =
        support::Shifted(support::Scaled(support::Lattice(columns, rows), h), h / 2, h / 2);
    const double volume = columns * rows * h * h;
    for (const Placement placement :
         {Placement::kMarchingSquares, Placement::kQef, Placement::kVirtualPlane}) {
      const Result result = ReconstructOnce({.placement = placement, .spacing = h}, particles);
      EXPECT_NEAR(result.statistics.area / volume, 1,
                  placement == Placement::kVirtualPlane ? 0.003 : 0.01)
          << Name(placement) << ", " << columns << " x " << rows;
      EXPECT_EQ(result.rings.RingCount(), 1u);
    }
  }
}

TEST(Reconstructor, SumsTheMeasuresOfItsRings) {
  const Result result = ReconstructOnce({}, support::Annulus(4, 9));
  ASSERT_EQ(result.rings.RingCount(), 2u);
  EXPECT_DOUBLE_EQ(result.statistics.area,
                   result.rings.measures[0].area + result.rings.measures[1].area);
  EXPECT_DOUBLE_EQ(result.statistics.perimeter,
                   result.rings.measures[0].perimeter + result.rings.measures[1].perimeter);
  EXPECT_EQ(result.statistics.particles, support::Annulus(4, 9).size());
  EXPECT_EQ(result.statistics.spacing, 1);
  EXPECT_GT(result.statistics.active_cells, 20u);
}

TEST(Reconstructor, TheSpacingOfTheFirstFrameIsKept) {
  const Reconstructor reconstructor = Make({});
  State state;
  Workspace workspace;
  Result result;
  for (const double scale : {1.0, 0.7, 1.4}) {
    const Particles particles = support::Scaled(support::Lattice(20, 20), scale);
    ASSERT_TRUE(reconstructor.Reconstruct(particles.AsFrame(), state, workspace, result).ok());
    EXPECT_EQ(result.statistics.spacing, 1);
    EXPECT_EQ(result.statistics.cell_size, 1);
  }
}

TEST(Reconstructor, TheSpacingOfEveryFrameChangesTheRadiiAndNotTheLattice) {
  const Reconstructor reconstructor = Make({.spacing_rule = SpacingRule::kEveryFrame});
  State state;
  Workspace workspace;
  Result result;
  for (const double scale : {1.0, 0.5, 2.0}) {
    const Particles particles = support::Scaled(support::Lattice(20, 20), scale);
    ASSERT_TRUE(reconstructor.Reconstruct(particles.AsFrame(), state, workspace, result).ok());
    EXPECT_EQ(result.statistics.spacing, scale);
    EXPECT_EQ(result.statistics.cell_size, 1);
    EXPECT_NEAR(result.statistics.area, 400 * scale * scale, 0.02 * 400 * scale * scale);
    EXPECT_TRUE(Validate(result).ok()) << Validate(result);
  }
  // A frame without a spacing uses the last one.
  const Particles lone = support::Lattice(1, 1);
  ASSERT_TRUE(reconstructor.Reconstruct(lone.AsFrame(), state, workspace, result).ok());
  EXPECT_EQ(result.statistics.spacing, 2);
  EXPECT_EQ(result.rings.RingCount(), 1u);
}

TEST(Reconstructor, ASpacingThatIsGivenCountsAndNotTheParticles) {
  const Result result = ReconstructOnce({.spacing = 1.25}, support::Lattice(10, 10));
  EXPECT_EQ(result.statistics.spacing, 1.25);
  EXPECT_EQ(result.statistics.cell_size, 1.25);
}

TEST(Reconstructor, AnOutlineAsFarOutAsTheKernelReachesStillKeepsEveryPromise) {
  // A particle with a tiny volume disables the guard. With a reference radius near the kernel's,
  // the inside extends as far as a kernel reaches, up to the edges of tiles.
  for (int shift = 0; shift < 32; ++shift) {
    Particles particles = support::Shifted(support::Disc(3), shift + 0.25, 0.5 * shift);
    particles.Add(shift + 8, 0.5 * shift);
    particles.volumes.assign(particles.size(), 1.0f);
    particles.volumes.back() = 2e-6f;
    for (const Placement placement :
         {Placement::kMarchingSquares, Placement::kQef, Placement::kVirtualPlane}) {
      const Result result = ReconstructOnce(
          {.placement = placement, .spacing = 1.0, .reference_radius = 2.99}, particles);
      EXPECT_TRUE(Validate(result).ok()) << shift << ": " << Validate(result);
      EXPECT_GT(result.statistics.area, 80);
    }
  }
}

TEST(Reconstructor, AnOutlineHasNoAttributesOfASurfaceBefore) {
  Result result;
  result.surface.attributes = {{"heat", 1, {}}};
  const std::vector<double> positions = {0, 0, 1, 0, 0, 1, 1, 1};
  State state;
  Workspace workspace;
  ASSERT_TRUE(
      Reconstructor::Create({.spacing = 1})
          ->Reconstruct({.positions = std::span<const double>(positions)}, state, workspace, result)
          .ok());
  EXPECT_GT(result.rings.PointCount(), 0u);
  EXPECT_EQ(result.surface, Surface{});
}

TEST(Reconstructor, VolumesBeyondReasonAreRefusedByName) {
  Particles particles = support::Disc(4);
  particles.volumes.assign(particles.size(), 1.0f);
  State state;
  Workspace workspace;
  Result result;
  EXPECT_TRUE(
      Make({.spacing = 1.0}).Reconstruct(particles.AsFrame(), state, workspace, result).ok());
  for (const float volume : {1e-7f, 1e7f}) {
    particles.volumes[5] = volume;
    const absl::Status status =
        Make({.spacing = 1.0}).Reconstruct(particles.AsFrame(), state, workspace, result);
    ASSERT_TRUE(FindViolation(status).has_value());
    EXPECT_EQ(FindViolation(status)->field, "volumes[5]");
    EXPECT_EQ(FindViolation(status)->reason, kReasonOutOfRange);
  }
}

}  // namespace
}  // namespace partiemc
