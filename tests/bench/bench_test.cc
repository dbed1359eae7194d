// The benchmark's own parts: what its figures rest upon.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "bench/core_stream.h"
#include "bench/expectations.h"
#include "bench/report.h"
#include "bench/scatter_floor.h"
#include "bench/scenes.h"
#include "bench/statistics.h"
#include "support/random.h"
#include "support/temporary_folder.h"

namespace partiemc::bench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

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

TEST(Scenes, AreTheSameOnEveryMachine) {
  EXPECT_EQ(DigestOf(Blob("10k", 10'000)), 4169414633742933923u);
  EXPECT_EQ(DigestOf(Islands("10k", 10'000)), 2856771986979776859u);
}

TEST(Scenes, ABlobIsOneBodyWithSixHoles) {
  const Scene scene = Blob("100k", 100'000);
  ASSERT_EQ(scene.ParticleCount(), 100'000u);
  const Result result = Reconstructed(scene);
  EXPECT_EQ(result.rings.RingCount(), 7u);
  EXPECT_NEAR(result.statistics.area, 100'000, 1000);
}

TEST(Scenes, IslandsAreAThousandApart) {
  const Scene scene = Islands("100k", 100'000);
  ASSERT_EQ(scene.ParticleCount(), 100'000u);
  EXPECT_EQ(Reconstructed(scene).rings.RingCount(), 1000u);
}

TEST(ScatterFloor, IsTheKernelSumAtEveryNode) {
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

TEST(Statistics, PercentilesAreLinearBetweenNeighbours) {
  EXPECT_DOUBLE_EQ(Median({3, 1, 2}), 2);
  EXPECT_DOUBLE_EQ(Median({4, 1, 2, 3}), 2.5);
  EXPECT_DOUBLE_EQ(Percentile({0, 10}, 90), 9);
  EXPECT_DOUBLE_EQ(Percentile({7}, 99), 7);
}

TEST(Report, FiguresHaveThreeDigits) {
  EXPECT_EQ(Figure(0), "0");
  EXPECT_EQ(Figure(0.0123), "0.012");
  EXPECT_EQ(Figure(0.5), "0.50");
  EXPECT_EQ(Figure(9.876), "9.88");
  EXPECT_EQ(Figure(98.76), "98.8");
  EXPECT_EQ(Figure(12345), "12345");
}

// A file of this test's own.
class ExpectationFile {
 public:
  explicit ExpectationFile(const std::string& text) : path_(folder_.Write("expected.csv", text)) {}
  const std::string& path() const { return path_; }
  std::string Text() const {
    std::ostringstream text;
    text << std::ifstream(path_).rdbuf();
    return text.str();
  }

 private:
  const support::TemporaryFolder folder_;
  const std::string path_;
};

std::vector<std::string> FailuresOf(double slow, double fast) {
  Report report;
  report.AddMetric("slow", slow, "ratio");
  report.AddMetric("fast", fast, "ratio");
  return Failures({{"slow", 2, true, 1.7}, {"fast", 80, false, 1.7}}, report);
}

TEST(Expectations, NoiseAndImprovementsPass) {
  EXPECT_THAT(FailuresOf(2 * 1.5, 80 / 1.5), IsEmpty());
  EXPECT_THAT(FailuresOf(0.1, 1000), IsEmpty());
}

TEST(Expectations, TwiceAsSlowFails) {
  EXPECT_THAT(FailuresOf(4, 80), ElementsAre(StartsWith("slow is 4.00, recorded 2.00")));
  EXPECT_THAT(FailuresOf(2, 40), ElementsAre(StartsWith("fast is 40.0, recorded 80.0")));
  EXPECT_THAT(FailuresOf(std::nan(""), std::nan("")), testing::SizeIs(2));
}

TEST(Expectations, WhatIsZeroStaysZero) {
  Report report;
  report.AddMetric("allocations", 1, "count");
  EXPECT_THAT(Failures({{"allocations", 0, true, 1.7}}, report), testing::SizeIs(1));
}

TEST(Expectations, WhatWasNotMeasuredFails) {
  EXPECT_THAT(Failures({{"gone", 1, true, 2}}, Report()), ElementsAre(HasSubstr("not measured")));
}

TEST(Expectations, ARefreshReplacesValuesOnly) {
  const ExpectationFile file("# why\nmetric,value,better,margin\nslow,2,lower,1.7\n");
  Report report;
  report.AddMetric("slow", 3.14159, "ratio");
  ASSERT_TRUE(RefreshExpectations(file.path(), report).ok());
  EXPECT_EQ(file.Text(), "# why\nmetric,value,better,margin\nslow,3.14,lower,1.7\n");
}

TEST(Expectations, ABadLineIsNamed) {
  for (const std::string line :
       {"slow,2,lower", "slow,x,lower,2", "slow,2,worse,2", "slow,2,lower,0.5"}) {
    const ExpectationFile file("metric,value,better,margin\n" + line + "\n");
    const auto read = ReadExpectations(file.path());
    ASSERT_FALSE(read.ok()) << line;
    EXPECT_THAT(std::string(read.status().message()), HasSubstr(line));
  }
}

TEST(Expectations, TheRecordedOnesAreRead) {
  const auto recorded = ReadExpectations(PARTIEMC_SOURCE_DIR "/tests/bench/expected.csv");
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  for (const Expectation& expected : *recorded) EXPECT_LT(expected.margin, 2) << expected.metric;
}

}  // namespace
}  // namespace partiemc::bench
