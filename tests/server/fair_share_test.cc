// How callers share a limit.
#include "server/compute/fair_share.h"

#include <gtest/gtest.h>

#include <array>

#include "server/security/caller.h"

namespace partiemc::server {
namespace {

class Room : public ::testing::Test {
 protected:
  // Takes one unit at a time until refused; returns the number.
  std::uint64_t TakeAll(const CallerAccount& caller, std::uint64_t most = FairShare::kNoLimit) {
    while (room_.Fits(&caller, 1, most) == FairShare::Fit::kYes) room_.Take(&caller, 1);
    return room_.held_by(&caller);
  }

  FairShare room_{120};
  std::array<CallerAccount, 5> callers_;
};

TEST_F(Room, OneGreedyCallerHasHalfOfIt) {
  EXPECT_EQ(TakeAll(callers_[0]), 60u);
  EXPECT_EQ(room_.Fits(&callers_[0], 1), FairShare::Fit::kMoreThanShare);
  EXPECT_EQ(room_.Fits(&callers_[1], 1), FairShare::Fit::kYes);
}

TEST_F(Room, GreedyCallersLeaveSomeForTheNextWhoeverCameFirst) {
  std::uint64_t before = room_.room();
  for (const CallerAccount& caller : callers_) {
    const std::uint64_t own = TakeAll(caller);
    EXPECT_GT(own, 0u);
    EXPECT_LT(own, before);
    before = own;
  }
  EXPECT_GT(room_.room() - room_.held(), 0u);
  // After the first callers have released some, all have the same.
  for (int round = 0; round < 100; ++round) {
    for (const CallerAccount& caller : callers_) {
      if (room_.Fits(&caller, 1) == FairShare::Fit::kMoreThanShare) room_.GiveBack(&caller, 1);
    }
    for (const CallerAccount& caller : callers_) TakeAll(caller);
  }
  for (const CallerAccount& caller : callers_) {
    EXPECT_NEAR(static_cast<double>(room_.held_by(&caller)), 20, 1);
  }
}

TEST_F(Room, BytesBeyondTheRoomTakeNoneFromOthers) {
  room_.AddBeyond(100);
  room_.Take(&callers_[0], 100);
  EXPECT_EQ(room_.Fits(&callers_[1], 120), FairShare::Fit::kYes);
  EXPECT_EQ(room_.Fits(&callers_[1], 121), FairShare::Fit::kNoRoom);
  EXPECT_EQ(room_.Fits(&callers_[0], 11), FairShare::Fit::kMoreThanShare)
      << "they are the caller's own";
  EXPECT_TRUE(room_.FitsWithout(20, &callers_[0], FairShare::kNoLimit));
  EXPECT_FALSE(room_.FitsWithout(21, &callers_[0], FairShare::kNoLimit));
  room_.Take(&callers_[1], 1);
  room_.RemoveBeyond(100);
  EXPECT_EQ(room_.Fits(&callers_[1], 20), FairShare::Fit::kMoreThanShare);
  EXPECT_EQ(room_.Fits(&callers_[2], 19), FairShare::Fit::kYes);
  EXPECT_EQ(room_.Fits(&callers_[2], 20), FairShare::Fit::kNoRoom);
}

TEST_F(Room, WhoHoldsNothingGetsWhatFits) {
  EXPECT_EQ(room_.Fits(&callers_[0], 120), FairShare::Fit::kYes);
  EXPECT_EQ(room_.Fits(&callers_[0], 121), FairShare::Fit::kNoRoom);
  room_.Take(&callers_[0], 100);
  EXPECT_EQ(room_.Fits(&callers_[1], 20), FairShare::Fit::kYes);
  EXPECT_EQ(room_.Fits(&callers_[1], 21), FairShare::Fit::kNoRoom);
  EXPECT_EQ(room_.Fits(&callers_[0], 1), FairShare::Fit::kMoreThanShare);
}

TEST_F(Room, ALimitOfACallerCountsBesideItsShare) {
  EXPECT_EQ(room_.Fits(&callers_[0], 11, 10), FairShare::Fit::kMoreThanShare);
  EXPECT_EQ(TakeAll(callers_[0], 10), 10u);
  EXPECT_EQ(TakeAll(callers_[1], 1000), 55u);
  room_.Take(&callers_[2], 7);
  EXPECT_EQ(room_.Fits(&callers_[2], 1, 5), FairShare::Fit::kMoreThanShare)
      << "it holds more already";
}

TEST_F(Room, TheServerItselfHasNoShare) {
  room_.Take(nullptr, 100);
  EXPECT_EQ(room_.Fits(nullptr, 20), FairShare::Fit::kYes);
  EXPECT_EQ(room_.Fits(nullptr, 21), FairShare::Fit::kNoRoom);
}

TEST_F(Room, WhatIsHeldInAnyCaseCountsAndNobodyIsRememberedWithoutIt) {
  room_.Take(&callers_[0], 500);
  EXPECT_EQ(room_.held(), 500u);
  EXPECT_EQ(room_.Fits(&callers_[1], 1), FairShare::Fit::kNoRoom);
  EXPECT_EQ(room_.Fits(&callers_[1], 0), FairShare::Fit::kNoRoom);
  room_.GiveBack(&callers_[0], 400);
  EXPECT_EQ(room_.Fits(&callers_[1], 20), FairShare::Fit::kYes);
  room_.GiveBack(&callers_[0], 100);
  room_.Take(&callers_[1], 0);
  EXPECT_EQ(room_.callers(), 0u);
  EXPECT_EQ(room_.held(), 0u);
}

TEST_F(Room, NumbersAtTheEndOfTheirRangeDoNotWrapAround) {
  constexpr std::uint64_t kMost = FairShare::kNoLimit;
  EXPECT_EQ(room_.Fits(&callers_[0], kMost), FairShare::Fit::kNoRoom);
  room_.Take(&callers_[0], kMost);
  EXPECT_EQ(room_.Fits(&callers_[0], 1), FairShare::Fit::kMoreThanShare);
  EXPECT_EQ(room_.Fits(&callers_[1], 1), FairShare::Fit::kNoRoom);
  room_.GiveBack(&callers_[0], kMost);
  FairShare all(kMost);
  all.Take(&callers_[0], kMost - 1);
  EXPECT_EQ(all.Fits(&callers_[0], 1), FairShare::Fit::kMoreThanShare);
  EXPECT_EQ(all.Fits(&callers_[1], 1), FairShare::Fit::kYes);
}

}  // namespace
}  // namespace partiemc::server
