// The benchmark's scenes and its floor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "bench/core_stream.h"
#include "bench/scatter_floor.h"
#include "bench/scenes.h"

namespace partiemc::bench {
namespace {

// FNV-1a over the positions of a scene's frames.
std::uint64_t DigestOf(const Scene& scene) {
  std::uint64_t digest = 0xcbf29ce484222325u;
  for (std::size_t k = 0; k < scene.frames.size(); ++k) {
    std::visit(
        [&](auto view) {
          for (const std::byte byte : std::as_bytes(view)) {
            digest = (digest ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3u;
          }
        },
        scene.At(k).positions);
  }
  return digest;
}

Result Reconstructed(const Scene& scene) {
  CoreStream stream(scene, ReferenceParameters(scene));
  stream.Next();
  return stream.result();
}

TEST(Scenes, HaveTheSameBitsOnEveryMachine) {
  EXPECT_EQ(DigestOf(Blob("10k", 10'000)), 4169414633742933923u);
  EXPECT_EQ(DigestOf(Islands("10k", 10'000)), 2856771986979776859u);
}

TEST(Scenes, BlobIsOneBodyWithSixHoles) {
  const Scene scene = Blob("100k", 100'000);
  ASSERT_EQ(scene.ParticleCount(), 100'000u);
  const Result result = Reconstructed(scene);
  EXPECT_EQ(result.rings.RingCount(), 7u);
  EXPECT_NEAR(result.statistics.area, 100'000, 1000);
}

TEST(Scenes, IslandsAreAThousandBodies) {
  const Scene scene = Islands("100k", 100'000);
  ASSERT_EQ(scene.ParticleCount(), 100'000u);
  EXPECT_EQ(Reconstructed(scene).rings.RingCount(), 1000u);
}

TEST(Scenes, LargeParticlesHaveTheAreaOfTheSmallOnes) {
  const auto area = [](int ratio, double share) {
    const Scene scene = SizedBlob(
        "blob", 10'000, ratio,
        [share](support::Random& random, double, double) { return random.Chance(share); });
    EXPECT_EQ(scene.volumes.size(), scene.ParticleCount());
    return std::accumulate(scene.volumes.begin(), scene.volumes.end(), 0.0);
  };
  const double all_small = area(3, 0);
  EXPECT_NEAR(all_small, 10'000, 100);
  EXPECT_EQ(area(3, .5), all_small);
  EXPECT_EQ(area(3, 1), all_small);
}

TEST(ScatterFloor, EqualsKernelSumAtEveryNode) {
  const Scene scene = Blob("small", 400);
  const auto xy = FloatPositions(scene);
  for (const int radius : {2, 3}) {
    const LatticeBox box = LatticeBox::Around(xy, radius + 1);
    ScatterBuffers buffers;
    ScatterDensity(xy, box, radius, buffers);
    for (int row = 0; row < box.rows; ++row) {
      for (int column = 0; column < box.columns; ++column) {
        double sum = 0;
        for (std::size_t k = 0; k < xy.size(); k += 2) {
          const double dx = double{xy[k]} - (box.first_column + column);
          const double dy = double{xy[k + 1]} - (box.first_row + row);
          const double t = std::max(0.0, 1 - (dx * dx + dy * dy) / (radius * radius));
          sum += t * t * t;
        }
        ASSERT_NEAR(buffers.density[row * buffers.stride + column], sum, 1e-5)
            << "radius " << radius << ", node " << column << ", " << row;
      }
    }
  }
}

}  // namespace
}  // namespace partiemc::bench
