// The memory of the states that streams keep between their frames.
#include "server/compute/state_memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "partiemc/status.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;

constexpr std::uint64_t kFree = 10;

std::shared_ptr<CallerAccount> Caller() { return std::make_shared<CallerAccount>(); }

TEST(StateMemory, CountsTheBytesAboveTheFreeOnesUntilTheStreamEnds) {
  StateMemory memory(1000, kFree);
  {
    StateMemory::Account account(memory, Caller());
    EXPECT_TRUE(account.Grow(kFree).ok());
    EXPECT_EQ(memory.held(), 0u);
    EXPECT_TRUE(account.Grow(100).ok());
    EXPECT_TRUE(account.Grow(50).ok()) << "does not shrink";
    EXPECT_EQ(memory.held(), 90u);
    account.Shrink(60);
    account.Shrink(70);
    EXPECT_EQ(account.bytes(), 60u);
    EXPECT_EQ(memory.held(), 50u);
    StateMemory::Account moved = std::move(account);
    EXPECT_EQ(moved.bytes(), 60u);
    EXPECT_EQ(memory.held(), 50u);
  }
  EXPECT_EQ(memory.held(), 0u);
}

TEST(StateMemory, RefusesWhatDoesNotFitAndStaysAsItWas) {
  StateMemory memory(1000, kFree);
  StateMemory::Account account(memory, Caller());
  EXPECT_FALSE(account.Grow(501 + kFree).ok()) << "more than half";
  EXPECT_TRUE(account.Grow(500 + kFree).ok()) << "half of the memory";
  const absl::Status refused = account.Grow(501 + kFree);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  const auto violation = FindViolation(refused);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->reason, "MEMORY_BUDGET");
  EXPECT_EQ(violation->field, "frame");
  EXPECT_THAT(violation->value, HasSubstr("511 bytes"));
  EXPECT_THAT(violation->rule, HasSubstr("into 1000 bytes"));
  EXPECT_EQ(account.bytes(), 500 + kFree);
  EXPECT_EQ(memory.held(), 500u);
}

TEST(StateMemory, LeavesRoomForOtherCallersAndKeepsQuotas) {
  StateMemory memory(1000, kFree);
  const auto greedy = Caller();
  StateMemory::Account first(memory, greedy), second(memory, greedy), other(memory, Caller());
  EXPECT_TRUE(first.Grow(400).ok());
  EXPECT_FALSE(second.Grow(300).ok()) << "streams of one caller share its half";
  EXPECT_TRUE(other.Grow(300).ok());
  const auto poor = std::make_shared<CallerAccount>(CallerQuota{.bytes = 50});
  StateMemory::Account small(memory, poor);
  EXPECT_EQ(FindViolation(small.Grow(kFree + 51))->reason, "CALLER_BYTES");
  EXPECT_TRUE(small.Grow(kFree + 50).ok());
}

TEST(StateMemory, AnAccountWithoutMemoryTakesEverything) {
  StateMemory::Account account;
  EXPECT_TRUE(account.Grow(~std::uint64_t{0}).ok());
  account.Shrink(0);
}

}  // namespace
}  // namespace partiemc::server
