// The memory of outlines: what a frame reserves bounds what it takes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/heap_counts.h"
#include "core/recording_guard.h"
#include "core/varied_particles.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/particles.h"
#include "support/wall_scenes.h"

namespace partiemc {
namespace {

using support::kCellOfGrains;
using support::live_bytes;
using support::NoisyValues;
using support::Particles;
using support::RecordingGuard;
using support::StripedPhases;
using support::VaryingVolumes;

// What particles have beside positions. The last two are values of attributes.
enum class Carried { kNothing, kIds, kConstants, kNoise };

struct MemoryCase {
  std::string name;
  Particles particles;
  ReconstructionParameters parameters;
};

// Frames that differ in their largest consumer of memory.
std::vector<MemoryCase> MemoryCases(Carried carried) {
  std::vector<MemoryCase> cases;
  const auto add = [&](std::string name, const Particles& particles,
                       ReconstructionParameters parameters = {}) {
    parameters.spacing = 1;
    cases.push_back({name, particles, parameters});
    for (std::size_t k = 0; carried == Carried::kIds && k < particles.size(); ++k) {
      cases.back().particles.ids.push_back(k);
    }
  };
  const auto spread = [](int side, double distance, double x0 = 0) {
    return support::Scaled(support::Lattice(side, side, x0 / distance, x0 / distance), distance);
  };
  Particles islands;
  for (int k = 0; k < 400; ++k) islands.Add(support::Disc(7.5, k % 20 * 30, k / 20 * 30));
  support::Random random(3);
  add("corners of tiles", spread(90, 64));
  add("middles of tiles", spread(60, 96, 16));
  add("one body", support::Disc(200));
  add("one body, grid", support::Disc(200), {.fill = Fill::kGrid});
  add("islands", islands);
  add("drops", spread(150, 5));
  add("drops of a fine lattice", spread(60, 20), {.kernel_radius = 8, .cell_size = .25});
  add("drops of a coarse lattice", spread(150, 5), {.kernel_radius = 1.5, .cell_size = 2});
  add("noise", support::Noise(random, 30'000, 300));
  const auto boxed = [](double length) {
    return PeriodicBox{
        .axes = {PeriodicAxis{-length / 2, length}, PeriodicAxis{-length / 2, length}}};
  };
  const auto sized = [](Particles particles) {
    particles.volumes = VaryingVolumes(particles.size());
    return particles;
  };
  add("body of own sizes", sized(support::Disc(200)), {.sizes = Sizes::kOwn});
  add("drops of own sizes", sized(spread(150, 5)), {.sizes = Sizes::kOwn});
  const auto phased = [](Particles particles) {
    particles.phases = StripedPhases(particles);
    return particles;
  };
  const std::vector<Section> phases = {{.phase = 1}, {.phase = 2}};
  add("body of two phases", phased(support::Disc(200)), {.sections = phases});
  add("drops of two phases", phased(spread(150, 5)), {.sections = phases});
  const std::vector<Wall> tank = {support::PolygonWall(0, 0, 187, 1000, 0, true)};
  add("body in a round tank", support::Disc(200), {.walls = tank});
  add("drops at walls", spread(150, 5),
      {.walls = {{{0, 7, 1, 7}}, {{7, 1, 7, 0}}, {{0, 0, 1, 1}}}});
  add("body of own sizes in a round tank", sized(support::Disc(200)),
      {.sizes = Sizes::kOwn, .walls = tank});
  add("drops of own sizes at walls", sized(spread(150, 5)),
      {.sizes = Sizes::kOwn, .walls = {{{0, 7, 1, 7}}, {{7, 1, 7, 0}}, {{0, 0, 1, 1}}}});
  add("body of two phases in a round tank", phased(support::Disc(200)),
      {.sections = phases, .walls = tank});
  add("drops among wall particles", phased(spread(150, 1.2)), {.wall_phases = {2}});
  add("body among wall particles", phased(support::Disc(200)), {.wall_phases = {2}});
  const ReconstructionParameters grains{
      .sizes = Sizes::kOwn, .boundary = Boundary::kGrains, .cell_size = kCellOfGrains};
  add("body of grains", sized(support::Disc(60)), grains);
  add("drops of grains", sized(spread(40, 5)), grains);
  add("body in a periodic box", support::Disc(120), {.box = boxed(300)});
  add("drops in a periodic box", spread(150, 7), {.box = boxed(3000)});
  add("percolating layer", support::Lattice(1000, 60, -499.7), {.box = boxed(1000)});
  add("full periodic box", support::Lattice(150, 150, -74.7, -74.7), {.box = boxed(150)});
  add("percolating noise", support::Noise(random, 30'000, 300), {.box = boxed(600)});
  PeriodicBox wrapped = boxed(750);
  wrapped.wraps = true;
  add("wrapped drops", spread(150, 5), {.box = wrapped});
  wrapped = boxed(600);
  wrapped.wraps = true;
  add("wrapped noise", support::Noise(random, 30'000, 300), {.box = wrapped});
  add("body of own sizes in a periodic box", sized(support::Disc(120)),
      {.sizes = Sizes::kOwn, .box = boxed(300)});
  add("percolating noise of own sizes", sized(support::Noise(random, 30'000, 300)),
      {.sizes = Sizes::kOwn, .box = boxed(600)});
  ReconstructionParameters channel{
      .box = PeriodicBox{.axes = {PeriodicAxis{-300, 600}}},
      .walls = {{{0, -9, 1, -9}}, support::PolygonWall(299, 40, 20, 300, 0, false)}};
  add("full periodic box of two phases", phased(support::Lattice(150, 150, -74.7, -74.7)),
      {.sections = phases, .box = boxed(150)});
  add("percolating noise of two phases", phased(support::Noise(random, 30'000, 300)),
      {.sections = phases, .box = boxed(600)});
  add("wrapped drops of two phases", phased(spread(120, 5)), {.sections = phases, .box = wrapped});
  add("noise in a periodic channel", support::Noise(random, 30'000, 300), channel);
  channel.wall_phases = {2};
  add("noise among wall particles of a periodic box", phased(support::Noise(random, 30'000, 300)),
      channel);
  add("wrapped noise of own sizes", sized(support::Noise(random, 30'000, 300)),
      {.sizes = Sizes::kOwn, .box = wrapped});
  ReconstructionParameters boxed_grains = grains;
  boxed_grains.box = boxed(200);
  add("percolating grains", sized(support::Lattice(199, 20, -99.7)), boxed_grains);
  for (const auto& [name, particles] :
       {std::pair("filtered body", support::Disc(120)), std::pair("filtered drops", spread(150, 7)),
        std::pair("filtered body in few tiles", support::Scaled(support::Disc(160), .25))}) {
    if (carried == Carried::kIds) add(name, particles, {.noise_filter = .5});
  }
  return cases;
}

class FrameMemory : public testing::TestWithParam<Carried> {};
INSTANTIATE_TEST_SUITE_P(Of, FrameMemory,
                         testing::Values(Carried::kNothing, Carried::kIds, Carried::kConstants,
                                         Carried::kNoise));

TEST_P(FrameMemory, IsAtMostWhatIsReservedAndNotMuchLess) {
  for (const MemoryCase& tested : MemoryCases(GetParam())) {
    SCOPED_TRACE(tested.name);
    const auto reconstructor = Reconstructor::Create(tested.parameters);
    ASSERT_TRUE(reconstructor.ok());
    std::vector<float> values(3 * tested.particles.size(), 1.0f);
    if (GetParam() == Carried::kNoise) values = NoisyValues(values.size());
    const std::array<Attribute, 4> attributes = {{{"a", 3, values},
                                                  {"b", 3, values},
                                                  {"c", 3, values},
                                                  {"phase", 1, tested.particles.phases}}};
    Frame frame = tested.particles.AsFrame();
    if (GetParam() >= Carried::kConstants) {
      frame.attributes = std::span(attributes).first(tested.particles.phases.empty() ? 3 : 4);
    }
    const std::size_t before = live_bytes;
    RecordingGuard guard(100);
    std::size_t held = 0;
    {
      State state;
      Workspace workspace;
      Result result;
      for (int k = 0; k < 2; ++k) {  // The second one remembers the first.
        guard = RecordingGuard(100);
        const absl::Status status =
            reconstructor->Reconstruct(frame, state, workspace, result, {.memory = &guard});
        ASSERT_TRUE(status.ok()) << status;
      }
      held = live_bytes - before;
    }
    EXPECT_LE(held, guard.last());
    // The mesh of smooth attributes is small, but this is not known in advance.
    if (GetParam() == Carried::kConstants) continue;
    EXPECT_GE(2.5 * static_cast<double>(held), static_cast<double>(guard.last()));
  }
}

TEST(MemoryGuard, RefusesAFrameBeforeItsTilesTakeMemory) {
  const MemoryCase tested = MemoryCases(Carried::kNothing).front();
  const auto reconstructor = Reconstructor::Create(tested.parameters);
  ASSERT_TRUE(reconstructor.ok());
  State state;
  Workspace workspace;
  Result result;
  const Particles drop = support::Disc(5);
  ASSERT_TRUE(reconstructor->Reconstruct(drop.AsFrame(), state, workspace, result).ok());
  const State before = state;
  const Result drop_result = result;
  for (const int granted : {0, 1}) {
    SCOPED_TRACE(granted);
    const std::size_t live = live_bytes;
    RecordingGuard guard(granted);
    const absl::Status status = reconstructor->Reconstruct(tested.particles.AsFrame(), state,
                                                           workspace, result, {.memory = &guard});
    EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
    const auto violation = FindViolation(status);
    ASSERT_TRUE(violation.has_value());
    EXPECT_EQ(violation->reason, kReasonOutOfMemory);
    EXPECT_EQ(violation->field, "positions");
    EXPECT_EQ(violation->value, "32400 tiles of 32 x 32 cells");
    EXPECT_EQ(state, before);
    EXPECT_EQ(result, Result());
    // The directory of the tiles and the particles' positions in it, but nothing stored on tiles.
    if (granted == 0) {
      EXPECT_LE(live_bytes - live, 32'400 * 200u);
    }
  }
  State again;
  ASSERT_TRUE(reconstructor->Reconstruct(drop.AsFrame(), again, workspace, result).ok());
  EXPECT_EQ(result, drop_result);
}
}  // namespace
}  // namespace partiemc
