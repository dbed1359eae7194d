#include "client/input/base/natural_order.h"

#include <algorithm>
#include <random>

#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

TEST(NaturalOrder, NumbersInNamesCompareByTheirValue) {
  EXPECT_TRUE(NaturalLess("frame_2", "frame_10"));
  EXPECT_FALSE(NaturalLess("frame_10", "frame_2"));
  EXPECT_TRUE(NaturalLess("a9b2", "a9b10"));
  EXPECT_TRUE(NaturalLess("dump.999.gz", "dump.1000.gz"));
}

TEST(NaturalOrder, NumbersBeyondAnyIntegerTypeCompareByTheirValue) {
  const std::string long_number(400, '9');
  EXPECT_TRUE(NaturalLess("f" + long_number, "f1" + std::string(400, '0')));
}

TEST(NaturalOrder, LeadingZerosOnlyBreakTies) {
  EXPECT_TRUE(NaturalLess("f007", "f8"));
  EXPECT_TRUE(NaturalLess("f007", "f7"));
  EXPECT_FALSE(NaturalLess("f7", "f007"));
  EXPECT_TRUE(NaturalLess("f007a", "f7b"));
}

// Sorts shuffled names and expects them in this order.
void ExpectOrder(const std::vector<std::string>& ordered, bool uncertain) {
  std::vector<std::string> names = ordered;
  const std::uint32_t seed = 3;
  std::mt19937 random(seed);
  for (int round = 0; round < 5; ++round) {
    std::shuffle(names.begin(), names.end(), random);
    EXPECT_EQ(SortNaturally(names), uncertain) << ordered.front();
    EXPECT_EQ(names, ordered);
  }
}

TEST(NaturalOrder, DecimalTimesAreInTheirOrder) {
  ExpectOrder({"p_0.05.csv", "p_0.1.csv", "p_0.15.csv", "p_0.2.csv"}, false);
  ExpectOrder({"p_0.0.csv", "p_0.005.csv", "p_0.5.csv", "p_1.0.csv", "p_10.25.csv"}, false);
  ExpectOrder({"p_0.25.csv", "p_0.5.csv", "p_0.75.csv", "p_1.0.csv"}, true);
  ExpectOrder({"p_0.10.csv", "p_0.15.csv", "p_0.20.csv"}, false);
}

TEST(NaturalOrder, WholeNumbersAfterAPointAreInTheirOrder) {
  ExpectOrder({"run1.1.csv", "run1.9.csv", "run1.10.csv", "run1.11.csv"}, false);
  ExpectOrder({"run1.08.csv", "run1.99.csv", "run1.100.csv"}, false);
  ExpectOrder({"v1.2.9.csv", "v1.2.25.csv", "v1.2.111.csv"}, false);
  ExpectOrder({"a.2.csv", "a.15.csv"}, false);
  ExpectOrder({"dump.9", "dump.11"}, false);
}

TEST(NaturalOrder, IsAStrictOrderThatShufflingDoesNotChange) {
  std::vector<std::string> names = {"",    "0",    "00",    "a",  "a0",  "a00", "a1",
                                    "a01", "a1b2", "a1b10", "a2", "a10", "b",   "b1.5"};
  for (const std::string& a : names) {
    EXPECT_FALSE(NaturalLess(a, a)) << a;
    for (const std::string& b : names) {
      EXPECT_EQ(a != b, NaturalLess(a, b) != NaturalLess(b, a)) << a << " " << b;
    }
  }
  const std::uint32_t seed = 7;
  std::mt19937 random(seed);
  std::sort(names.begin(), names.end(), NaturalLess);
  for (int round = 0; round < 20; ++round) {
    std::vector<std::string> shuffled = names;
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    std::sort(shuffled.begin(), shuffled.end(), NaturalLess);
    EXPECT_EQ(shuffled, names) << "seed " << seed << " round " << round;
  }
}

}  // namespace
}  // namespace partiemc::client
