// Events and actions of calls, and the table of the states that a call can be in.
#include "server/base/serialized_call.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <future>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace partiemc::server {
namespace {

// Each event adds one action of the test's own.
class Recorder final : public SerializedCall {
 public:
  Recorder() : SerializedCall(MachineKind::kStream) {}

  void Cause(Action action) {
    const Event event(*this);
    state_.reading = Reading::kFirst;
    Do(std::move(action));
  }
  void CauseTwo(Action first, Action second) {
    const Event event(*this);
    state_.reading = Reading::kFirst;
    Do(std::move(first));
    Do(std::move(second));
  }
  void Enter(const CallState& state) {
    const Event event(*this);
    state_ = state;
  }
  int decisions() const {
    const MutexLock lock(mutex_);
    return decisions_;
  }

 private:
  void Decide() override ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { ++decisions_; }

  int decisions_ ABSL_GUARDED_BY(mutex_) = 0;
};

TEST(SerializedCall, DecidesAfterEachEventAndRunsItsActions) {
  const auto call = std::make_shared<Recorder>();
  std::vector<int> ran;
  call->CauseTwo([&] { ran.push_back(1); }, [&] { ran.push_back(2); });
  call->Cause([&] { ran.push_back(3); });
  EXPECT_EQ(ran, (std::vector{1, 2, 3}));
  EXPECT_EQ(call->decisions(), 2);
}

TEST(SerializedCall, RunsActionsWithoutItsMutex) {
  const auto call = std::make_shared<Recorder>();
  call->Cause([&] { EXPECT_EQ(call->state().reading, Reading::kFirst); });
}

TEST(SerializedCall, RunsActionsOfANestedEventAfterTheOuterOnes) {
  const auto call = std::make_shared<Recorder>();
  std::vector<int> ran;
  call->CauseTwo(
      [&] {
        call->Cause([&] {
          ran.push_back(3);
          call->Cause([&] { ran.push_back(4); });
        });
        EXPECT_EQ(call->decisions(), 2) << "the event itself does not wait";
        ran.push_back(1);
      },
      [&] { ran.push_back(2); });
  EXPECT_EQ(ran, (std::vector{1, 2, 3, 4}));
}

TEST(SerializedCall, NestsDeeplyWithoutRecursion) {
  const auto call = std::make_shared<Recorder>();
  int left = 1'000'000;
  std::function<void()> again = [&] {
    if (--left > 0) call->Cause([&] { again(); });
  };
  call->Cause([&] { again(); });
  EXPECT_EQ(left, 0);
}

TEST(SerializedCall, AnEventDoesNotWaitForAnotherThreadsAction) {
  const auto call = std::make_shared<Recorder>();
  std::promise<void> began, go_on;
  std::vector<std::thread::id> ran;
  std::thread other([&] {
    call->Cause([&] {
      began.set_value();
      go_on.get_future().wait();
      ran.push_back(std::this_thread::get_id());
    });
  });
  const auto id = other.get_id();
  began.get_future().wait();
  call->Cause([&] { ran.push_back(std::this_thread::get_id()); });
  EXPECT_EQ(call->decisions(), 2);
  go_on.set_value();
  other.join();
  EXPECT_EQ(ran, (std::vector{id, id})) << "the other thread runs both";
}

TEST(SerializedCall, RunsOneActionAtATimeInTheOrderOfEachThread) {
  constexpr int kThreads = 4, kEvents = 5000;
  const auto call = std::make_shared<Recorder>();
  std::vector<std::vector<int>> ran(kThreads);
  int total = 0;  // Without a lock: ThreadSanitizer reports two actions at once.
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      for (int k = 0; k < kEvents; ++k) {
        call->Cause([&, thread, k] {
          ++total;
          ran[thread].push_back(k);
        });
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(total, kThreads * kEvents);
  EXPECT_EQ(call->decisions(), kThreads * kEvents);
  for (const auto& numbers : ran) {
    EXPECT_EQ(numbers.size(), kEvents);
    EXPECT_TRUE(std::ranges::is_sorted(numbers));
  }
}

TEST(SerializedCall, LivesUntilItsLastActionHasRun) {
  auto call = std::make_shared<Recorder>();
  const std::weak_ptr<Recorder> weak = call;
  bool ran = false;
  call->CauseTwo([&] { call = nullptr; },
                 [&] {
                   ran = true;
                   EXPECT_FALSE(weak.expired());
                 });
  EXPECT_TRUE(ran);
  EXPECT_TRUE(weak.expired());
}

TEST(SerializedCall, FreesWhatItsActionsHold) {
  const auto call = std::make_shared<Recorder>();
  const auto held = std::make_shared<int>(1);
  call->Cause([held] { EXPECT_EQ(*held, 1); });
  EXPECT_EQ(held.use_count(), 1);
}

TEST(SerializedCall, DetectsAnIllegalStateInDebugBuilds) {
  const auto call = std::make_shared<Recorder>();
  EXPECT_DEBUG_DEATH(call->Enter({.phase = Phase::kOpening, .writing = Writing::kResult}),
                     "IsLegal");
}

std::vector<CallState> AllStates() {
  std::vector<CallState> states;
  for (int n = 0; n < 3 * 6 * 6 * 3 * 6; ++n) {
    int rest = n;
    const auto take = [&](int values) { return std::exchange(rest, rest / values) % values; };
    states.push_back({.kind = static_cast<MachineKind>(take(3)),
                      .phase = static_cast<Phase>(take(6)),
                      .reading = static_cast<Reading>(take(6)),
                      .computing = static_cast<Computing>(take(3)),
                      .writing = static_cast<Writing>(take(6))});
  }
  return states;
}

TEST(CallStates, EachLegalStateIsInOneRow) {
  std::size_t legal = 0;
  for (const CallState& state : AllStates()) {
    const auto rows =
        std::ranges::count_if(AllLegalStates(), [&](const auto& row) { return row.Has(state); });
    EXPECT_LE(rows, 1) << state;
    EXPECT_EQ(IsLegal(state), rows == 1) << state;
    legal += rows == 1 ? 1 : 0;
  }
  EXPECT_EQ(legal, 156u) << "of 1944";
}

TEST(CallStates, IllegalOnesAreDetected) {
  using enum Phase;
  const CallState illegal[] = {
      {.phase = kOpening, .writing = Writing::kOpened},
      {.phase = kOpening, .reading = Reading::kFirst, .computing = Computing::kOpen},
      {.phase = kServing, .computing = Computing::kOpen},
      {.phase = kServing, .writing = Writing::kNotice},
      {.phase = kEnding, .reading = Reading::kMemory},
      {.phase = kClosing},
      {.phase = kAbandoned},
      {.phase = kFinished, .computing = Computing::kResult},
      {.phase = kFinished, .writing = Writing::kResult},
      {.kind = MachineKind::kUnary, .phase = kServing},
      {.kind = MachineKind::kUnary,
       .phase = kServing,
       .computing = Computing::kResult,
       .writing = Writing::kResult},
      {.kind = MachineKind::kUnary, .phase = kFinished, .reading = Reading::kNext},
      {.kind = MachineKind::kWatch, .phase = kServing, .computing = Computing::kResult},
      {.kind = MachineKind::kWatch, .phase = kServing, .reading = Reading::kPermit},
      {.kind = MachineKind::kWatch, .phase = kClosing, .reading = Reading::kNext},
  };
  for (const CallState& state : illegal) EXPECT_FALSE(IsLegal(state)) << state;
}

}  // namespace
}  // namespace partiemc::server
