// The memory budget: who gets memory, how much a machine has, and how streams behave without it.
#include "server/compute/memory_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "server/base/machine_limits.h"
#include "server/memory_transport.h"
#include "server/moving_blob.h"
#include "server/scripted_transport.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

using Fit = FairShare::Fit;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class Waiter final : public MemoryBudget::Waiter {
 public:
  void Granted(std::uint64_t bytes) override { granted.push_back(bytes); }
  std::vector<std::uint64_t> granted;
};

TEST(MemoryBudget, GivesWhatThereIsAndCountsWhatIsTakenAnyhow) {
  MemoryBudget budget(100);
  EXPECT_EQ(budget.TryTake(60), Fit::kYes);
  EXPECT_EQ(budget.TryTake(41), Fit::kNoRoom);
  EXPECT_EQ(budget.TryTake(40), Fit::kYes);
  budget.Take(1000);
  EXPECT_EQ(budget.held(), 1100u);
  EXPECT_EQ(budget.TryTake(1), Fit::kNoRoom);
  budget.GiveBack(1001);
  EXPECT_EQ(budget.TryTake(1), Fit::kYes);
}

TEST(MemoryBudget, IsNotFooledByNumbersThatRunOver) {
  MemoryBudget budget(100);
  budget.Take(1);
  EXPECT_EQ(budget.TryTake(std::numeric_limits<std::uint64_t>::max()), Fit::kNoRoom);
  EXPECT_EQ(budget.held(), 1u);
}

TEST(MemoryBudget, ServesThoseWhoWaitInTheirOrderAndLetsNobodyPast) {
  MemoryBudget budget(100);
  const auto large = std::make_shared<Waiter>(), small = std::make_shared<Waiter>();
  ASSERT_EQ(budget.TryTake(50), Fit::kYes);
  ASSERT_FALSE(budget.TakeOrWait(80, large));
  ASSERT_FALSE(budget.TakeOrWait(10, small)) << "there is room, but somebody came first";
  EXPECT_EQ(budget.TryTake(10), Fit::kNoRoom) << "likewise";
  budget.GiveBack(20);
  EXPECT_THAT(small->granted, IsEmpty());
  budget.GiveBack(30);
  EXPECT_THAT(large->granted, ElementsAre(80));
  EXPECT_THAT(small->granted, ElementsAre(10));
  EXPECT_EQ(budget.held(), 90u);
}

class Reader final : public ReadPermits::Reader {
 public:
  void ReadPermitted() override {}
  void ReadRevoked(const absl::Status&) override {}
};

// A worker that waits for memory while another worker computes beyond the budget.
class WaitingWorker : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(budget_.TryTake(60), Fit::kYes);
    ASSERT_EQ(budget_.TakeForWorker(1000, &beyond_), 1000u);
    ASSERT_TRUE(budget_.IsBeyond(&beyond_));
  }
  // Takes memory for the second worker on another thread.
  void Begin(std::uint64_t bytes) {
    taken_ = std::async(std::launch::async,
                        [this, bytes] { return budget_.TakeForWorker(bytes, &worker_); });
    ASSERT_EQ(taken_.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  }
  bool Gets() {
    const bool gets = taken_.wait_for(std::chrono::seconds(5)) == std::future_status::ready;
    budget_.GiveBackOfWorker(1000, &beyond_);  // Lets the worker end in any case.
    return gets;
  }

  int beyond_ = 0, worker_ = 0;
  MemoryBudget budget_{100, {.reads = {.streams_beyond = 1, .message_bytes = 40}}};
  std::future<std::uint64_t> taken_;
};

TEST_F(WaitingWorker, GoesOnWhenAClaimBeforeItIsGone) {
  const auto claim = std::make_shared<Waiter>();
  ASSERT_FALSE(budget_.TakeOrWait(80, claim));
  Begin(30);
  budget_.StopWaiting(claim);
  EXPECT_TRUE(Gets());
}

TEST_F(WaitingWorker, GoesOnWhenAReadEndsWithoutAMessage) {
  const auto reader = std::make_shared<Reader>();
  budget_.reads().BeginNow(reader, {.stream = reader.get(), .expected_bytes = 40});
  Begin(30);
  budget_.reads().End(*reader);
  EXPECT_TRUE(Gets());
}

TEST(MemoryBudget, WhoeverWaitsNoMoreOrHasGoneStandsInNobodysWay) {
  MemoryBudget budget(100);
  auto first = std::make_shared<Waiter>(), gone = std::make_shared<Waiter>();
  const auto last = std::make_shared<Waiter>();
  ASSERT_EQ(budget.TryTake(50), Fit::kYes);
  ASSERT_FALSE(budget.TakeOrWait(100, first));
  ASSERT_FALSE(budget.TakeOrWait(100, gone));
  ASSERT_FALSE(budget.TakeOrWait(30, last));
  gone.reset();
  budget.StopWaiting(first);
  EXPECT_THAT(first->granted, IsEmpty());
  EXPECT_THAT(last->granted, ElementsAre(30));
  budget.GiveBack(50);
  EXPECT_EQ(budget.held(), 30u);
}

TEST(MemoryBudget, OneCallerThatHoldsItsShareKeepsNobodyElseOut) {
  const CallerAccount greedy, modest;
  MemoryBudget budget(100);
  const auto first = std::make_shared<Waiter>(), second = std::make_shared<Waiter>();
  ASSERT_TRUE(budget.TakeOrWait(40, first, &greedy));
  ASSERT_FALSE(budget.TakeOrWait(40, first, &greedy)) << "more than would be free";
  ASSERT_FALSE(budget.TakeOrWait(5, second, &greedy)) << "behind one of the same caller";
  EXPECT_EQ(budget.TryTake(5, &greedy), Fit::kMoreThanShare);
  EXPECT_EQ(budget.TryTake(30, &modest), Fit::kYes);
  EXPECT_EQ(budget.TryTake(5, &modest), Fit::kMoreThanShare);
  budget.GiveBack(30, &modest);
  EXPECT_THAT(first->granted, IsEmpty());
  budget.GiveBack(40, &greedy);
  EXPECT_THAT(first->granted, ElementsAre(40));
  EXPECT_THAT(second->granted, ElementsAre(5));
  EXPECT_EQ(budget.held(), 45u);
}

TEST(MemoryBudget, OneOfSeveralCallersThatWaitsForRoomIsPassedByNobody) {
  const CallerAccount one, two, three;
  MemoryBudget budget(100);
  const auto large = std::make_shared<Waiter>();
  budget.Take(90, &one);
  ASSERT_FALSE(budget.TakeOrWait(60, large, &two));
  EXPECT_EQ(budget.TryTake(5, &three), Fit::kNoRoom);
  budget.GiveBack(90, &one);
  EXPECT_THAT(large->granted, ElementsAre(60));
}

TEST(MemoryBudget, ATokensBytesAreItsMost) {
  const CallerAccount caller(CallerQuota{.bytes = 10});
  MemoryBudget budget(100);
  EXPECT_EQ(budget.TryTake(11, &caller), Fit::kMoreThanShare);
  EXPECT_EQ(budget.TryTake(10, &caller), Fit::kYes);
  const auto waiter = std::make_shared<Waiter>();
  EXPECT_FALSE(budget.TakeOrWait(1, waiter, &caller));
  budget.GiveBack(1, &caller);
  EXPECT_THAT(waiter->granted, ElementsAre(1));
}

// The memory of callers changes while the next read is selected.
TEST(ReadPermits, SelectTheNextReadWhileCallersTakeAndGiveBack) {
  constexpr std::size_t kCallers = 300, kReaders = 300;
  constexpr int kRounds = 400;
  const std::vector<CallerAccount> callers(kCallers);
  MemoryBudget budget(1'000, {.reads = {.streams_beyond = 1, .message_bytes = 1'000}});
  for (const CallerAccount& caller : callers) budget.Take(100'000, &caller);
  std::vector<std::shared_ptr<Reader>> readers;
  for (std::size_t k = 0; k < kReaders; ++k) {
    readers.push_back(std::make_shared<Reader>());
    budget.reads().Begin(readers.back(),
                         {.stream = readers.back().get(), .caller = &callers[k % kCallers]});
  }
  std::vector<std::thread> threads;
  for (unsigned seed = 1; seed <= 16; ++seed) {
    threads.emplace_back([&, seed] {
      std::minstd_rand random(seed);
      for (int k = 0; k < kRounds; ++k) {
        const CallerAccount* const caller = &callers[random() % kCallers];
        const std::uint64_t bytes = 1 + random() % 1'000;
        budget.GiveBack(bytes, caller);  // Selects the next read, too.
        budget.Take(bytes, caller);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(budget.reads().waiting(), kReaders - 1);
  for (const auto& reader : readers) budget.reads().End(*reader);
  EXPECT_EQ(budget.reads().waiting(), 0u);
}

constexpr FrameLimits kFrameLimits{.max_particles = 2000, .max_tiles = 1000};
constexpr std::size_t kBudgetWindow = 4;

std::uint64_t FrameBytes() { return MovingBlob(1, 0).size() * sizeof(double); }

void SendAll(MemoryTransport& transport, std::uint64_t frames) {
  transport.Open();
  for (std::uint64_t i = 0; i < frames; ++i) transport.Send(i + 1, MovingBlob(1, i));
  transport.HalfClose();
}

std::size_t ReceiveFrames(MemoryTransport& transport) {
  std::size_t frames = 0;
  while (const auto answer = transport.Receive())
    frames += answer->what == Outgoing::kAnswer ? 1 : 0;
  return frames;
}

TEST(MemoryOfStreams, WithoutAnyBudgetEveryStreamStillGoesOnFrameByFrame) {
  ComputePool pool(2);
  MemoryBudget budget(0);
  MemoryTransport one(pool, budget, kBudgetWindow, BlobParameters(), kFrameLimits);
  MemoryTransport two(pool, budget, kBudgetWindow, BlobParameters(), kFrameLimits);
  SendAll(one, 12);
  SendAll(two, 12);
  std::size_t of_two = 0;
  std::thread other([&] { of_two = ReceiveFrames(two); });
  EXPECT_EQ(ReceiveFrames(one), 12u);
  other.join();
  EXPECT_EQ(of_two, 12u);
  EXPECT_TRUE(one.status().ok() && two.status().ok());
  // One answer is in the transport, neither in the server nor received.
  EXPECT_LE(one.most_inside(), 2u);
  EXPECT_EQ(budget.held(), 0u);
}

// A stream that does not receive pins its memory. The others continue, and get the whole budget
// when it ends.
TEST(MemoryOfStreams, AStreamThatPinsTheBudgetStopsNobody) {
  ComputePool pool(2);
  MemoryBudget budget(FrameBytes() * 3);
  MemoryTransport pinned(pool, budget, kBudgetWindow, BlobParameters(), kFrameLimits);
  MemoryTransport other(pool, budget, kBudgetWindow, BlobParameters(), kFrameLimits);
  SendAll(pinned, 12);
  pinned.WaitUntilRead(3);
  SendAll(other, 30);
  EXPECT_EQ(ReceiveFrames(other), 30u);
  EXPECT_TRUE(other.status().ok());
  pinned.Cancel();
  EXPECT_EQ(pinned.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(budget.held(), 0u);
}

TEST(MemoryOfStreams, ManyStreamsThatShareLittleAllEndAndGiveEverythingBack) {
  constexpr unsigned kSeed = 71;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  for (int round = 0; round < 20; ++round) {
    MemoryBudget budget(FrameBytes() * (random() % 6));
    auto pool = std::make_unique<ComputePool>(2);
    std::vector<std::unique_ptr<MemoryTransport>> transports;
    std::vector<std::thread> clients;
    for (int i = 0; i < 6; ++i) {
      transports.push_back(std::make_unique<MemoryTransport>(
          *pool, budget, 1 + random() % kBudgetWindow, BlobParameters(), kFrameLimits));
      SendAll(*transports.back(), 8);
      clients.emplace_back([&transport = *transports.back(), fate = random() % 4] {
        if (fate == 0) return transport.Cancel();
        if (fate == 1) return transport.machine().Drain();
        EXPECT_EQ(ReceiveFrames(transport), 8u);
      });
    }
    for (std::thread& client : clients) client.join();
    transports.clear();
    pool.reset();  // Its threads may still notify streams of free memory.
    EXPECT_EQ(budget.held(), 0u) << "round " << round;
  }
}

// A stream with a frame beyond the budget gives up its slot before it claims memory for the next
// frame. Otherwise, the frame would be counted neither in the budget nor in a slot.
TEST(MemoryOfStreams, KeepsTheSlotOfAFrameUntilTheFrameFits) {
  const std::uint64_t frame = FrameBytes();
  SteppedPool pool;
  MemoryBudget budget(2 * frame, {.reads = {.streams_beyond = 1, .message_bytes = frame}});
  ScriptedTransport first(pool, budget, kBudgetWindow, BlobParameters(), kFrameLimits);
  ScriptedTransport second(pool, budget, kBudgetWindow, BlobParameters(), kFrameLimits);
  budget.Take(2 * frame);
  for (ScriptedTransport* transport : {&first, &second}) {
    transport->BringRequest({.kind = RequestKind::kOpen, .positions = {}});
    transport->EndWrite(true);
  }
  ASSERT_TRUE(first.reading());
  ASSERT_FALSE(second.reading()) << "the first stream has the only slot";
  first.BringRequest({.kind = RequestKind::kFrame, .sequence = 1, .positions = MovingBlob(1, 0)});
  EXPECT_FALSE(first.reading());
  EXPECT_EQ(budget.planned(), 3 * frame);
  budget.GiveBack(frame);
  EXPECT_FALSE(first.reading()) << "there is no memory for its next frame";
  EXPECT_TRUE(second.reading()) << "the slot is free";
  EXPECT_EQ(budget.planned(), 3 * frame);
  budget.GiveBack(frame);
  EXPECT_LE(budget.planned(), 3 * frame);
  for (ScriptedTransport* transport : {&first, &second}) transport->machine().Cancelled();
  pool.Step();
  EXPECT_EQ(budget.planned(), 0u);
}

class MachineLimits : public ::testing::Test {
 protected:
  void Write(const std::string& path, const std::string& text) const {
    std::filesystem::create_directories(std::filesystem::path(root_ + path).parent_path());
    std::ofstream(root_ + path) << text;
  }
  const support::TemporaryFolder folder_;
  const std::string root_ = folder_.path();
};

TEST_F(MachineLimits, IsThatOfTheMachineWhereNoGroupLimitsIt) {
  Write("/proc/meminfo", "MemTotal:       1000 kB\nMemFree: 5 kB\n");
  Write("/proc/self/cgroup", "0::/a\n");
  Write("/sys/fs/cgroup/a/memory.max", "max\n");
  EXPECT_EQ(AvailableMemory(root_), 1'024'000u);
}

TEST_F(MachineLimits, IsTheLeastOfTheGroupsThatTheProcessIsIn) {
  Write("/proc/meminfo", "MemTotal:       1000 kB\n");
  Write("/proc/self/cgroup", "0::/a/b\n");
  Write("/sys/fs/cgroup/a/b/memory.max", "900000\n");
  Write("/sys/fs/cgroup/a/memory.max", "800000\n");
  EXPECT_EQ(AvailableMemory(root_), 800'000u);
}

TEST_F(MachineLimits, KnowsTheGroupsOfTheFirstVersionAsAContainerSeesThem) {
  Write("/proc/meminfo", "MemTotal:       1000 kB\n");
  Write("/proc/self/cgroup", "4:memory:/outside/of/here\n3:cpu:/\n0::/\n");
  Write("/sys/fs/cgroup/memory/memory.limit_in_bytes", "700000\n");
  EXPECT_EQ(AvailableMemory(root_), 700'000u);
}

TEST_F(MachineLimits, IsUnlimitedWhereNothingIsKnown) {
  EXPECT_EQ(AvailableMemory(root_), std::numeric_limits<std::uint64_t>::max());
}

TEST_F(MachineLimits, ProcessorsAreTheQuotaOfTheGroupsThatTheProcessIsInRoundedUp) {
  EXPECT_EQ(AvailableProcessors(8, root_), 8u);
  EXPECT_EQ(AvailableProcessors(0, root_), 1u) << "the system may not know";
  Write("/proc/self/cgroup", "0::/a/b\n");
  Write("/sys/fs/cgroup/a/b/cpu.max", "max 100000\n");
  EXPECT_EQ(AvailableProcessors(8, root_), 8u);
  Write("/sys/fs/cgroup/a/cpu.max", "250000 100000\n");
  EXPECT_EQ(AvailableProcessors(8, root_), 3u);
  EXPECT_EQ(AvailableProcessors(2, root_), 2u);
  Write("/sys/fs/cgroup/a/b/cpu.max", "20000 100000\n");
  EXPECT_EQ(AvailableProcessors(8, root_), 1u);
}

TEST_F(MachineLimits, ProcessorsOfTheFirstVersion) {
  Write("/proc/self/cgroup", "4:memory:/\n3:cpu,cpuacct:/outside\n0::/\n");
  Write("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n");
  Write("/sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(AvailableProcessors(8, root_), 8u);
  Write("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "400000\n");
  EXPECT_EQ(AvailableProcessors(8, root_), 4u);
}

}  // namespace
}  // namespace partiemc::server
