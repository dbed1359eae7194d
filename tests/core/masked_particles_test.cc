#include "bins/masked_particles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include "support/instruction_sets.h"
#include "support/particles.h"

namespace partiemc {
namespace {

// An particle as a walk hands it out.
struct Seen {
  std::uint32_t particle;
  float x, y;

  bool operator==(const Seen&) const = default;
};

std::vector<Seen> InOrder(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask) {
  std::vector<Seen> seen;
  MaskedParticles(bins, tile, mask).ForEachBlock([&](const ParticleBlock& near) {
    EXPECT_GT(near.count, 0);
    for (int k = 0; k < near.count; ++k) {
      seen.push_back({near.particle[k], near.x[k], near.y[k]});
    }
  });
  return seen;
}

// All particles of the bins in cells of the mask around a tile, tile after tile: these are sorted
// by row, then column, and particles of a tile are in the order of the frame.
std::vector<Seen> Expected(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask) {
  std::vector<Seen> expected;
  for (std::uint32_t other = 0; other < bins.tiles.size(); ++other) {
    const int dx = bins.tiles[other].x - bins.tiles[tile].x;
    const int dy = bins.tiles[other].y - bins.tiles[tile].y;
    if (std::abs(dx) > 1 || std::abs(dy) > 1) continue;
    for (std::uint32_t e = bins.offsets[other]; e < bins.offsets[other + 1]; ++e) {
      const float x = bins.particles[e].x + static_cast<float>(dx * kTileSize);
      const float y = bins.particles[e].y + static_cast<float>(dy * kTileSize);
      if (mask != nullptr) {
        const int column = static_cast<int>(std::floor(x)) + kMaskMargin;
        const int row = static_cast<int>(std::floor(y)) + kMaskMargin;
        if (std::min(column, row) < 0 || std::max(column, row) >= 64) continue;
        if (((*mask)[row] >> column & 1) == 0) continue;
      }
      expected.push_back({e, x, y});
    }
  }
  return expected;
}

ParticleBins Bin(const support::Particles& particles) {
  const ReconstructionParameters parameters = Resolve({.spacing = 1.0});
  ParticleBins bins;
  EXPECT_TRUE(
      BinParticles(particles.AsFrame(), Plane::kXy, MakeScale(parameters, 1, 1, 1), {}, bins).ok());
  return bins;
}

void ExpectAllSeen(const ParticleBins& bins, const CellMask* mask) {
  for (std::uint32_t tile = 0; tile < bins.tiles.size(); ++tile) {
    EXPECT_EQ(InOrder(bins, tile, mask), Expected(bins, tile, mask));
  }
}

// A body over several tiles, and crowds at the corner of four of them that fill several blocks.
support::Particles CrowdedScene(support::Random& random) {
  support::Particles particles = support::Blob(random, 30);
  for (int k = 0; k < 3000; ++k) {
    particles.Add(random.Uniform(-1, 1), random.Uniform(-1, 1));
    particles.Add(random.Uniform(30, 34), random.Uniform(-40, 40));
  }
  return particles;
}

TEST(MaskedParticles, FollowTilesAndFrameOrderOnEveryInstructionSet) {
  support::Random random(1);
  const ParticleBins bins = Bin(CrowdedScene(random));
  ASSERT_GE(bins.tiles.size(), 9u);
  CellMask sparse, dense, one_side{};
  for (std::uint64_t& row : sparse) row = random.Bits() & random.Bits() & random.Bits();
  for (std::uint64_t& row : dense) row = random.Bits() | random.Bits();
  for (std::uint64_t& row : one_side) row = 0xff;
  const int sets = support::ForEachInstructionSet([&] {
    for (const CellMask* mask : {&sparse, &dense, &one_side}) ExpectAllSeen(bins, mask);
  });
  EXPECT_GE(sets, 1);
}

TEST(MaskedParticles, WithoutAMaskAreAllOfATileAndItsNeighbours) {
  support::Random random(2);
  ExpectAllSeen(Bin(CrowdedScene(random)), nullptr);
}

TEST(MaskedParticles, OfAnEmptyMaskAreNone) {
  support::Random random(3);
  const CellMask empty{};
  ExpectAllSeen(Bin(CrowdedScene(random)), &empty);
}

TEST(MaskedParticles, OfAnySmallNumberOfParticlesAreRight) {
  // Fewer than a vector, at the end of the bins too.
  for (int count = 1; count <= 40; ++count) {
    support::Random random(static_cast<std::uint64_t>(count));
    support::Particles particles;
    for (int k = 0; k < count; ++k) particles.Add(random.Uniform(-20, 20), random.Uniform(-20, 20));
    CellMask mask;
    for (std::uint64_t& row : mask) row = random.Bits();
    ExpectAllSeen(Bin(particles), &mask);
  }
}

TEST(MaskedParticles, OfDifferentSizesReachANodeOfTheTile) {
  constexpr float kRadius = 1.3f, kMiddle = (kTileSize - 1) / 2.0f;
  support::Random random(4);
  ParticleBins bins = Bin(CrowdedScene(random));
  for (std::size_t e = 0; e < bins.particles.size(); ++e) {
    bins.size.push_back(static_cast<float>(random.Uniform(.2, 4)));
  }
  CellMask mask;
  for (std::uint64_t& row : mask) row = random.Bits() | random.Bits();
  support::ForEachInstructionSet([&] {
    for (std::uint32_t tile = 0; tile < bins.tiles.size(); ++tile) {
      std::vector<Seen> expected = Expected(bins, tile, &mask), seen;
      std::erase_if(expected, [&](const Seen& at) {
        const float reach = kRadius * bins.size[at.particle] + kMiddle;
        return std::max(std::abs(at.x - kMiddle), std::abs(at.y - kMiddle)) >= reach;
      });
      MaskedParticles(bins, tile, &mask, kRadius).ForEachBlock([&](const ParticleBlock& near) {
        for (int k = 0; k < near.count; ++k) {
          seen.push_back({near.particle[k], near.x[k], near.y[k]});
          EXPECT_EQ(near.size[k], bins.size[near.particle[k]]);
        }
      });
      EXPECT_EQ(seen, expected);
    }
  });
}

TEST(CellMasks, KnowTheCellsAroundATileAndAllThatAreNearToOne) {
  support::Random random(5);
  const ParticleBins bins = Bin(CrowdedScene(random));
  std::vector<BitRows> rows(bins.tiles.size());
  for (BitRows& cells : rows) {
    for (std::uint32_t& row : cells) {
      row = static_cast<std::uint32_t>(random.Bits() & random.Bits() & random.Bits());
      if (random.Chance(0.8)) row = random.Chance(0.5) ? 0 : row & 0x80000001u;
    }
  }
  const auto has = [&](std::uint32_t tile, int i, int j) {
    const TilePlace place = Normalise(bins.tiles, tile, i, j);
    return place.tile != kNoTile && (rows[place.tile][place.j] >> place.i & 1) != 0;
  };
  const auto is_near = [&](std::uint32_t tile, int i, int j, int distance) {
    for (int y = j - distance; y <= j + distance; ++y) {
      for (int x = i - distance; x <= i + distance; ++x) {
        if (has(tile, x, y)) return true;
      }
    }
    return false;
  };
  for (std::uint32_t tile = 0; tile < bins.tiles.size(); ++tile) {
    for (int distance = 0; distance <= kMaskMargin; ++distance) {
      CellMask mask = CellsAround(bins.tiles, tile, distance,
                                  [&](std::uint32_t of) -> const BitRows& { return rows[of]; });
      CellMask in_two_steps = mask;
      Widen(mask, distance, distance);
      Widen(in_two_steps, distance / 3, distance / 3);
      Widen(in_two_steps, distance - distance / 3, distance - distance / 3);
      for (int j = 0; j < kTileSize; ++j) {
        for (int i = 0; i < kTileSize; ++i) {
          const bool expected = is_near(tile, i, j, distance);
          const int bit = i + kMaskMargin;
          ASSERT_EQ(mask[j + kMaskMargin] >> bit & 1, expected) << tile << ' ' << i << ' ' << j;
          ASSERT_EQ(in_two_steps[j + kMaskMargin] >> bit & 1, expected) << distance;
        }
      }
    }
  }
}

TEST(CellMasks, AreWidenedByABoxAroundEachCell) {
  support::Random random(6);
  for (const auto& [before, after] :
       {std::pair(0, 0), std::pair(1, 0), std::pair(0, 1), std::pair(3, 2), std::pair(7, 8),
        std::pair(kMaskMargin, kMaskMargin - 1), std::pair(kMaskMargin, kMaskMargin)}) {
    BitRows rows{};
    for (int n = 0; n < 6; ++n) {
      rows[random.Below(kTileSize)] |= std::uint32_t{1} << random.Below(kTileSize);
    }
    rows[0] |= 1;  // Their boxes end where the mask does.
    rows[kTileSize - 1] |= std::uint32_t{1} << (kTileSize - 1);
    CellMask expected{};
    for (int j = 0; j < kTileSize; ++j) {
      for (int i = 0; i < kTileSize; ++i) {
        if ((rows[j] >> i & 1) == 0) continue;
        for (int row = j - before; row <= std::min(j + after, kTileSize + kMaskMargin - 1); ++row) {
          for (int cell = i - before; cell <= std::min(i + after, kTileSize + kMaskMargin - 1);
               ++cell) {
            expected[row + kMaskMargin] |= std::uint64_t{1} << (cell + kMaskMargin);
          }
        }
      }
    }
    CellMask mask = MaskOf(rows);
    Widen(mask, before, after);
    EXPECT_EQ(mask, expected) << before << " before, " << after << " after";
  }
}

}  // namespace
}  // namespace partiemc
