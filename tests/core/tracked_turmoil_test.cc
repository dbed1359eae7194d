// Identities of rings in scenes where everything leaps, splits and merges, if particles have ids or
// velocities.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "partiemc/partiemc.h"
#include "support/ring_stream.h"
#include "support/tracked_scene.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::kBoth;
using support::kIds;
using support::kNothing;
using support::Known;
using support::kVelocities;
using support::Particles;
using support::RingStream;
using support::Scene;

class TrackedTurmoil : public testing::TestWithParam<Known> {};
INSTANTIATE_TEST_SUITE_P(With, TrackedTurmoil, testing::Values(kIds, kVelocities, kBoth),
                         testing::PrintToStringParamName());

// Discs of all sizes that fly apart and together, three to fifteen spacings a frame.
Particles Turmoil(Known known, std::uint64_t seed, int frame) {
  support::Random random(seed);
  Scene scene(known, 0.25 * frame);
  for (std::uint64_t k = 0; k < 100; ++k) {
    const double x = random.Uniform(0, 150), y = random.Uniform(0, 150);
    const double vx = random.Uniform(-10, 10), vy = random.Uniform(-10, 10);
    // Moves around in a box of 150, so that rings merge and split again.
    const auto wrapped = [](double value) { return value - 150 * std::floor(value / 150); };
    scene.Add(
        support::Disc(random.Uniform(0.5, 6), wrapped(x + vx * frame), wrapped(y + vy * frame)),
        1000 * k, 4 * vx, 4 * vy);
  }
  return scene;
}

void ExpectSameOutlines(const Result& a, const Result& b) {
  EXPECT_EQ(a.rings.points, b.rings.points);
  EXPECT_EQ(a.rings.offsets, b.rings.offsets);
  EXPECT_EQ(a.rings.outer_of, b.rings.outer_of);
  EXPECT_EQ(a.rings.normals, b.rings.normals);
  EXPECT_EQ(a.mesh, b.mesh);
  EXPECT_EQ(a.statistics, b.statistics);
  EXPECT_EQ(DigestRings(a.rings), DigestRings(b.rings));
  ASSERT_EQ(a.rings.measures.size(), b.rings.measures.size());
  for (std::size_t ring = 0; ring < a.rings.measures.size(); ++ring) {
    RingMeasures same = a.rings.measures[ring];
    same.identity = b.rings.measures[ring].identity;
    EXPECT_EQ(same, b.rings.measures[ring]);
  }
}

// Ids and velocities change identities and nothing else.
TEST(TrackedTurmoilOf100Discs, IdsAndVelocitiesChangeNoOutline) {
  for (const Placement placement : AllPlacements()) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      const ReconstructionParameters parameters{.placement = placement};
      RingStream plain(parameters), ids(parameters), velocities(parameters), both(parameters);
      for (int frame = 0; frame < 5; ++frame) {
        plain.Next(Turmoil(kNothing, seed, frame));
        ids.Next(Turmoil(kIds, seed, frame));
        velocities.Next(Turmoil(kVelocities, seed, frame));
        both.Next(Turmoil(kBoth, seed, frame));
        for (const RingStream* const tracked : {&ids, &velocities, &both}) {
          ExpectSameOutlines(tracked->result(), plain.result());
          EXPECT_EQ(tracked->state().normals, plain.state().normals);
          EXPECT_EQ(tracked->state().area_offset, plain.state().area_offset);
        }
      }
    }
  }
}

TEST_P(TrackedTurmoil, OrderThreadsAndRestartsHaveNoEffect) {
  for (std::uint64_t seed = 1; seed <= support::Tries(3u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    RingStream stream, permuted, restored;
    support::Random random(seed);
    for (int frame = 0; frame < 8; ++frame) {
      const Particles particles = Turmoil(GetParam(), seed, frame);
      const Rings& expected = stream.Next(particles);
      const Rings& other = permuted.Next(support::Permuted(particles, random));
      ASSERT_EQ(other.RingCount(), expected.RingCount());
      for (std::size_t ring = 0; ring < expected.RingCount(); ++ring) {
        EXPECT_EQ(other.measures[ring].identity, expected.measures[ring].identity);
      }
      EXPECT_EQ(other.parents, expected.parents);
      EXPECT_EQ(permuted.state().history, stream.state().history);
      auto state = ParseState(Serialize(restored.state()));
      ASSERT_TRUE(state.ok()) << state.status();
      EXPECT_EQ(*state, restored.state());
      restored.state() = *std::move(state);
      constexpr int kThreads[] = {1, 2, 7};
      tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(kThreads[frame % 3]));
      tbb::task_arena arena(kThreads[frame % 3]);
      arena.execute([&] { restored.Next(particles); });
      EXPECT_EQ(restored.rings(), expected);
      EXPECT_EQ(restored.state(), stream.state());
    }
  }
}

TEST(TrackedTurmoilOf100Discs, IdsAndVelocitiesReduceOrphans) {
  struct Count {
    std::uint64_t identities = 0, orphans = 0;  // Orphans have no known parent.
  };
  const auto births = [](Known known) {
    Count count;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      RingStream stream;
      for (int frame = 0; frame < 8; ++frame) {
        const std::uint64_t given = stream.state().history.identities_given;
        const Rings& rings = stream.Next(Turmoil(known, seed, frame));
        if (frame == 0) continue;
        count.identities += stream.state().history.identities_given - given;
        for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
          count.orphans += rings.outer_of[ring] == kNoRing && rings.ParentsOf(ring).empty();
        }
      }
    }
    RecordProperty(testing::PrintToString(known), std::to_string(count.identities) + " born, " +
                                                      std::to_string(count.orphans) +
                                                      " of nothing");
    return count;
  };
  const Count blind = births(kNothing), by_velocities = births(kVelocities), by_ids = births(kIds);
  EXPECT_LT(by_velocities.identities, blind.identities * 2 / 3);
  EXPECT_LT(by_ids.identities, blind.identities * 2 / 3);
  EXPECT_LT(by_velocities.orphans, blind.orphans / 5);
  EXPECT_LT(by_ids.orphans, blind.orphans / 5);
}

// The particles inside an outer ring and outside its holes, by the parity of crossings to the
// right.
std::set<std::uint64_t> ParticlesIn(const Rings& rings, std::size_t outer,
                                    const Particles& particles) {
  std::set<std::uint64_t> ids;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double x = particles.x(k), y = particles.y(k);
    bool inside = false;
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      if (ring != outer && rings.outer_of[ring] != outer) continue;
      const auto points = rings.RingPoints(ring);
      for (std::size_t i = 0, j = points.size() - 2; i < points.size(); j = i, i += 2) {
        if ((points[i + 1] > y) == (points[j + 1] > y)) continue;
        const double part = (y - points[i + 1]) / (points[j + 1] - points[i + 1]);
        if (points[i] + part * (points[j] - points[i]) > x) inside = !inside;
      }
    }
    if (inside) ids.insert(particles.ids[k]);
  }
  return ids;
}

// Compares reported parents with the particles that outer rings of two frames share.
struct Parentage {
  int told = 0, wrong = 0;        // Without a particle in common.
  int relations = 0, missed = 0;  // With a quarter of the smaller one's particles in common.
};

Parentage CompareParents(Known known) {
  Parentage sum;
  for (std::uint64_t seed = 1; seed <= support::Tries(2u); ++seed) {
    RingStream stream;
    std::map<std::uint64_t, std::set<std::uint64_t>> before;
    for (int frame = 0; frame < 8; ++frame) {
      const Rings& rings = stream.Next(Turmoil(known, seed, frame));
      const Particles particles = Turmoil(kIds, seed, frame);
      std::map<std::uint64_t, std::set<std::uint64_t>> now;
      for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
        if (rings.outer_of[ring] != kNoRing) continue;
        const auto& inside = now[rings.measures[ring].identity] =
            ParticlesIn(rings, ring, particles);
        const auto parents = rings.ParentsOf(ring);
        for (const auto& [identity, was_inside] : before) {
          std::vector<std::uint64_t> common;
          std::set_intersection(inside.begin(), inside.end(), was_inside.begin(), was_inside.end(),
                                std::back_inserter(common));
          const bool is_told = std::find(parents.begin(), parents.end(), identity) != parents.end();
          const bool is_true =
              !common.empty() && 4 * common.size() >= std::min(inside.size(), was_inside.size());
          sum.told += is_told;
          sum.wrong += is_told && common.empty();
          sum.relations += is_true;
          sum.missed += is_true && !is_told;
        }
      }
      before = std::move(now);
    }
  }
  testing::Test::RecordProperty(testing::PrintToString(known),
                                absl::StrCat(sum.told, " told, ", sum.wrong, " wrong, ",
                                             sum.relations, " true, ", sum.missed, " missed"));
  return sum;
}

TEST(TrackedTurmoilOf100Discs, ParentsShareParticles) {
  const Parentage blind = CompareParents(kNothing), by_velocities = CompareParents(kVelocities),
                  by_ids = CompareParents(kIds), by_both = CompareParents(kBoth);
  EXPECT_GT(2 * blind.missed, blind.relations);  // Most rings leap.
  EXPECT_LT(by_velocities.wrong, 0.03 * by_velocities.told);
  EXPECT_LT(by_velocities.missed, 0.15 * by_velocities.relations);
  EXPECT_LT(by_ids.wrong, 0.01 * by_ids.told);
  EXPECT_LT(by_ids.missed, 0.08 * by_ids.relations);
  EXPECT_LT(by_both.wrong, 0.01 * by_both.told);
  EXPECT_LT(by_both.missed, 0.05 * by_both.relations);
}

TEST_P(TrackedTurmoil, RefusedFrameHasNoEffect) {
  RingStream disturbed, undisturbed;
  for (int frame = 0; frame < 4; ++frame) {
    const Particles good = Turmoil(GetParam(), 1, frame);
    EXPECT_EQ(disturbed.Next(good), undisturbed.Next(good));
    Particles bad = good;
    if (!bad.ids.empty()) bad.ids[7] = bad.ids[3];
    if (!bad.velocities.empty()) bad.velocities[5] = std::numeric_limits<float>::infinity();
    EXPECT_FALSE(disturbed.Try(bad).ok());
    EXPECT_EQ(disturbed.state(), undisturbed.state());
  }
}

}  // namespace
}  // namespace partiemc
