// The pauses between attempts to connect.
#include "client/library/backoff.h"

#include <gtest/gtest.h>

#include <chrono>

namespace partiemc::client {
namespace {

using std::chrono::milliseconds;

TEST(Backoff, TriesEachAddressAtOnceThenDoublesThePauseToALimit) {
  const ReconnectPolicy policy{.first_pause = milliseconds(100),
                               .longest_pause = milliseconds(1000)};
  Backoff backoff(policy, 3, 42);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(backoff.NextPause(), milliseconds(0));
  for (const int pause : {100, 200, 400, 800, 1000, 1000, 1000}) {
    const auto first_of_round = backoff.NextPause();
    EXPECT_GE(first_of_round, milliseconds(pause / 2 - 1));
    EXPECT_LE(first_of_round, milliseconds(pause));
    for (int k = 1; k < 3; ++k) EXPECT_EQ(backoff.NextPause(), milliseconds(0));
  }
  for (int k = 0; k < 1000; ++k) EXPECT_LE(backoff.NextPause(), policy.longest_pause);
}

TEST(Backoff, ClientsDoNotComeBackAsOne) {
  const ReconnectPolicy policy{.first_pause = milliseconds(1000)};
  Backoff one(policy, 1, 1), other(policy, 1, 2);
  one.NextPause();
  other.NextPause();
  EXPECT_NE(one.NextPause(), other.NextPause());
}

}  // namespace
}  // namespace partiemc::client
