#include "frame/distinct_ids.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "base/id_hash.h"
#include "support/chosen_ids.h"
#include "support/random.h"
#include "support/tries.h"

namespace partiemc {
namespace {

void ExpectAsByMap(const std::vector<std::uint64_t>& ids, DistinctIdsScratch& scratch) {
  const auto found = FindRepeated(ids, scratch);
  std::map<std::uint64_t, std::size_t> seen;
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const auto [first, is_new] = seen.emplace(ids[k], k);
    if (is_new) continue;
    ASSERT_TRUE(found.has_value());
    EXPECT_EQ(found->first, first->second);
    EXPECT_EQ(found->again, k);
    return;
  }
  EXPECT_FALSE(found.has_value());
}

TEST(DistinctIds, TheFirstRepetitionIsFoundInAnyRange) {
  DistinctIdsScratch scratch;  // Reused, to check that a call leaves no trace in it.
  constexpr std::uint64_t kLargest = ~std::uint64_t{0};
  ExpectAsByMap({}, scratch);
  ExpectAsByMap({kLargest}, scratch);
  ExpectAsByMap({0, kLargest, 0}, scratch);
  ExpectAsByMap({kLargest, kLargest}, scratch);
  for (std::uint64_t seed = 1; seed <= support::Tries(200u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    support::Random random(seed);
    const std::size_t count = 1 + random.Below(200);
    // From dense to sparse; with few and with many repetitions.
    const std::size_t range = count << random.Below(16);
    const std::uint64_t lowest = random.Chance(0.5) ? 0 : kLargest - range;
    std::vector<std::uint64_t> ids(count);
    for (std::uint64_t& id : ids) id = lowest + random.Below(range);
    ExpectAsByMap(ids, scratch);
  }
}

TEST(DistinctIds, WhereNoneHasAnyAllAreFoundToBeOne) {
  DistinctIdsScratch scratch;
  ExpectAsByMap(std::vector<std::uint64_t>(1000, 4294967295), scratch);  // As PySPH leaves them.
}

TEST(DistinctIds, ThatShareABitAreComparedNotConfused) {
  DistinctIdsScratch scratch;
  for (const std::uint64_t step : {1u, 1u << 20}) {
    std::vector<std::uint64_t> ids(5000);
    // Ids with the same leading part of the hash, which selects the bit of the bitmap.
    for (std::size_t k = 0; k < ids.size(); ++k) ids[k] = support::IdWithHash(step * k);
    ASSERT_EQ(HashOf(ids[3]), 3 * step);
    ExpectAsByMap(ids, scratch);
    ids.back() = ids[17];
    ExpectAsByMap(ids, scratch);
    ids[4000] = ids[3999];
    ExpectAsByMap(ids, scratch);
  }
}

}  // namespace
}  // namespace partiemc
