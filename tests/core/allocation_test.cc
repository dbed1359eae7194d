// Allocations and memory of outlines: a frame like one before must allocate nothing.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <array>
#include <ostream>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/heap_counts.h"
#include "core/recording_guard.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/particles.h"
#include "support/wall_scenes.h"

namespace partiemc {
namespace {

using support::allocations;
using support::live_bytes;
using support::Particles;
using support::RecordingGuard;

// Values of an attribute, for which the mesh of `greedy` has the smallest blocks.
std::vector<float> NoisyValues(std::size_t count) {
  support::Random random(9);
  std::vector<float> values(count);
  for (float& value : values) value = static_cast<float>(random.Uniform(0, 1));
  return values;
}

struct AllocationCase {
  Placement placement;
  Fill fill;
  int threads;
  bool volumes, ids;
  bool estimates_spacing = false;  // In each frame.
  Sizes sizes = Sizes::kEqual;
  Boundary boundary = Boundary::kBulk;
  bool has_phases = false;
};

// A lattice that is fine enough for the smallest of VaryingVolumes as grains.
constexpr double kCellOfGrains = .8;

// Phases of particles: stripes of both, then spray of the second one.
std::vector<float> StripedPhases(const Particles& particles) {
  std::vector<float> phases(particles.size());
  for (std::size_t k = 0; k < phases.size(); ++k) {
    phases[k] = std::fmod(std::abs(particles.x(k)), 40) < 20 && k % 50 > 0 ? 1 : 2;
  }
  return phases;
}

// Volumes of particles whose sizes differ by a factor of up to three.
std::vector<float> VaryingVolumes(std::size_t count) {
  std::vector<float> volumes(count);
  for (std::size_t k = 0; k < count; ++k) volumes[k] = .4f + static_cast<float>(k % 7) / 2;
  return volumes;
}

void PrintTo(const AllocationCase& tested, std::ostream* out) {
  *out << Name(tested.placement) << ", " << Name(tested.fill) << ", " << tested.threads
       << " threads" << (tested.volumes ? ", volumes" : "") << (tested.ids ? ", ids" : "")
       << (tested.estimates_spacing ? ", spacing estimated" : "") << ", sizes "
       << Name(tested.sizes) << ", boundary " << Name(tested.boundary)
       << (tested.has_phases ? ", phases" : "");
}

// Computes `frames` frames again and again; expects that the last round allocates nothing.
// `compute(k, workspace)` computes frame k.
template <class Compute>
void ExpectWarm(std::size_t frames, int rounds, int threads, const Compute& compute) {
  tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                              static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  Workspace workspace;
  std::size_t before = 0;
  for (int round = 0; round < rounds; ++round) {
    before = allocations;
    for (std::size_t k = 0; k < frames; ++k) {
      arena.execute([&] {
        const absl::Status status = compute(k, workspace);
        ASSERT_TRUE(status.ok()) << status;
      });
    }
    if (round == 0) {
      EXPECT_GT(allocations, before) << "nothing is counted";
    }
  }
  EXPECT_EQ(allocations - before, 0u) << "in " << frames << " frames";
}

class WarmFrame : public testing::TestWithParam<AllocationCase> {};

TEST_P(WarmFrame, AllocatesNothing) {
  const AllocationCase& tested = GetParam();
  ReconstructionParameters parameters{.placement = tested.placement,
                                      .fill = tested.fill,
                                      .sizes = tested.sizes,
                                      .boundary = tested.boundary,
                                      .min_component_particles = 3};
  if (tested.boundary == Boundary::kGrains) parameters.cell_size = kCellOfGrains;
  if (tested.estimates_spacing) {
    parameters.spacing_rule = SpacingRule::kEveryFrame;
  } else {
    parameters.spacing = 1.0;
  }
  if (tested.has_phases) parameters.sections = {{.phase = 1}, {.phase = 2}};
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok());
  // Bodies that meet and part, spray, holes that cleaning fills, more than one stretch of
  // particles; then few particles, then none.
  std::vector<Particles> frames;
  for (int k = 0; k < 4; ++k) {
    support::Random random(static_cast<std::uint64_t>(k));
    Particles frame = support::Disc(75);
    frame.Add(support::Shifted(support::Blob(random, 12), 73 + 6 * k, 5));
    frame.Add(support::Shifted(support::Noise(random, 200, 60), -200, 150));
    if (tested.volumes) frame.volumes.assign(frame.size(), 1.0f);
    if (tested.sizes == Sizes::kOwn) frame.volumes = VaryingVolumes(frame.size());
    for (std::size_t id = 0; tested.ids && id < frame.size(); ++id) {
      // Numbers without and with large gaps; frames that follow each other know their particles.
      frame.ids.push_back(k < 2 ? id : id << 32);
    }
    if (tested.has_phases) frame.phases = StripedPhases(frame);
    frames.push_back(frame);
  }
  frames.insert(frames.begin() + 2, {support::Disc(5), Particles()});
  if (tested.sizes == Sizes::kOwn) frames[2].volumes = VaryingVolumes(frames[2].size());
  if (tested.has_phases) frames[2].phases = StripedPhases(frames[2]);
  const std::vector<float> values = NoisyValues(2 * frames[0].size() + 4000);
  State state;
  Result result;
  // Until the offset of the area, which moves by little a frame, comes back to where it was.
  constexpr int kRounds = 24;
  ExpectWarm(frames.size(), kRounds, tested.threads, [&](std::size_t k, Workspace& workspace) {
    const std::size_t count = frames[k].size();
    const std::array<Attribute, 3> attributes = {
        {{"pressure", 1, std::span(values).first(count)},
         {"velocity", 2, std::span(values).first(2 * count)},
         {"phase", 1, frames[k].phases}}};
    Frame next = frames[k].AsFrame();
    if (tested.ids) next.attributes = std::span(attributes).first(tested.has_phases ? 3 : 2);
    return reconstructor->Reconstruct(next, state, workspace, result);
  });
  EXPECT_GT(result.rings.RingCount(), 1u);
}

TEST(WarmSlice, AllocatesNothing) {
  ReconstructionParameters parameters{.spacing = 1, .slice = SlicePlane{.origin = {0, 0, 4}}};
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok());
  std::vector<double> xyz;
  std::vector<float> pressure, volumes;
  std::vector<std::uint64_t> ids;
  for (int k = 0; k < 40 * 40 * 12; ++k) {
    xyz.insert(xyz.end(), {k % 40 + 0.5, k / 40 % 40 + 0.25, k / 1600 + 0.5});
    pressure.push_back(static_cast<float>(k));
    volumes.push_back(1);
    ids.push_back(static_cast<std::uint64_t>(k));
  }
  const std::vector<Attribute> attributes = {{"pressure", 1, pressure}};
  State state;
  Result result;
  ExpectWarm(1, 6, 1, [&](std::size_t, Workspace& workspace) {
    return reconstructor->Reconstruct({.positions = std::span<const double>(xyz),
                                       .components = 3,
                                       .volumes = volumes,
                                       .ids = ids,
                                       .attributes = attributes},
                                      state, workspace, result);
  });
  EXPECT_EQ(result.rings.RingCount(), 1u);
}

// Bodies that cross the faces of a periodic box, without and with a layer that percolates, and
// with phases.
class WarmPeriodicFrame : public testing::TestWithParam<std::tuple<bool, Sizes, bool>> {};
INSTANTIATE_TEST_SUITE_P(Percolates, WarmPeriodicFrame,
                         testing::Combine(testing::Bool(),
                                          testing::Values(Sizes::kEqual, Sizes::kOwn),
                                          testing::Bool()));

TEST_P(WarmPeriodicFrame, AllocatesNothing) {
  const auto [percolates, sizes, has_phases] = GetParam();
  ReconstructionParameters parameters{
      .spacing = 1.0,
      .sizes = sizes,
      .box = PeriodicBox{.axes = {PeriodicAxis{0, 90.5}, PeriodicAxis{0, 80}}}};
  if (has_phases) parameters.sections = {{.phase = 1}, {.phase = 2}};
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok());
  std::vector<Particles> frames;
  for (int k = 0; k < 4; ++k) {
    Particles frame = support::Disc(12, 20.0 * k, 9.0 * k);
    frame.Add(support::Disc(8, 45 - 20.0 * k, 40 + 5.0 * k));
    if (percolates) frame.Add(support::Lattice(90, 12 + k, .3, 60));
    for (std::size_t id = 0; id < frame.size(); ++id) frame.ids.push_back(id);
    if (sizes == Sizes::kOwn) frame.volumes = VaryingVolumes(frame.size());
    if (has_phases) frame.phases = StripedPhases(frame);
    frames.push_back(frame);
  }
  State state;
  Result result;
  const int rounds = sizes == Sizes::kOwn || has_phases ? 24 : 12;  // As in WarmFrame.
  ExpectWarm(frames.size(), rounds, 1, [&](std::size_t k, Workspace& workspace) {
    return reconstructor->Reconstruct(frames[k].AsFrame(), state, workspace, result);
  });
  if (!percolates) {
    EXPECT_EQ(result.rings.RingCount(), 2u);
  }
  EXPECT_EQ(result.statistics.cut_bodies, percolates ? 1u : 0u);
}

// Each frame has another box.
TEST(WarmFrameBox, AllocatesNothing) {
  const auto reconstructor =
      Reconstructor::Create({.spacing = 1.0,
                             .sections = {{.isovalue = .4}},
                             .box = PeriodicBox{.axes = {PeriodicAxis{0, 90}, PeriodicAxis{0, 80}}},
                             .noise_filter = .5});
  ASSERT_TRUE(reconstructor.ok());
  std::vector<Particles> frames;
  for (int k = 0; k < 4; ++k) {
    frames.push_back(support::Disc(12, 3.0 * k, 2.0 * k));
    frames[k].Add(support::Lattice(90, 5 + k, .3, 40));
    for (std::size_t id = 0; id < frames[k].size(); ++id) frames[k].ids.push_back(id);
  }
  State state;
  Result result;
  ExpectWarm(frames.size(), 40, 1, [&](std::size_t k, Workspace& workspace) {
    Frame frame = frames[k].AsFrame();
    frame.box = PeriodicBox{
        .axes = {PeriodicAxis{.1 * k, 90 + .9 * k}, PeriodicAxis{-.1 * k, 80 - .7 * k}}};
    return reconstructor->Reconstruct(frame, state, workspace, result);
  });
  EXPECT_TRUE(state.history.box.has_value());
}

// Bodies that slide along a floor around an obstacle, with walls as lines and as particles, also in
// a periodic box.
class WarmFrameAtWalls : public testing::TestWithParam<std::tuple<bool, bool>> {};
INSTANTIATE_TEST_SUITE_P(AreParticlesInBox, WarmFrameAtWalls,
                         testing::Combine(testing::Bool(), testing::Bool()));

TEST_P(WarmFrameAtWalls, AllocatesNothing) {
  const auto [are_particles, in_box] = GetParam();
  ReconstructionParameters parameters{.spacing = 1.0};
  if (in_box) parameters.box = PeriodicBox{.axes = {PeriodicAxis{-20, 120}}};
  if (are_particles) {
    parameters.wall_phases = {2};
  } else {
    parameters.walls = {{{0, 0, 1, 0}}, {{20, 6, 24, 12, 28, 6}}};
  }
  const auto reconstructor = Reconstructor::Create(parameters);
  ASSERT_TRUE(reconstructor.ok());
  std::vector<Particles> frames;
  for (int k = 0; k < 4; ++k) {
    Particles frame = support::Lattice(40 + 3 * k, 20 - k, .5, .5);
    frame.Add(support::Disc(6, 70.0 - 3 * k, 3));
    frame.phases.assign(frame.size(), 1);
    if (are_particles) {
      frame.Add(support::Lattice(120, 2, -20.5, -1.5));
      frame.phases.resize(frame.size(), 2);
    }
    for (std::size_t id = 0; id < frame.size(); ++id) frame.ids.push_back(id);
    frames.push_back(frame);
  }
  State state;
  Result result;
  ExpectWarm(frames.size(), 40, 1, [&](std::size_t k, Workspace& workspace) {
    return reconstructor->Reconstruct(frames[k].AsFrame(), state, workspace, result);
  });
  EXPECT_GE(result.rings.contacts.size(), 2u);
}

// A disc that moves, given in another order each time, with noise.
TEST(WarmFilteredFrame, AllocatesNothing) {
  const auto reconstructor = Reconstructor::Create(
      {.spacing = 1.0,
       .box = PeriodicBox{.axes = {PeriodicAxis{0, 90.5}, PeriodicAxis{0, 80}}},
       .noise_filter = .5});
  ASSERT_TRUE(reconstructor.ok());
  support::Random random(3);
  std::vector<Particles> frames;
  for (int k = 0; k < 4; ++k) {
    Particles frame = support::Disc(12, .4 * k, .3 * k);
    for (double& at : frame.xy) at += random.Uniform(-.1, .1);
    for (std::size_t id = 0; id < frame.size(); ++id) frame.ids.push_back(id);
    frames.push_back(support::Permuted(frame, random));
  }
  State state;
  Result result;
  ExpectWarm(frames.size(), 40, 1, [&](std::size_t k, Workspace& workspace) {
    return reconstructor->Reconstruct(frames[k].AsFrame(), state, workspace, result);
  });
  EXPECT_EQ(state.noise.ids.size(), frames[3].size());
}

std::vector<AllocationCase> Cases() {
  std::vector<AllocationCase> cases;
  for (const Placement placement : AllPlacements()) {
    for (const Fill fill : AllFills()) {
      for (const int threads : {1, 2}) {
        cases.push_back({placement, fill, threads, threads == 1, threads == 2});
      }
    }
  }
  for (const int threads : {1, 2}) {
    cases.push_back({Placement::kVirtualPlane, Fill::kGreedy, threads, false, false, true});
    cases.push_back(
        {Placement::kVirtualPlane, Fill::kGreedy, threads, true, threads == 2, false, Sizes::kOwn});
    cases.push_back(cases.back());
    cases.back().boundary = Boundary::kGrains;
    cases.back().ids = false;
    cases.push_back({Placement::kVirtualPlane, Fill::kGreedy, threads, threads == 1, threads == 2});
    cases.back().has_phases = true;
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(PlacementsAndFills, WarmFrame, testing::ValuesIn(Cases()),
                         [](const auto& tested) {
                           std::string name(Name(tested.param.placement));
                           std::erase(name, '-');
                           return name + "_" + std::string(Name(tested.param.fill)) +
                                  std::to_string(tested.param.threads) +
                                  (tested.param.estimates_spacing ? "_spacing" : "") +
                                  (tested.param.sizes == Sizes::kOwn ? "_sizes" : "") +
                                  (tested.param.boundary == Boundary::kGrains ? "_grains" : "") +
                                  (tested.param.has_phases ? "_phases" : "");
                         });

struct MemoryCase {
  std::string name;
  Particles particles;
  ReconstructionParameters parameters;
  enum { kNothing, kConstants, kNoise } carries = kNothing;  // Attributes.
};

// Frames that differ in their largest consumer of memory.
std::vector<MemoryCase> MemoryCases() {
  std::vector<MemoryCase> cases;
  const auto add = [&](std::string name, const Particles& particles,
                       ReconstructionParameters parameters = {}) {
    parameters.spacing = 1;
    cases.push_back({name, particles, parameters});
    cases.push_back({absl::StrCat(name, ", ids"), particles, parameters});
    for (std::size_t k = 0; k < particles.size(); ++k) cases.back().particles.ids.push_back(k);
    cases.push_back(
        {absl::StrCat(name, ", constants"), particles, parameters, MemoryCase::kConstants});
    cases.push_back({absl::StrCat(name, ", noise"), particles, parameters, MemoryCase::kNoise});
  };
  const auto spread = [](int side, double distance, double x0 = 0) {
    return support::Scaled(support::Lattice(side, side, x0 / distance, x0 / distance), distance);
  };
  Particles islands;
  for (int k = 0; k < 400; ++k) islands.Add(support::Disc(7.5, k % 20 * 30, k / 20 * 30));
  support::Random random(3);
  add("corners of tiles", spread(90, 64));
  add("middles of tiles", spread(60, 96, 16));
  add("one body", support::Disc(300));
  add("one body, grid", support::Disc(300), {.fill = Fill::kGrid});
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
  add("body of own sizes", sized(support::Disc(300)), {.sizes = Sizes::kOwn});
  add("drops of own sizes", sized(spread(150, 5)), {.sizes = Sizes::kOwn});
  const auto phased = [](Particles particles) {
    particles.phases = StripedPhases(particles);
    return particles;
  };
  const std::vector<Section> phases = {{.phase = 1}, {.phase = 2}};
  add("body of two phases", phased(support::Disc(300)), {.sections = phases});
  add("drops of two phases", phased(spread(150, 5)), {.sections = phases});
  const std::vector<Wall> tank = {support::PolygonWall(0, 0, 280, 1000, 0, true)};
  add("body in a round tank", support::Disc(300), {.walls = tank});
  add("drops at walls", spread(150, 5),
      {.walls = {{{0, 7, 1, 7}}, {{7, 1, 7, 0}}, {{0, 0, 1, 1}}}});
  add("drops among wall particles", phased(spread(150, 1.2)), {.wall_phases = {2}});
  add("body among wall particles", phased(support::Disc(300)), {.wall_phases = {2}});
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
    add(name, particles, {.noise_filter = .5});
    std::erase_if(cases, [](const MemoryCase& tested) {
      return tested.parameters.noise_filter && tested.particles.ids.empty();
    });
  }
  return cases;
}

TEST(MemoryGuard, IsToldNoLessThanAFrameTakesAndNotMuchMore) {
  for (const MemoryCase& tested : MemoryCases()) {
    SCOPED_TRACE(tested.name);
    const auto reconstructor = Reconstructor::Create(tested.parameters);
    ASSERT_TRUE(reconstructor.ok());
    std::vector<float> values(3 * tested.particles.size(), 1.0f);
    if (tested.carries == MemoryCase::kNoise) values = NoisyValues(values.size());
    const std::array<Attribute, 4> attributes = {{{"a", 3, values},
                                                  {"b", 3, values},
                                                  {"c", 3, values},
                                                  {"phase", 1, tested.particles.phases}}};
    Frame frame = tested.particles.AsFrame();
    if (tested.carries != MemoryCase::kNothing) {
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
    if (tested.carries == MemoryCase::kConstants) continue;
    EXPECT_GE(2.5 * static_cast<double>(held), static_cast<double>(guard.last()));
  }
}

TEST(MemoryGuard, RefusesAFrameBeforeItsTilesTakeMemory) {
  const MemoryCase tested = MemoryCases().front();
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
