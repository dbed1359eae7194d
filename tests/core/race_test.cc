// Checks that ThreadSanitizer sees tasks correctly: a race between two tasks is reported, although
// oneTBB itself is hidden from it; work ordered by a fork and a join is not reported.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <thread>
#include <vector>

#include "base/fork_join.h"
#include "base/parallel.h"

namespace partiemc {
namespace {

constexpr int kReported = 66;  // The exit code that the sanitizer sets.

// Orders in time what the sanitizer is to take for unordered.
class Signal {
 public:
  void Give() { given_.fetch_add(1, std::memory_order_relaxed); }
  void Await(int count = 1) const {
    while (given_.load(std::memory_order_relaxed) < count) std::this_thread::yield();
  }

 private:
  std::atomic<int> given_{0};
};

// Runs `program` with tasks in two threads, also on a machine with one processor. Repeats it,
// because the sanitizer may miss a single race, such as two writes at the same instant.
[[noreturn]] void RunOnTwoThreads(const std::function<void()>& program) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 2);
  tbb::task_arena arena(2);
  for (int round = 0; round < 50; ++round) arena.execute(program);
  std::exit(EXIT_SUCCESS);
}

// Runs `first` and then `second` as tasks of one fork, in two threads.
template <typename First, typename Second>
void RunOneAfterTheOther(const First& first, const Second& second) {
  Signal first_is_over;
  ForkJoin fork_join;
  std::thread one([&] {
    {
      const ForkJoin::Task scope(fork_join);
      first();
    }
    first_is_over.Give();
  });
  std::thread other([&] {
    first_is_over.Await();
    const ForkJoin::Task scope(fork_join);
    second();
  });
  one.join();
  other.join();
}

class Race : public testing::Test {
 protected:
  Race() { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_F(Race, OfTwoTasksThatAreInvokedIsReported) {
  const auto program = [] {
    int shared = 0;
    Signal both, written;
    const auto meet = [&] {
      both.Give();
      both.Await(2);
    };
    ParallelInvoke(
        [&] {
          meet();
          shared = 1;
          written.Give();
        },
        [&] {
          meet();
          written.Await();
          shared = 2;
        });
  };
  EXPECT_EXIT(RunOnTwoThreads(program), testing::ExitedWithCode(kReported), "data race");
}

TEST_F(Race, OfTheTasksOfALoopIsReported) {
  const auto program = [] {
    std::vector<int> shared(1);
    Signal both, written;
    ParallelFor(2, [&](int k) {
      both.Give();
      both.Await(2);
      written.Await(k);
      shared[0] = k;
      written.Give();
    });
  };
  EXPECT_EXIT(RunOnTwoThreads(program), testing::ExitedWithCode(kReported), "data race");
}

TEST_F(Race, OfATaskWithOneThatWasOverBeforeItBeganIsReported) {
  const auto program = [] {
    int shared = 0;
    RunOneAfterTheOther([&] { shared = 1; }, [&] { shared = 2; });
  };
  EXPECT_EXIT(RunOnTwoThreads(program), testing::ExitedWithCode(kReported), "data race");
}

TEST_F(Race, OfATaskWithTheThreadThatForkedIsReported) {
  const auto program = [] {
    int shared = 0;
    Signal forked;
    ForkJoin fork_join;
    std::thread task([&] {
      forked.Await();
      const ForkJoin::Task scope(fork_join);
      ++shared;
    });
    shared = 1;
    forked.Give();
    task.join();
  };
  EXPECT_EXIT(RunOnTwoThreads(program), testing::ExitedWithCode(kReported), "data race");
}

TEST_F(Race, IsNoneWhereForkAndJoinOrderWhatIsShared) {
  const auto program = [] {
    std::vector<int> asked(10'000), answers(asked.size());
    for (int round = 0; round < 2; ++round) {
      std::iota(asked.begin(), asked.end(), round);
      ParallelFor(asked.size(), [&](std::size_t k) { answers[k] = 2 * asked[k]; });
      for (std::size_t k = 0; k < asked.size(); ++k) {
        if (answers[k] != 2 * asked[k]) std::exit(EXIT_FAILURE);
      }
      Signal both;
      const auto halve = [&](std::size_t first, std::size_t last) {
        both.Give();
        both.Await(2);
        for (std::size_t k = first; k < last; ++k) answers[k] /= 2;
      };
      ParallelInvoke([&] { halve(0, asked.size() / 2); },
                     [&] { halve(asked.size() / 2, asked.size()); });
      if (answers != asked) std::exit(EXIT_FAILURE);
    }
  };
  EXPECT_EXIT(RunOnTwoThreads(program), testing::ExitedWithCode(EXIT_SUCCESS), "");
}

}  // namespace
}  // namespace partiemc
