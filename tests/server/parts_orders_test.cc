// Random orders of parts over several connections (parts_model.h). A release is tested with
// PARTIEMC_TRIES=100. A failing order prints its seed; PARTIEMC_SEED starts from it.
#include <gtest/gtest.h>

#include <cstdint>

#include "server/parts_model.h"
#include "support/random.h"
#include "support/tries.h"

namespace partiemc::server {
namespace {

TEST(PartsOrders, KeepMemoryBoundedAndAnswerEveryFrameOnce) {
  const std::uint64_t first = support::FirstSeed();
  const std::uint64_t orders = support::Tries(1000u);
  SteppedPool pool;
  for (std::uint64_t seed = first; seed < first + orders; ++seed) {
    support::Random random(seed);
    const ChooseBelow choose = [&](std::size_t count) {
      return static_cast<std::size_t>(random.Below(count));
    };
    ASSERT_EQ(RunPartsModel(pool, choose, choose(200)), "")
        << "PARTIEMC_SEED=" << seed << " PARTIEMC_TRIES=0";
  }
}

}  // namespace
}  // namespace partiemc::server
