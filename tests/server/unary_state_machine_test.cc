// Calls with one request and one response: for any order of events they end once, hold memory until
// the connection has accepted the response, and release it.
#include "server/stream/unary_state_machine.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/base/call_errors.h"
#include "server/reached_states.h"
#include "server/stream/stream_state_machine.h"
#include "server/stream/unary_registry.h"

namespace partiemc::server {
namespace {

using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr std::uint64_t kBudget = 1000;
constexpr UnaryLimits kUnaryLimits{.request = seconds(30), .answer = seconds(120)};

// A call driven by the test. Throws if the machine violates its contract.
class ScriptedCall final : private UnaryTransport {
 public:
  ScriptedCall(MemoryBudget& budget, ComputePool* pool, absl::Status admission = {},
               UnaryKind kind = UnaryKind::kFrame)
      : machine(std::make_shared<UnaryStateMachine>(static_cast<UnaryTransport&>(*this), budget,
                                                    pool, nullptr, kind)) {
    machine->Start(std::move(admission));
  }

  void Bring(std::uint64_t bytes) {
    reading = false;
    machine->ReadDone(bytes);
  }
  void EndRead() {
    reading = false;
    machine->ReadEnded();
  }
  void EndWrite(bool ok) {
    writing = false;
    machine->WriteDone(ok);
  }
  std::string Reason() const {
    const auto violation = FindViolation(finished.value());
    return violation ? violation->reason : "";
  }

  absl::StatusOr<std::uint64_t> answer = std::uint64_t{300};
  std::function<void()> while_answering = [] {};
  bool reading = false, writing = false, cut = false;
  std::optional<absl::Status> finished;
  std::shared_ptr<UnaryStateMachine> machine;

 private:
  void StartRead() override {
    if (reading || finished) throw std::logic_error("a second read, or one after the end");
    reading = true;
  }
  absl::StatusOr<std::uint64_t> Answer(Worker*) override {
    if (finished) throw std::logic_error("answered after the end");
    while_answering();
    return answer;
  }
  void StartWrite() override {
    if (writing || finished) throw std::logic_error("a second write, or one after the end");
    writing = true;
  }
  void Cut() override {
    if (finished) throw std::logic_error("cut after the end");
    cut = true;
  }
  void Finish(const absl::Status& status) override {
    if (finished || writing) throw std::logic_error("ended twice, or while writing");
    finished = status;
  }
};

TEST(UnaryStateMachine, HoldsTheRequestThenTheAnswerUntilItIsTaken) {
  MemoryBudget budget(kBudget);
  ScriptedCall call(budget, nullptr);
  ASSERT_TRUE(call.reading);
  EXPECT_EQ(budget.held(), 0u);
  call.while_answering = [&] { EXPECT_EQ(budget.held(), 700u); };
  call.Bring(700);
  ASSERT_TRUE(call.writing);
  EXPECT_EQ(budget.held(), 300u) << "an answer that is not taken counts";
  call.EndWrite(true);
  EXPECT_TRUE(call.finished.value().ok());
  EXPECT_EQ(budget.held(), 0u);
}

TEST(UnaryStateMachine, ARequestThatTheBudgetHasNoRoomForEndsIt) {
  MemoryBudget budget(kBudget);
  budget.Take(400);
  ScriptedCall call(budget, nullptr);
  call.Bring(700);
  EXPECT_EQ(call.Reason(), kReasonMemoryBudget);
  EXPECT_EQ(budget.held(), 400u);
}

TEST(UnaryStateMachine, AnAnswerThatTheBudgetHasNoRoomForEndsIt) {
  MemoryBudget budget(kBudget);
  budget.Take(400);
  ScriptedCall call(budget, nullptr);
  call.answer = 700;
  call.Bring(10);
  EXPECT_FALSE(call.writing);
  EXPECT_EQ(call.Reason(), kReasonMemoryBudget);
  EXPECT_EQ(FindViolation(*call.finished)->field, "answer");
  EXPECT_EQ(budget.held(), 400u);
}

TEST(UnaryStateMachine, AnAnswerMayHaveTheRoomOfItsRequest) {
  MemoryBudget budget(kBudget);
  ScriptedCall call(budget, nullptr);
  call.answer = kBudget;
  call.Bring(kBudget);
  ASSERT_TRUE(call.writing);
  EXPECT_EQ(budget.held(), kBudget);
  call.EndWrite(true);
  EXPECT_EQ(budget.held(), 0u);
}

TEST(UnaryStateMachine, ARequestForInformationNeedsNoRoom) {
  MemoryBudget budget(kBudget);
  budget.Take(kBudget);
  ScriptedCall call(budget, nullptr, {}, UnaryKind::kInformation);
  call.Bring(700);
  ASSERT_TRUE(call.writing);
  call.EndWrite(true);
  EXPECT_EQ(budget.held(), kBudget);
}

TEST(UnaryStateMachine, ARefusedCallReadsNothingAndEndsOnceDespiteACancel) {
  MemoryBudget budget(kBudget);
  ScriptedCall call(budget, nullptr, DrainingError());
  EXPECT_FALSE(call.reading);
  EXPECT_EQ(call.Reason(), kReasonDraining);
  call.machine->Cancelled();
  call.machine->GiveWay(DrainingError());
  EXPECT_EQ(call.Reason(), kReasonDraining);
}

TEST(UnaryStateMachine, ACallWithoutARequestIsMalformed) {
  MemoryBudget budget(kBudget);
  ScriptedCall call(budget, nullptr);
  call.EndRead();
  EXPECT_EQ(call.finished.value().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(call.Reason(), kReasonMalformed);
}

TEST(UnaryStateMachine, ARequestThatDoesNotComeInTimeEndsItAndIsToldWhy) {
  MemoryBudget budget(kBudget);
  ScriptedCall call(budget, nullptr);
  const auto due = call.machine->EndIfIdle(kUnaryLimits, steady_clock::now());
  EXPECT_LE(due, steady_clock::now() + kUnaryLimits.request);
  EXPECT_FALSE(call.finished);
  call.machine->EndIfIdle(kUnaryLimits, due);
  EXPECT_EQ(call.finished.value().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(call.Reason(), kReasonIdle);
}

TEST(UnaryStateMachine, AnAnswerThatIsNotTakenInTimeIsCutAndItsMemoryGivenBack) {
  MemoryBudget budget(kBudget);
  ScriptedCall call(budget, nullptr);
  call.Bring(10);
  EXPECT_EQ(budget.held(), 300u);
  call.machine->EndIfIdle(kUnaryLimits, steady_clock::now() + kUnaryLimits.request);
  EXPECT_FALSE(call.cut) << "the time for the answer is its own";
  call.machine->EndIfIdle(kUnaryLimits, steady_clock::now() + kUnaryLimits.answer);
  EXPECT_TRUE(call.cut);
  EXPECT_FALSE(call.finished) << "the write still goes on";
  call.EndWrite(false);
  EXPECT_EQ(call.Reason(), kReasonIdle);
  EXPECT_EQ(budget.held(), 0u);
}

TEST(UnaryStateMachine, ADrainAnswersWhatHasComeAndRefusesTheRest) {
  MemoryBudget budget(kBudget);
  ScriptedCall waiting(budget, nullptr), answered(budget, nullptr);
  answered.Bring(10);
  waiting.machine->GiveWay(DrainingError());
  answered.machine->GiveWay(DrainingError());
  EXPECT_EQ(waiting.Reason(), kReasonDraining);
  answered.EndWrite(true);
  EXPECT_TRUE(answered.finished.value().ok());
}

TEST(UnaryStateMachine, OneThatIsCancelledWhileItIsWorkedOnEndsWhenTheWorkDoes) {
  MemoryBudget budget(kBudget);
  ScriptedCall call(budget, nullptr);
  call.while_answering = [&] {
    EXPECT_FALSE(call.machine->cancelled());
    call.machine->Cancelled();
    EXPECT_TRUE(call.machine->cancelled());
    EXPECT_FALSE(call.finished) << "the transport is still used";
  };
  call.Bring(10);
  EXPECT_FALSE(call.writing);
  EXPECT_EQ(call.finished.value().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(budget.held(), 0u);
}

// All events of a call in random orders, some of them while it is computed.
TEST(UnaryStateMachine, InAnyOrderItEndsOnceWithNothingHeld) {
  constexpr unsigned kSeed = 20261122;
  std::mt19937 random(kSeed);
  ReachedStates reached;
  for (int order = 0; order < 20'000; ++order) {
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed << ", order " << order);
    MemoryBudget budget(kBudget);
    ScriptedCall call(budget, nullptr, random() % 8 == 0 ? DrainingError() : absl::OkStatus());
    if (random() % 4 == 0) call.answer = absl::InternalError("");
    if (random() % 4 == 0) call.answer = random() % 1500;
    const std::vector<std::function<void()>> outside = {
        [&] { call.machine->Cancelled(); }, [&] { call.machine->GiveWay(DrainingError()); },
        [&] {
          call.machine->EndIfIdle(kUnaryLimits, steady_clock::now() + seconds(random() % 200));
        }};
    call.while_answering = [&] { reached.Add(call.machine->state()); };
    if (random() % 2 == 0) {
      call.while_answering = [&, happens = outside[random() % outside.size()]] {
        happens();
        reached.Add(call.machine->state());
      };
    }
    for (int step = 0; step < 6; ++step) {
      reached.Add(call.machine->state());
      switch (random() % 5) {
        case 0:
          if (call.reading) call.Bring(random() % 1500);
          break;
        case 1:
          if (call.reading) call.EndRead();
          break;
        case 2:
          if (call.writing) call.EndWrite(random() % 2 == 0);
          break;
        default:
          outside[random() % outside.size()]();
      }
    }
    call.machine->Cancelled();
    reached.Add(call.machine->state());
    if (call.reading) call.EndRead();
    if (call.writing) call.EndWrite(false);
    reached.Add(call.machine->state());
    ASSERT_TRUE(call.finished.has_value());
    ASSERT_EQ(budget.held(), 0u);
  }
  reached.ExpectAllRowsOf(MachineKind::kUnary);
}

TEST(UnaryStateMachine, AWorkerAnswersItAndCancellingMeanwhileIsNoRace) {
  MemoryBudget budget(kBudget);
  std::vector<std::unique_ptr<ScriptedCall>> calls;
  {
    ComputePool pool(2);
    for (int i = 0; i < 100; ++i) calls.push_back(std::make_unique<ScriptedCall>(budget, &pool));
    for (const auto& call : calls) {
      call->Bring(1);
      call->machine->Cancelled();
    }
  }  // Waits for all work.
  for (const auto& call : calls) {
    if (call->writing) call->EndWrite(true);
    EXPECT_TRUE(call->finished.has_value());
  }
  EXPECT_EQ(budget.held(), 0u);
}

TEST(UnaryRegistry, EachKindOfCallsHasPlacesOfItsOwn) {
  MemoryBudget budget(kBudget);
  UnaryRegistry registry(1);
  const CallerAccount greedy, modest, late;
  ScriptedCall first(budget, nullptr), second(budget, nullptr), probe(budget, nullptr);
  ScriptedCall others(budget, nullptr), last(budget, nullptr), never(budget, nullptr);
  for (const auto* call : {&first, &second, &others, &last}) {
    EXPECT_TRUE(registry.Enter(call->machine, UnaryKind::kFrame).ok()) << "it has no request yet";
  }
  EXPECT_TRUE(registry.TakePlace(*first.machine, greedy).ok());
  const absl::Status refused = registry.TakePlace(*second.machine, greedy);
  EXPECT_EQ(FindViolation(refused)->reason, kReasonTooManyCalls);
  EXPECT_TRUE(registry.TakePlace(*others.machine, modest).ok()) << "there is always one for others";
  EXPECT_EQ(FindViolation(registry.TakePlace(*last.machine, late))->reason, kReasonTooManyCalls);
  EXPECT_TRUE(registry.Enter(probe.machine, UnaryKind::kInformation).ok());
  EXPECT_TRUE(registry.TakePlace(*probe.machine, greedy).ok());
  registry.Leave(*never.machine);  // Was never admitted.
  EXPECT_EQ(registry.count(), 5u);
  registry.GiveBackPlace(*first.machine);
  // A request that arrives while its call ends takes a slot; no call keeps a slot.
  EXPECT_TRUE(registry.TakePlace(*first.machine, greedy).ok());
  registry.Leave(*first.machine);
  EXPECT_TRUE(registry.TakePlace(*second.machine, greedy).ok());
}

TEST(UnaryRegistry, ADrainLetsNoFrameInAndEndsCallsWhoseRequestHasNotCome) {
  MemoryBudget budget(kBudget);
  UnaryRegistry registry(2);
  ScriptedCall call(budget, nullptr), late(budget, nullptr);
  ASSERT_TRUE(registry.Enter(call.machine, UnaryKind::kFrame).ok());
  registry.Drain();
  EXPECT_EQ(call.Reason(), kReasonDraining);
  EXPECT_EQ(FindViolation(registry.Enter(late.machine, UnaryKind::kFrame))->reason,
            kReasonDraining);
  EXPECT_FALSE(registry.WaitForFrames(steady_clock::now()));
  registry.Leave(*call.machine);
  EXPECT_TRUE(registry.WaitForFrames(steady_clock::now()));
}

TEST(UnaryRegistry, NoDrainWaitsForACallForInformation) {
  MemoryBudget budget(kBudget);
  UnaryRegistry registry(2);
  registry.Drain();
  ScriptedCall mute(budget, nullptr, {}, UnaryKind::kInformation);
  ASSERT_TRUE(registry.Enter(mute.machine, UnaryKind::kInformation).ok());
  EXPECT_TRUE(registry.WaitForFrames(steady_clock::now()));
}

}  // namespace
}  // namespace partiemc::server
