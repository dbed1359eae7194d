// Boxes that change from frame to frame (core/PERIODIC.md, "Boxes that change").
#include "periodic/frame_box.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "core/boxes.h"
#include "partiemc/partiemc.h"
#include "partiemc/status.h"
#include "support/reconstruct.h"
#include "support/ring_stream.h"
#include "support/tracked_scene.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::Particles;
using support::Random;
using support::RingStream;
using testing::ElementsAre;

// The length changes by 1 % a frame, back and forth: by up to 6 % from the length of the stream.
double StretchAt(int frame) {
  const int step = frame % 24;
  return std::pow(1.01, step < 6 ? step : step < 18 ? 12 - step : step - 24);
}

// A box and particles, stretched about the centre of the box, as a barostat does. The particles are
// wrapped into the box. Volumes grow, too, so that areas are those of the particles.
struct Breathing {
  Particles particles;
  PeriodicBox box;

  Breathing(const Particles& given, const PeriodicBox& of_stream, double x, double y)
      : particles(given), box(of_stream) {
    for (std::size_t k = 0; k < 2; ++k) {
      auto& [origin, length] = *box.axes[k];
      const double stretch = k == 0 ? x : y, centre = origin + .5 * length;
      for (std::size_t p = 0; p < particles.size(); ++p) {
        double& at = particles.xy[2 * p + k];
        at = centre + stretch * (at - centre);
      }
      length *= stretch;
      origin = centre - .5 * length;
    }
    particles = Wrapped(particles, box);
    particles.volumes.assign(particles.size(), static_cast<float>(x * y));
  }

  Frame AsFrame() const {
    Frame frame = particles.AsFrame();
    frame.box = box;
    return frame;
  }
};

Particles WithIds(Particles particles) {
  for (std::size_t k = 0; k < particles.size(); ++k) particles.ids.push_back(3 * k + 1);
  return particles;
}

TEST(FrameBox, BoxOfTheStreamChangesNoBit) {
  const PeriodicBox box = BoxOf(60.3, 50, -3, 2);
  for (const bool wraps : {false, true}) {
    ReconstructionParameters parameters = In(box);
    parameters.box->wraps = wraps;
    parameters.noise_filter = .5;
    parameters.sections = {{.isovalue = .4}};
    RingStream with(parameters), without(parameters);
    for (int frame = 0; frame < 3; ++frame) {
      Particles scene = support::Disc(7, 2 * frame, 49);
      scene.Add(support::Lattice(60, 4, -3, 30));
      scene = WithIds(Wrapped(scene, box));
      Frame boxed = scene.AsFrame();
      boxed.box = box;
      with.Next(boxed);
      without.Next(scene);
      EXPECT_EQ(with.result(), without.result());
      EXPECT_EQ(with.state(), without.state());
      EXPECT_EQ(Serialize(with.state()), Serialize(without.state()));
    }
  }
}

using BreathingCase = std::tuple<support::Known, bool>;
class BreathingBox : public testing::TestWithParam<BreathingCase> {};
INSTANTIATE_TEST_SUITE_P(With, BreathingBox,
                         testing::Combine(testing::Values(support::kNothing, support::kIds,
                                                          support::kVelocities, support::kBoth),
                                          testing::Bool()));

// A disc across the corner, an annulus across a face and a layer, in a box so wide that faces move
// by more than a disc in a frame.
TEST_P(BreathingBox, BodiesKeepIdentitiesAndAreas) {
  const auto [known, wraps] = GetParam();
  PeriodicBox box = BoxOf(2400.3, 1500.7, -70, 11);
  box.wraps = wraps;
  Particles scene = support::Disc(5, -70, 11);
  scene.Add(support::Shifted(support::Annulus(4, 9), 300, 12));
  for (int k = 0; k < 2400 * 4; ++k) scene.Add(-69.8 + 2400.3 / 2400 * (k % 2400), 160 + k / 2400);
  if (known.ids) scene = WithIds(scene);
  if (known.velocities) scene.velocities.assign(2 * scene.size(), 0.f);
  RingStream stream(In(box));
  std::vector<std::uint64_t> first;
  double first_area = 0;
  std::uint64_t particles = 0;
  for (int frame = 0; frame < 50; ++frame) {
    SCOPED_TRACE(frame);
    const double x = StretchAt(frame), y = StretchAt(2 * frame);
    Breathing now(scene, box, x, y);
    now.particles.time = frame;
    const Rings& rings = stream.Next(now.AsFrame());
    ExpectValid(stream.result(), Fill::kGreedy);
    std::vector<std::uint64_t> identities;
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      const std::uint64_t identity = rings.measures[ring].identity;
      if (identity == 0) continue;  // A smaller piece of a wrapped body.
      identities.push_back(identity);
      if (frame > 0) {
        EXPECT_THAT(rings.ParentsOf(ring), ElementsAre(identity));
      }
    }
    std::ranges::sort(identities);
    if (frame == 0) first = identities;
    EXPECT_EQ(identities, first);
    EXPECT_EQ(identities.size(), wraps ? 3u : 4u);  // A hole across a face is a notch.
    const double area = stream.result().statistics.area / (x * y);
    if (frame == 0) first_area = area, particles = ParticlesOf(rings);
    EXPECT_NEAR(area, first_area, 3e-3 * first_area);
    EXPECT_EQ(ParticlesOf(rings), particles);
    if (!wraps) continue;
    for (std::size_t k = 0; k < rings.points.size(); ++k) {
      const auto& [origin, length] = *now.box.axes[k % 2];
      EXPECT_GE(rings.points[k], origin - 1e-6);
      EXPECT_LE(rings.points[k], origin + length + 1e-6);
    }
  }
}

// Without a box of the frame, its areas and digests are those of a stream with this box.
TEST(FrameBox, ReplacesTheBoxOfTheStream) {
  Random random(4);
  Particles scene = support::Shifted(support::Blob(random, 7), 1, 2);
  scene.Add(support::Lattice(50, 3, 0, 25));
  const PeriodicBox box = BoxOf(50, 44.4, .3, -.2);
  scene = Wrapped(scene, box);
  RingStream other(In(BoxOf(71, 80, 5, 6))), same(In(box));
  Frame frame = scene.AsFrame();
  frame.box = box;
  other.Next(frame);
  same.Next(scene);
  EXPECT_EQ(other.result(), same.result());
  EXPECT_TRUE(other.state().history.box.has_value());
  EXPECT_FALSE(same.state().history.box.has_value());
}

TEST(FrameBox, WrongBoxesAreRefused) {
  const Particles disc = support::Disc(5, 20, 20);
  const PeriodicBox box = BoxOf(40, 50);
  const auto field_of = [&](const std::optional<PeriodicBox>& of_stream, const PeriodicBox& given) {
    ReconstructionParameters parameters = In(box);
    parameters.box = of_stream;
    RingStream stream(parameters);
    stream.Next(disc);
    const State before = stream.state();
    Frame frame = disc.AsFrame();
    frame.box = given;
    Result result;
    Workspace workspace;
    const absl::Status status =
        Reconstructor::Create(parameters)->Reconstruct(frame, stream.state(), workspace, result);
    EXPECT_EQ(stream.state() == before, !status.ok());
    const auto violation = FindViolation(status);
    return violation ? violation->field : status.ToString();
  };
  EXPECT_EQ(field_of(box, BoxOf(41, 50)), "OK");
  EXPECT_EQ(field_of(std::nullopt, box), "box");
  EXPECT_EQ(field_of(box, {.axes = {PeriodicAxis{0, 40}}}), "box.y");
  EXPECT_EQ(field_of(box, {}), "box.x");
  EXPECT_EQ(field_of(PeriodicBox{.axes = {PeriodicAxis{0, 40}}}, box), "box.y");
  for (const double length : {0.0, -1.0, 11.99, 1.1e8, std::nan("")}) {
    EXPECT_EQ(field_of(box, BoxOf(length, 50)), "box.x.length");
  }
  EXPECT_EQ(field_of(box, BoxOf(40, 50, std::nan(""))), "box.x.origin");
}

// Faces move by 3 h a frame. A particle that moves with the box is where it is given.
TEST(FrameBox, NoiseFilterFollowsTheBox) {
  PeriodicBox box = BoxOf(600, 60);
  ReconstructionParameters parameters = In(box);
  RingStream plain(parameters);
  parameters.noise_filter = .5;
  RingStream filtered(parameters);
  const Particles disc = WithIds(support::Disc(9, 2, 30));
  for (int frame = 0; frame < 12; ++frame) {
    SCOPED_TRACE(frame);
    const Breathing now(disc, box, StretchAt(frame), 1);
    plain.Next(now.AsFrame());
    filtered.Next(now.AsFrame());
    ASSERT_EQ(filtered.rings().RingCount(), 1u);
    ASSERT_EQ(plain.rings().points.size(), filtered.rings().points.size());
    for (std::size_t k = 0; k < plain.rings().points.size(); ++k) {
      EXPECT_NEAR(plain.rings().points[k], filtered.rings().points[k], 1e-5);
    }
    // Each particle was known: its offset is tiny, but not exactly 0.
    if (frame == 0) continue;
    const std::vector<float>& offsets = filtered.state().noise.offsets;
    EXPECT_GT(std::ranges::count_if(offsets, [](float offset) { return offset != 0; }), 100);
  }
}

// The restored state continues the stream with the same bits.
TEST(FrameBox, StateHoldsTheBox) {
  const PeriodicBox box = BoxOf(300, 60);
  ReconstructionParameters parameters = In(box);
  parameters.noise_filter = .5;
  parameters.sections = {{.isovalue = .4}};
  RingStream stream(parameters), resumed(parameters);
  const Particles disc = WithIds(support::Disc(9, 0, 30));
  stream.Next(Breathing(disc, box, 1.01, .99).AsFrame());
  const std::string bytes = Serialize(stream.state());
  EXPECT_EQ(bytes.size(), SerializedBytes(stream.state()));
  auto state = ParseState(bytes);
  ASSERT_TRUE(state.ok()) << state.status();
  EXPECT_EQ(*state, stream.state());
  EXPECT_TRUE(state->history.box && state->noise.box && state->sections[0].history.box);
  for (std::size_t k = 0; k < bytes.size(); k += 7) {  // Damaged bytes are refused.
    EXPECT_FALSE(ParseState(bytes.substr(0, k)).ok());
  }
  // Without particles, too.
  RingStream empty(parameters);
  Frame nothing;
  nothing.box = BoxOf(310, 60);
  empty.Next(nothing);
  EXPECT_TRUE(ParseState(Serialize(empty.state())).ok());
  resumed.state() = *state;
  const Breathing next(disc, box, 1.03, .98);
  stream.Next(next.AsFrame());
  resumed.Next(next.AsFrame());
  EXPECT_EQ(stream.result(), resumed.result());
  EXPECT_EQ(stream.state(), resumed.state());
}

// Boxes that leap, shrink and grow: every result keeps its guarantees.
TEST(FrameBox, RandomBoxesKeepTheGuarantees) {
  for (std::uint64_t seed = 1; seed <= support::Tries(60u); ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    PeriodicBox box = BoxOf(30, 30);
    box.wraps = seed % 2 == 0;
    ReconstructionParameters parameters = In(box);
    if (seed % 3 == 0) parameters.noise_filter = .5;
    RingStream stream(parameters);
    const auto count = static_cast<std::size_t>(random.Uniform(5, 900));
    for (int frame = 0; frame < 4; ++frame) {
      const PeriodicBox now = BoxOf(random.Uniform(12, 50), random.Uniform(12, 50),
                                    random.Uniform(-20, 20), random.Uniform(-20, 20));
      Particles scene;
      for (std::size_t k = 0; k < count; ++k) {
        const double x = random.Uniform(0, 1), y = random.Uniform(0, 1);
        scene.Add(now.axes[0]->origin + x * now.axes[0]->length,
                  now.axes[1]->origin + y * now.axes[1]->length);
      }
      scene = WithIds(scene);
      Frame view = scene.AsFrame();
      view.box = now;
      stream.Next(view);
      ExpectValid(stream.result(), Fill::kGreedy);
    }
  }
}

// Damaged states may hold any finite box.
TEST(BoxMotion, NodesStayInRange) {
  const BoxMotion motion = MotionOf(BoxOf(1e-300, 1, -1e300), std::nullopt, BoxOf(1e300, 1), 1e-9);
  EXPECT_TRUE(motion.any);
  for (const double node : {-2e9, 0.0, 2e9}) {
    std::int32_t first = motion.NodeAt(0, node), last = first;
    motion.MoveRun(0, first, last);
    EXPECT_LE(first, last);
  }
  const BoxMotion twice = MotionOf(BoxOf(10, 1), std::nullopt, BoxOf(20, 1, 3), 1);
  EXPECT_EQ(twice.NodeAt(0, 4), 11);
  std::int32_t first = 4, last = 6;
  twice.MoveRun(0, first, last);
  EXPECT_EQ(first, 12);
  EXPECT_EQ(last, 14);
  EXPECT_FALSE(MotionOf(BoxOf(10, 1), BoxOf(20, 1), BoxOf(20, 1), 1).any);
}

}  // namespace
}  // namespace partiemc
