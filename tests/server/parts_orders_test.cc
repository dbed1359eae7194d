// Random orders of parts over several connections (parts_model.h). PARTIEMC_ORDERS sets the number
// of orders: the default is for daily runs, 100000 for a release. A failing order prints its seed;
// PARTIEMC_SEED starts from it.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>

#include "server/parts_model.h"
#include "support/random.h"

namespace partiemc::server {
namespace {

std::uint64_t NumberFromEnvironment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

TEST(PartsOrders, KeepMemoryBoundedAndAnswerEveryFrameOnce) {
  const std::uint64_t first = NumberFromEnvironment("PARTIEMC_SEED", 1);
  const std::uint64_t orders = NumberFromEnvironment("PARTIEMC_ORDERS", 1000);
  SteppedPool pool;
  for (std::uint64_t seed = first; seed < first + orders; ++seed) {
    support::Random random(seed);
    const ChooseBelow choose = [&](std::size_t count) {
      return static_cast<std::size_t>(random.Below(count));
    };
    ASSERT_EQ(RunPartsModel(pool, choose, choose(200)), "")
        << "PARTIEMC_SEED=" << seed << " PARTIEMC_ORDERS=1";
  }
}

}  // namespace
}  // namespace partiemc::server
