// Joining parts to one frame: particles, their order, and parts that do not fit.
#include "server/calls/joined_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "partiemc/status.h"
#include "wire/bytes.h"

namespace partiemc::server {
namespace {

struct Particle {
  std::uint64_t id = 0;
  float x = 0, y = 0, volume = 0, heat = 0;
};

std::vector<Particle> RandomParticles(std::size_t count, std::uint64_t id_mask) {
  std::mt19937_64 random(3);
  std::vector<Particle> particles(count);
  for (std::size_t k = 0; k < count; ++k) {
    // Distinct ids that differ only in the bytes of the mask.
    particles[k] = {.id = (k * 0x9e3779b97f4a7c15u) & id_mask,
                    .x = static_cast<float>(k),
                    .y = static_cast<float>(random() % 1000),
                    .volume = 1.f + static_cast<float>(k),
                    .heat = 2.f * static_cast<float>(k)};
  }
  std::ranges::sort(particles, {}, &Particle::id);
  const auto last = std::unique(particles.begin(), particles.end(),
                                [](const Particle& a, const Particle& b) { return a.id == b.id; });
  particles.erase(last, particles.end());
  return particles;
}

v1::ParticleFrame FrameOf(const std::vector<Particle>& particles, bool ids = true) {
  v1::ParticleFrame frame;
  if (!particles.empty()) frame.set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  const auto append = [](std::string& bytes, auto value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  if (!particles.empty()) frame.add_scalars()->set_name("unused");
  std::string heat, unused;
  for (const Particle& particle : particles) {
    append(*frame.mutable_positions(), particle.x);
    append(*frame.mutable_positions(), particle.y);
    append(*frame.mutable_volumes(), particle.volume);
    append(heat, particle.heat);
    append(unused, 0.f);
    if (ids) append(*frame.mutable_ids(), particle.id);
  }
  if (particles.empty()) return frame;
  frame.mutable_scalars(0)->set_values(unused);
  frame.add_scalars()->set_name("heat");
  frame.mutable_scalars(1)->set_values(heat);
  return frame;
}

// Joins `count` parts; particle k is in part part_of(k).
template <typename PartOf>
v1::ParticleFrame Join(const std::vector<Particle>& particles, std::size_t count, bool ids,
                       PartOf part_of) {
  std::vector<std::vector<Particle>> shares(count);
  for (const Particle& particle : particles) shares[part_of(particle)].push_back(particle);
  v1::ParticleFrame frame = FrameOf(shares[0], ids);
  frame.set_sequence(7);
  frame.set_time(1.5);
  std::vector<v1::ParticleFrame> parts;
  for (std::size_t k = 1; k < count; ++k) parts.push_back(FrameOf(shares[k], ids));
  const std::vector<std::string> names = {"heat"};
  const auto status = JoinParts(parts, names, frame);
  EXPECT_TRUE(status.ok()) << status;
  return frame;
}

TEST(JoinParts, ParticlesWithIdsMakeTheSameFrameForAnyDistribution) {
  for (const std::uint64_t mask :
       {std::uint64_t{0xffff}, std::uint64_t{0xff00ff0000000000}, ~std::uint64_t{0}}) {
    auto particles = RandomParticles(5000, mask);
    v1::ParticleFrame expected = FrameOf(particles);
    expected.set_sequence(7);
    expected.set_time(1.5);
    expected.mutable_scalars()->DeleteSubrange(0, 1);
    std::mt19937 random(1);
    for (const std::size_t count : {1u, 2u, 4u, 16u, 64u}) {
      std::ranges::shuffle(particles, random);
      const auto joined =
          Join(particles, count, true, [&](const Particle&) { return random() % count; });
      EXPECT_EQ(joined.SerializeAsString(), expected.SerializeAsString()) << count;
    }
  }
}

TEST(JoinParts, ParticlesWithoutIdsStandPartByPart) {
  const auto particles = RandomParticles(1000, ~std::uint64_t{0});
  const auto expected = Join(particles, 1, false, [](auto&) { return 0; });
  EXPECT_TRUE(expected.ids().empty());
  for (const std::size_t count : {2u, 7u, 64u}) {
    std::size_t k = 0;
    const auto joined =
        Join(particles, count, false, [&](auto&) { return k++ * count / particles.size(); });
    EXPECT_EQ(joined.SerializeAsString(), expected.SerializeAsString()) << count;
  }
}

TEST(JoinParts, EmptyPartsSayNothingAndAllMayBeEmpty) {
  const auto particles = RandomParticles(100, ~std::uint64_t{0});
  const auto expected = Join(particles, 1, true, [](auto&) { return 0; });
  for (const std::size_t holder : {0u, 1u, 3u}) {
    const auto joined = Join(particles, 4, true, [&](auto&) { return holder; });
    EXPECT_EQ(joined.SerializeAsString(), expected.SerializeAsString()) << holder;
  }
  const auto empty = Join({}, 4, true, [](auto&) { return 0; });
  EXPECT_TRUE(empty.positions().empty());
  EXPECT_EQ(empty.position_format(), v1::POSITION_FORMAT_FLOAT32_2);
  EXPECT_EQ(empty.time(), 1.5);
}

// The refusal of a frame of three parts of ten particles each, after `spoil` has changed them.
template <typename Spoil>
std::string Refusal(Spoil spoil) {
  const auto particles = RandomParticles(30, ~std::uint64_t{0});
  v1::ParticleFrame frame = FrameOf({particles.begin(), particles.begin() + 10});
  frame.set_time(2);
  std::vector<v1::ParticleFrame> parts = {FrameOf({particles.begin() + 10, particles.begin() + 20}),
                                          FrameOf({particles.begin() + 20, particles.end()})};
  spoil(frame, parts);
  const std::vector<std::string> names = {"heat"};
  const auto status = JoinParts(parts, names, frame);
  const auto violation = FindViolation(status);
  return violation ? violation->reason + " " + violation->field : std::string(status.message());
}

TEST(JoinParts, TheFirstPartThatDoesNotFitTheOthersIsNamed) {
  EXPECT_EQ(Refusal([](auto&, auto&) {}), "");
  EXPECT_EQ(Refusal([](auto&, auto& parts) { parts[1].clear_ids(); }),
            "PART_MISMATCH parts[2].ids");
  EXPECT_EQ(Refusal([](auto& frame, auto&) { frame.clear_volumes(); }),
            "PART_MISMATCH parts[1].volumes");
  EXPECT_EQ(Refusal([](auto&, auto& parts) {
              parts[0].set_position_format(v1::POSITION_FORMAT_FLOAT64_2);
              parts[0].mutable_positions()->resize(160);
            }),
            "PART_MISMATCH parts[1].position_format");
  EXPECT_EQ(Refusal([](auto&, auto& parts) { parts[1].set_velocities(std::string(80, '\0')); }),
            "PART_MISMATCH parts[2].velocities");
  EXPECT_EQ(Refusal([](auto&, auto& parts) { parts[0].set_time(2); }), "");
  EXPECT_EQ(Refusal([](auto&, auto& parts) { parts[0].set_time(3); }),
            "PART_MISMATCH parts[1].time");
  EXPECT_EQ(Refusal([](auto&, auto& parts) {
              parts[1].mutable_scalars(1)->set_components(2);
              parts[1].mutable_scalars(1)->set_values(std::string(80, '\0'));
            }),
            "PART_MISMATCH parts[2].scalars");
}

TEST(JoinParts, TheBoxIsThatOfPartZero) {
  const auto with_box = [](v1::ParticleFrame& frame, double length) {
    frame.mutable_box()->mutable_x()->set_length(length);
  };
  const auto both = [&](double length) {
    return Refusal([&](auto& frame, auto& parts) {
      with_box(frame, 5);
      with_box(parts[0], length);
    });
  };
  EXPECT_EQ(both(5), "");
  EXPECT_EQ(both(6), "PART_MISMATCH parts[1].box");
  EXPECT_EQ(Refusal([&](auto&, auto& parts) { with_box(parts[1], 5); }),
            "PART_MISMATCH parts[2].box");
  // Part 0 has no particles.
  v1::ParticleFrame frame;
  with_box(frame, 5);
  std::vector<v1::ParticleFrame> parts = {FrameOf(RandomParticles(10, 255))};
  ASSERT_TRUE(JoinParts(parts, {}, frame).ok());
  EXPECT_EQ(frame.box().x().length(), 5);
  EXPECT_FALSE(frame.positions().empty());
}

TEST(JoinParts, APartThatIsNoFrameByItselfIsNamed) {
  EXPECT_EQ(Refusal([](auto&, auto& parts) { parts[1].mutable_ids()->pop_back(); }),
            "BYTE_COUNT parts[2].ids");
  EXPECT_EQ(Refusal([](auto&, auto& parts) { parts[0].mutable_positions()->pop_back(); }),
            "BYTE_COUNT parts[1].positions");
  EXPECT_EQ(Refusal([](auto&, auto& parts) { parts[0].clear_position_format(); }),
            "UNSUPPORTED parts[1].position_format");
  EXPECT_EQ(Refusal([](auto&, auto& parts) { parts[0].clear_scalars(); }),
            "NO_SUCH_ATTRIBUTE parts[1].attributes");
  EXPECT_EQ(Refusal([](auto& frame, auto& parts) {
              frame.set_time(std::numeric_limits<double>::quiet_NaN());
              parts[0].set_time(frame.time());
            }),
            "");
}

}  // namespace
}  // namespace partiemc::server
