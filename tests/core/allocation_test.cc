// Allocations of outlines: a frame like one before must allocate nothing.
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
#include "core/varied_particles.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/particles.h"
#include "support/wall_scenes.h"

namespace partiemc {
namespace {

using support::allocations;
using support::kCellOfGrains;
using support::NoisyValues;
using support::Particles;
using support::StripedPhases;
using support::VaryingVolumes;

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
// a periodic box, of own sizes, and of two phases.
enum class Matter { kPlain, kSized, kPhases };
class WarmFrameAtWalls : public testing::TestWithParam<std::tuple<bool, bool, Matter>> {};
INSTANTIATE_TEST_SUITE_P(AreParticlesInBox, WarmFrameAtWalls,
                         testing::Combine(testing::Bool(), testing::Bool(),
                                          testing::Values(Matter::kPlain, Matter::kSized,
                                                          Matter::kPhases)));

TEST_P(WarmFrameAtWalls, AllocatesNothing) {
  const auto [are_particles, in_box, matter] = GetParam();
  ReconstructionParameters parameters{.spacing = 1.0};
  if (matter == Matter::kSized) parameters.sizes = Sizes::kOwn;
  if (matter == Matter::kPhases) parameters.sections = {{.phase = 1}, {.phase = 3}};
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
    if (matter == Matter::kSized) frame.volumes = VaryingVolumes(frame.size());
    for (std::size_t i = 0; i < frame.size(); i += 3) {
      if (matter == Matter::kPhases && frame.phases[i] == 1) frame.phases[i] = 3;
    }
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

}  // namespace
}  // namespace partiemc
