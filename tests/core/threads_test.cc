// The results of a stream do not depend on the number of threads.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "partiemc/partiemc.h"
#include "support/random.h"
#include "support/tracked_scene.h"

namespace partiemc {
namespace {

using support::Particles;

constexpr int kFrames = 2;

struct Stream {
  std::string name;
  ReconstructionParameters parameters;
  bool brings_everything = false;  // Ids, velocities and volumes.
  friend std::ostream& operator<<(std::ostream& out, const Stream& stream) {
    return out << stream.name;
  }
};

std::vector<Stream> Streams() {
  std::vector<Stream> streams;
  const auto add = [&](std::string name, ReconstructionParameters parameters) {
    std::erase(name, '-');
    streams.push_back({name, parameters});
  };
  for (const Placement placement : AllPlacements()) {
    add("Placed_" + std::string(Name(placement)), {.placement = placement, .spacing = 1});
  }
  for (const Fill fill : AllFills()) {
    add("Filled_" + std::string(Name(fill)), {.fill = fill, .spacing = 1});
  }
  add("EstimatingTheSpacing", {.spacing_rule = SpacingRule::kEveryFrame});
  add("DividedAmongPhases", {.spacing = 1, .sections = {{.phase = 1}, {.phase = 2}}});
  add("PhasesOfAWrappedBox",
      {.spacing = 1,
       .sections = {{.phase = 1}, {.phase = 2}},
       .box = PeriodicBox{.axes = {PeriodicAxis{0, 256}, PeriodicAxis{0, 256}}, .wraps = true}});
  add("CutAtWalls", {.spacing = 1, .walls = {{{0, -60, 1, -60}}, {{125, 3, 131, 3, 131, -2}}}});
  add("CutAtWallParticles", {.spacing = 1, .wall_phases = {2}});
  add("OfAWideKernel", {.spacing = 1, .kernel_radius = 5, .cell_size = 2});
  streams.push_back({"WithEverythingKnown", {.spacing = 1}, /*brings_everything=*/true});
  return streams;
}

// A large disc that drifts towards rows of small ones, which move through each other.
Particles SceneAt(const Stream& stream, int frame) {
  support::Scene scene(stream.brings_everything ? support::kBoth : support::kNothing, frame);
  scene.Add(support::Disc(110, 0.9 * frame, 0.3 * frame), 0, 0.9, 0.3);
  for (int k = 0; k < 60; ++k) {
    const double vx = k % 2 == 0 ? -1.5 : 1.5;
    scene.Add(support::Disc(1.5 + 0.05 * k, 120.0 + 8 * (k % 10) + vx * frame, 8.0 * (k / 10)),
              100'000 + 1000 * static_cast<std::uint64_t>(k), vx, 0);
  }
  Particles particles = scene;
  if (stream.brings_everything) particles.volumes.assign(particles.size(), 0.9f);
  if (!stream.parameters.sections.empty() || !stream.parameters.wall_phases.empty()) {
    for (std::size_t k = 0; k < particles.size(); ++k) {
      particles.phases.push_back(std::sin(particles.x(k) / 9) < .3 ? 1 : 2);
    }
  }
  return particles;
}

class Threads : public testing::TestWithParam<Stream> {};

TEST_P(Threads, AsManyAsThereAreGiveTheSameBitsInFreshAndInUsedWorkspaces) {
  const auto reconstructor = Reconstructor::Create(GetParam().parameters);
  ASSERT_TRUE(reconstructor.ok()) << reconstructor.status();
  std::vector<Result> expected;
  std::vector<State> expected_states;
  for (const unsigned threads : {1u, 2u, 7u}) {
    SCOPED_TRACE(testing::Message() << threads << " threads");
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    Arena arena(threads);
    State state;
    Workspace used;
    for (std::size_t k = 0; k < kFrames; ++k) {
      const Particles particles = SceneAt(GetParam(), static_cast<int>(k));
      Result result, fresh_result;
      State fresh_state = state;
      Workspace fresh;
      arena.Execute([&] {
        ASSERT_TRUE(reconstructor->Reconstruct(particles.AsFrame(), state, used, result).ok());
        ASSERT_TRUE(
            reconstructor->Reconstruct(particles.AsFrame(), fresh_state, fresh, fresh_result).ok());
      });
      ASSERT_GT(result.rings.RingCount(), 10u);
      if (threads == 1) {
        expected.push_back(result);
        expected_states.push_back(state);
      }
      EXPECT_EQ(DigestRings(result.rings), DigestRings(expected[k].rings));
      EXPECT_EQ(DigestMesh(result.mesh), DigestMesh(expected[k].mesh));
      EXPECT_EQ(result, expected[k]);
      EXPECT_EQ(fresh_result, expected[k]);
      EXPECT_EQ(state, expected_states[k]);
      EXPECT_EQ(fresh_state, expected_states[k]);
    }
  }
}

TEST(ParallelSort, SortsWhateverTheOrderWas) {
  support::Random random(5);
  for (const std::size_t count : {0, 1, 2, 2048, 2049, 100'000}) {
    std::vector<std::vector<std::uint64_t>> orders(5, std::vector<std::uint64_t>(count));
    for (std::size_t k = 0; k < count; ++k) {
      orders[0][k] = k;
      orders[1][k] = count - k;
      orders[2][k] = 7;
      orders[3][k] = std::min(k, count - k);
      orders[4][k] = random.Below(1000);
    }
    for (std::vector<std::uint64_t>& values : orders) {
      std::vector<std::uint64_t> expected = values;
      std::sort(expected.begin(), expected.end());
      ParallelSort(std::span(values), std::less<>());
      EXPECT_EQ(values, expected);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Streams, Threads, testing::ValuesIn(Streams()),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace partiemc
