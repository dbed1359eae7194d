// Limits of a worker's buffers, and when they are released.
#include "server/compute/worker_memory.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>

namespace partiemc::server {
namespace {

constexpr std::uint64_t kMib = std::uint64_t{1} << 20;

TEST(WorkerMemory, CountsWhatIsBeyondTheShareThatEveryWorkerHas) {
  MemoryBudget budget(100 * kMib);
  {
    WorkerMemory memory(&budget);
    EXPECT_TRUE(memory.Reserve(kWorkerBytes, 0));
    EXPECT_EQ(budget.held(), 0u);
    EXPECT_TRUE(memory.Reserve(kWorkerBytes + 10 * kMib, 0));
    EXPECT_EQ(budget.held(), 10 * kMib);
    EXPECT_TRUE(memory.Reserve(kWorkerBytes + 4 * kMib, 0)) << "its buffers do not shrink";
    EXPECT_EQ(budget.held(), 10 * kMib);
    EXPECT_TRUE(memory.Reserve(kWorkerBytes + 30 * kMib, 0));
    EXPECT_EQ(budget.held(), 30 * kMib);
    memory.GiveBack();
    EXPECT_EQ(budget.held(), 0u);
    EXPECT_TRUE(memory.Reserve(kWorkerBytes + 7 * kMib, 0));
  }
  EXPECT_EQ(budget.held(), 0u) << "with the worker goes what it held";
}

TEST(WorkerMemory, RefusesWhatTheBudgetHasNoRoomFor) {
  MemoryBudget budget(100 * kMib);
  budget.Take(60 * kMib);  // Requests and responses.
  WorkerMemory memory(&budget), other(&budget);
  EXPECT_FALSE(memory.Reserve(kWorkerBytes + 41 * kMib, 0));
  EXPECT_EQ(budget.held(), 60 * kMib);
  EXPECT_TRUE(memory.Reserve(kWorkerBytes + 40 * kMib, 0));
  EXPECT_FALSE(other.Reserve(kWorkerBytes + 1, 0));
  EXPECT_TRUE(other.Reserve(kWorkerBytes, 0)) << "its own share";
}

TEST(WorkerMemory, GrantsWhatParticlesNeedHoweverSmallTheBudgetIs) {
  MemoryBudget budget(1);
  WorkerMemory memory(&budget);
  constexpr std::size_t kParticles = 1'000'000;
  const std::uint64_t most = kWorkerBytes + kWorkerBytesPerParticle * kParticles;
  EXPECT_TRUE(memory.Reserve(most, kParticles));
  EXPECT_EQ(budget.held(), most - kWorkerBytes) << "it counts all the same";
  EXPECT_TRUE(memory.Reserve(most + 1, kParticles)) << "the budget's byte is still free";
  EXPECT_FALSE(memory.Reserve(most + 2, kParticles));
}

TEST(WorkerMemory, StatesOfFormerFramesAreUsual) {
  MemoryBudget budget(1);
  WorkerMemory memory(&budget);
  EXPECT_FALSE(memory.Reserve(kWorkerBytes + 80 * kMib, 1000));
  EXPECT_TRUE(memory.Reserve(kWorkerBytes + 80 * kMib, 1000, 80 * kMib));
}

TEST(WorkerMemory, WithoutABudgetGrantsEverything) {
  WorkerMemory memory;
  EXPECT_TRUE(memory.Reserve(~std::uint64_t{0}, 0));
}

}  // namespace
}  // namespace partiemc::server
