// The compute pool: which worker a task gets, and how long a worker keeps its buffers. Also under
// ThreadSanitizer.
#include "server/compute/compute_pool.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <future>
#include <latch>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/security/caller.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using TimePoint = WarmSize::Clock::time_point;

constexpr seconds kLongEnough(20);

TEST(WarmSize, OutlivesItsUseWhenNothingOfAQuarterOfItComes) {
  const TimePoint start;
  WarmSize size;
  EXPECT_FALSE(size.Outlived(start + seconds(100), seconds(10))) << "nothing has been used";
  size.Used(1000, start);
  EXPECT_FALSE(size.Outlived(start + seconds(9), seconds(10)));
  EXPECT_TRUE(size.Outlived(start + seconds(10), seconds(10)));
  size.Used(250, start + seconds(9));
  EXPECT_FALSE(size.Outlived(start + seconds(18), seconds(10)));
  size.Used(249, start + seconds(18));
  EXPECT_TRUE(size.Outlived(start + seconds(19), seconds(10)));
}

// Submits `task` and waits until it has ended.
void RunAndWait(ComputePool& pool, const ComputePool::Job& task) {
  // Shared, because the thread that sets the promise may still use it when the waiting thread
  // continues.
  const auto done = std::make_shared<std::promise<void>>();
  pool.Submit(task, [done] { done->set_value(); });
  done->get_future().wait();
}

TEST(ComputePool, ATaskAfterAnotherGetsTheSameWorkerOnAnyThread) {
  std::set<const Worker*> workers;
  std::promise<void> done;
  std::function<void(int)> submit;
  ComputePool pool(4);  // Destroyed before the objects that its tasks use.
  // Like a stream, submits the next frame when the previous one has ended.
  submit = [&](int left) {
    pool.Submit([&](Worker& worker) { workers.insert(&worker); },
                [&, left] {
                  if (left > 0) submit(left - 1);
                  if (left == 0) done.set_value();
                });
  };
  submit(200);
  done.get_future().wait();
  EXPECT_EQ(workers.size(), 1u);
}

TEST(ComputePool, TasksAtTheSameTimeHaveWorkersOfTheirOwn) {
  std::promise<const Worker*> first, second;
  const auto first_worker = first.get_future().share();
  const auto second_worker = second.get_future().share();
  ComputePool pool(2);  // Destroyed before the objects that its tasks use.
  // Each task ends only after the other has begun.
  pool.Submit([&](Worker& worker) {
    first.set_value(&worker);
    second_worker.wait();
  });
  pool.Submit([&](Worker& worker) {
    second.set_value(&worker);
    first_worker.wait();
  });
  EXPECT_NE(first_worker.get(), second_worker.get());
}

// Records the order of turns in a pool of one thread. Jobs submitted before Order run after all of
// them have been submitted.
class Turns {
 public:
  Turns() {
    // Shared, because the thread that sets the promise may still use it when this one continues.
    const auto begun = std::make_shared<std::promise<void>>();
    pool_->Submit([this, begun](Worker&) {
      begun->set_value();
      all_submitted_.get_future().wait();
    });
    begun->get_future().wait();
  }
  // Jobs that wait at the same time, like calls of ReconstructFrame.
  void Calls(char name, int count, const CallerAccount* caller) {
    for (int i = 0; i < count; ++i) {
      pool_->Submit([this, name](Worker&) { order_ += name; }, [] {}, nullptr, caller);
    }
  }
  // Frames submitted one after the other, like those a stream sends.
  void Stream(char name, int frames, const CallerAccount* caller) {
    Next(name, frames, caller, &marks_.emplace_back());
  }
  std::string Order() {
    all_submitted_.set_value();
    pool_.reset();  // Runs all submitted jobs.
    return order_;
  }

 private:
  void Next(char name, int frames, const CallerAccount* caller, BusyStreams::Mark* mark) {
    if (frames == 0) return;
    const auto next = [=, this] { Next(name, frames - 1, caller, mark); };
    running_->Submit([this, name](Worker&) { order_ += name; }, next, mark, caller);
  }

  std::promise<void> all_submitted_;
  std::string order_;
  std::deque<BusyStreams::Mark> marks_;
  std::optional<ComputePool> pool_{1};
  ComputePool* const running_ = &*pool_;  // Also used while the pool runs its last jobs.
};

TEST(Turns, OfAllCallsOfACallerAreThoseOfOneStream) {
  const CallerAccount caller;
  Turns turns;
  turns.Calls('c', 6, &caller);
  turns.Stream('s', 3, &caller);
  turns.Stream('t', 2, &caller);
  EXPECT_EQ(turns.Order(),
            "cst"
            "cst"
            "cs"
            "ccc");
}

TEST(Turns, GoFromCallerToCallerHoweverManyStreamsAndCallsOneHas) {
  const CallerAccount greedy, modest;
  Turns turns;
  for (const char stream : {'1', '2', '3'}) turns.Stream(stream, 2, &greedy);
  turns.Calls('c', 4, &greedy);
  turns.Stream('m', 4, &modest);
  turns.Calls('n', 2, &modest);
  EXPECT_EQ(turns.Order(),
            "1m2n3mcn"
            "1m2m"
            "3c"
            "cc");
}

TEST(Turns, OfWhoComesLateComeBeforeTheBacklogOfOthers) {
  const CallerAccount first, second;
  Turns turns;
  turns.Calls('a', 5, &first);
  turns.Calls('b', 1, nullptr);
  turns.Calls('c', 2, &second);
  EXPECT_EQ(turns.Order(), "abcacaaa");
}

TEST(RecentCallers, KnowWhetherAnybodyElseHasCome) {
  const CallerAccount alice, bob, carol;
  const TimePoint start;
  RecentCallers recent;
  EXPECT_FALSE(recent.AnybodyBut(&alice, start)) << "nobody has come";
  recent.Came(&alice, start);
  EXPECT_FALSE(recent.AnybodyBut(&alice, start));
  EXPECT_TRUE(recent.AnybodyBut(&bob, start));
  recent.Came(&bob, start + seconds(1));
  recent.Came(&alice, start + seconds(2));
  recent.Came(&alice, start + seconds(3));
  EXPECT_TRUE(recent.AnybodyBut(&alice, start + seconds(1)));
  EXPECT_FALSE(recent.AnybodyBut(&alice, start + seconds(2))) << "Bob's visit is too old";
  recent.Came(&carol, start + seconds(4));
  EXPECT_TRUE(recent.AnybodyBut(&carol, start + seconds(3))) << "Alice";
  EXPECT_FALSE(recent.AnybodyBut(&carol, start + seconds(4)));
  EXPECT_FALSE(recent.AnybodyBut(nullptr, start + seconds(5)));
}

TEST(RoundRobin, WhoIsNotAllowedKeepsItsTurn) {
  RoundRobin<char, Line<int>> lines;
  for (const auto& [key, item] : {std::pair('a', 1), {'b', 2}, {'a', 3}}) lines.Push(key, item);
  EXPECT_EQ(lines.PopOf([](char key) { return key == 'b'; }), 2);
  EXPECT_EQ(lines.PopOf([](char key) { return key == 'b'; }), std::nullopt);
  EXPECT_EQ(lines.PopOf([](char) { return true; }), 1);
  EXPECT_EQ(lines.PopOf([](char) { return true; }), 3);
  EXPECT_TRUE(lines.empty());
}

TEST(ComputePool, LongJobsOfOneCallerLeaveAThreadToOthers) {
  const CallerAccount greedy, modest;
  std::latch done(3);
  std::promise<void> held_up;
  const auto go_on = held_up.get_future().share();
  std::atomic<int> running = 0, most = 0, free_places = 0;
  ComputePool pool(2);               // Destroyed before the objects that its tasks use.
  RunAndWait(pool, [](Worker&) {});  // Belongs to no caller, so that callers share.
  for (int k = 0; k < 3; ++k) {
    pool.Submit(
        [&](Worker&) {
          most = std::max<int>(most, ++running);
          go_on.wait();
          --running;
        },
        [&] { done.count_down(); }, nullptr, &greedy);
  }
  std::promise<void> through;
  pool.Submit([&](Worker&) { free_places = oneapi::tbb::this_task_arena::max_concurrency(); },
              [&] { through.set_value(); }, nullptr, &modest);
  EXPECT_EQ(through.get_future().wait_for(kLongEnough), std::future_status::ready)
      << "it waits for a job of another caller";
  EXPECT_EQ(free_places, 1) << "its pieces would wait for those of another caller";
  held_up.set_value();
  done.wait();
  EXPECT_EQ(most, 1);
}

TEST(ComputePool, ACallerAloneHasAllThreadsAgainAfterAWhile) {
  const CallerAccount gone, stays;
  std::atomic<int> places = 0;
  ComputePool pool(2);
  const auto run = [&](const CallerAccount& caller) {
    const auto done = std::make_shared<std::promise<void>>();
    pool.Submit([&](Worker&) { places = oneapi::tbb::this_task_arena::max_concurrency(); },
                [done] { done->set_value(); }, nullptr, &caller);
    done->get_future().wait();
  };
  run(gone);
  EXPECT_EQ(places, 2) << "alone";
  const TimePoint left = WarmSize::Clock::now();
  run(stays);
  if (WarmSize::Clock::now() - left < kSharingTime) {
    EXPECT_EQ(places, 1);
  }
  std::this_thread::sleep_until(left + kSharingTime + milliseconds(100));
  run(stays);
  EXPECT_EQ(places, 2);
}

// No job arrives and none ends when the time has passed.
TEST(ComputePool, AJobThatWaitsForACallerWhoHasGoneRunsAfterAWhile) {
  const CallerAccount gone, stays;
  std::promise<void> held_up, through;
  const auto go_on = held_up.get_future().share();
  ComputePool pool(2);
  std::promise<void> left;
  pool.Submit([](Worker&) {}, [&] { left.set_value(); }, nullptr, &gone);
  left.get_future().wait();
  pool.Submit([&](Worker&) { go_on.wait(); }, [] {}, nullptr, &stays);
  pool.Submit([](Worker&) {}, [&] { through.set_value(); }, nullptr, &stays);
  EXPECT_EQ(through.get_future().wait_for(kLongEnough), std::future_status::ready)
      << "a thread is idle beside it";
  held_up.set_value();
}

// Sets a promise when it is destroyed.
class Mourned final : public MessageBuffers {
 public:
  explicit Mourned(std::promise<void> gone) : gone_(std::move(gone)) {}
  ~Mourned() override { gone_.set_value(); }

 private:
  std::promise<void> gone_;
};

// A worker computes a large frame; the future is ready when its buffers are freed.
std::future<void> WorkOnALargeFrame(ComputePool& pool) {
  std::promise<void> gone;
  std::future<void> future = gone.get_future();
  auto buffers =
      std::make_shared<std::unique_ptr<MessageBuffers>>(std::make_unique<Mourned>(std::move(gone)));
  RunAndWait(pool, [buffers](Worker& worker) {
    worker.particles.Used(1'000'000, WarmSize::Clock::now());
    worker.message_buffers = std::move(*buffers);
  });
  return future;
}

TEST(ComputePool, AnIdleWorkerIsDroppedAfterAWhile) {
  ComputePool pool(2, milliseconds(50));
  const TimePoint start = WarmSize::Clock::now();
  const std::future<void> gone = WorkOnALargeFrame(pool);
  ASSERT_EQ(gone.wait_for(kLongEnough), std::future_status::ready);
  EXPECT_GE(WarmSize::Clock::now() - start, milliseconds(50));
}

TEST(ComputePool, AWorkerThatIsTooLargeForItsFramesIsDroppedAfterAWhile) {
  ComputePool pool(1, milliseconds(50));
  const std::future<void> gone = WorkOnALargeFrame(pool);
  const TimePoint give_up = WarmSize::Clock::now() + kLongEnough;
  // Never idle for the whole time limit.
  while (gone.wait_for(milliseconds(1)) != std::future_status::ready) {
    ASSERT_LT(WarmSize::Clock::now(), give_up);
    RunAndWait(pool, [](Worker& worker) { worker.particles.Used(1000, WarmSize::Clock::now()); });
  }
}

TEST(ComputePool, WhatIdleWorkersHoldIsGivenBackWhenSomebodyWantsIt) {
  constexpr std::uint64_t kMib = std::uint64_t{1} << 20;
  MemoryBudget budget(100 * kMib);
  ComputePool pool(2, std::chrono::hours(1), nullptr, &budget);
  RunAndWait(pool, [](Worker& worker) {
    worker.particles.Used(1'000'000, WarmSize::Clock::now());
    worker.memory.Reserve(kWorkerBytes + 90 * kMib, 1'000'000);
  });
  EXPECT_EQ(budget.held(), 90 * kMib) << "it is warm";
  EXPECT_EQ(budget.TryTake(20 * kMib), FairShare::Fit::kNoRoom);
  const TimePoint give_up = WarmSize::Clock::now() + kLongEnough;
  while (budget.held() > 0 && WarmSize::Clock::now() < give_up) {
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_EQ(budget.TryTake(20 * kMib), FairShare::Fit::kYes);
  budget.GiveBack(20 * kMib);
}

// Two workers compute large frames at the same time; each future is ready when its worker's buffers
// are freed.
std::array<std::future<void>, 2> WorkOnTwoLargeFramesAtOnce(ComputePool& pool) {
  std::array<std::future<void>, 2> gone;
  const auto begun = std::make_shared<std::latch>(2), done = std::make_shared<std::latch>(2);
  for (std::future<void>& future : gone) {
    std::promise<void> promise;
    future = promise.get_future();
    auto buffers = std::make_shared<std::unique_ptr<MessageBuffers>>(
        std::make_unique<Mourned>(std::move(promise)));
    pool.Submit(
        [begun, buffers](Worker& worker) {
          begun->arrive_and_wait();
          worker.particles.Used(1'000'000, WarmSize::Clock::now());
          worker.message_buffers = std::move(*buffers);
        },
        [done] { done->count_down(); });
  }
  done->wait();
  return gone;
}

std::size_t CountWaiting(const std::array<std::future<void>, 2>& futures) {
  return std::ranges::count_if(futures, [](const std::future<void>& future) {
    return future.wait_for(seconds(0)) == std::future_status::timeout;
  });
}

// Two workers are warm, then calls or `streams` streams take turns, so that one worker is enough.
// Returns the number of workers still warm much later than the idle time, after waiting for at most
// `expected`. Empty if the machine itself let them idle too long.
std::optional<std::size_t> KeptWhileTheyTakeTurns(std::size_t streams, std::size_t expected) {
  std::vector<BusyStreams::Mark> marks(streams);
  ComputePool pool(2, milliseconds(200));
  const auto gone = WorkOnTwoLargeFramesAtOnce(pool);
  TimePoint last = WarmSize::Clock::now();
  const TimePoint until = last + milliseconds(600), give_up = last + kLongEnough;
  for (std::size_t turn = 0; last < until || (CountWaiting(gone) > expected && last < give_up);
       ++turn) {
    const auto done = std::make_shared<std::promise<void>>();
    pool.Submit([](Worker& worker) { worker.particles.Used(300'000, WarmSize::Clock::now()); },
                [done] { done->set_value(); }, streams > 0 ? &marks[turn % streams] : nullptr);
    done->get_future().wait();
    if (WarmSize::Clock::now() - last > milliseconds(60)) return std::nullopt;
    last = WarmSize::Clock::now();
    std::this_thread::sleep_for(milliseconds(5));
  }
  return CountWaiting(gone);
}

class WorkersOfStreams : public ::testing::TestWithParam<std::size_t> {};

TEST_P(WorkersOfStreams, KeepsAsManyWorkersAsStreamsMayNeedAtOnce) {
  const std::size_t expected = std::max<std::size_t>(GetParam(), 1);
  const TimePoint give_up = WarmSize::Clock::now() + kLongEnough;
  std::optional<std::size_t> kept;
  while (!kept && WarmSize::Clock::now() < give_up) {
    kept = KeptWhileTheyTakeTurns(GetParam(), expected);
  }
  EXPECT_EQ(kept, expected);
}

INSTANTIATE_TEST_SUITE_P(NoneToTwo, WorkersOfStreams, ::testing::Values(0, 1, 2));

}  // namespace
}  // namespace partiemc::server
