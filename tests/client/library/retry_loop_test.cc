// Order and times of attempts after a loss.
#include "client/library/retry_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <string>
#include <vector>

#include "partiemc/status.h"
#include "support/manual_clock.h"

namespace partiemc::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using support::FixedRandom;
using support::ManualClock;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Outcome = RetryLoop::Outcome;

// Attempts with planned results; the last result repeats. Waiting moves the clock.
class Scripted final : public Attempts {
 public:
  struct Answer {
    absl::StatusOr<bool> opened = false;
    bool retryable = true;
  };

  Scripted(ManualClock& clock, std::vector<Answer> answers)
      : clock_(clock), answers_(answers.begin(), answers.end()) {}

  bool Cancelled() override { return cancelled; }
  absl::Status Start(const std::string& address) override {
    started.push_back(address);
    if (started.size() > 1 && answers_.size() > 1) answers_.pop_front();
    return absl::OkStatus();
  }
  absl::StatusOr<bool> Check(bool& retryable) override {
    retryable = answers_.front().retryable;
    return answers_.front().opened;
  }
  void Drop() override { ++dropped; }
  void Wait(TimePoint until) override { clock_.AdvanceTo(until); }

  std::vector<std::string> started;
  int dropped = 0;
  bool cancelled = false;

 private:
  ManualClock& clock_;
  std::deque<Answer> answers_;
};

// A stopped server: the kernel accepts connections, no response arrives until `goes_on_at`.
class Stopped final : public Attempts {
 public:
  Stopped(ManualClock& clock, TimePoint goes_on_at) : clock_(clock), goes_on_at_(goes_on_at) {}

  bool Cancelled() override { return false; }
  absl::Status Start(const std::string&) override { return absl::OkStatus(); }
  absl::StatusOr<bool> Check(bool&) override { return clock_.Now() >= goes_on_at_; }
  void Drop() override {}
  void Wait(TimePoint until) override { clock_.AdvanceTo(until); }

 private:
  ManualClock& clock_;
  const TimePoint goes_on_at_;
};

class RetryLoopTest : public testing::Test {
 protected:
  RetryLoop Loop(milliseconds give_up_after = milliseconds(10000),
                 milliseconds connect_timeout = milliseconds(1000)) {
    return RetryLoop({"a", "b"}, "stream",
                     {.give_up_after = give_up_after,
                      .first_pause = milliseconds(1),
                      .longest_pause = milliseconds(2)},
                     connect_timeout, {&clock_, &random_});
  }

  Outcome MeetStopped(seconds stopped_for, const ReconnectPolicy& policy) {
    constexpr seconds kNoticed(10);
    Stopped attempts(clock_, clock_.Now() + stopped_for);
    clock_.Advance(kNoticed);
    RetryLoop loop({"a"}, "stream", policy, seconds(2), {&clock_, &random_});
    loop.Lose("lost a");
    loop.TryNext(absl::UnavailableError("keepalive watchdog timeout"));
    return *loop.Run(attempts, {});
  }

  ManualClock clock_;
  FixedRandom random_{7};
};

const Scripted::Answer kBusy{.opened = absl::UnavailableError("busy")};

TEST_F(RetryLoopTest, TriesOneAddressAfterTheOtherUntilOneOpens) {
  RetryLoop loop = Loop();
  Scripted attempts(clock_, {kBusy, kBusy, {.opened = true}});
  loop.Lose("lost a");
  loop.TryNext(absl::UnavailableError("gone"));
  const auto outcome = loop.Run(attempts, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(*outcome, Outcome::kOpened);
  EXPECT_THAT(attempts.started, ElementsAre("b", "a", "b"));
  EXPECT_EQ(attempts.dropped, 2);
  EXPECT_TRUE(loop.lost());
}

TEST_F(RetryLoopTest, TriesWhatItLearnedAfterWhatItWasGiven) {
  RetryLoop loop = Loop();
  loop.Learn({"c", "a", "d"});
  EXPECT_THAT(loop.addresses(), ElementsAre("a", "b", "c", "d"));
  Scripted attempts(clock_, {kBusy, {.opened = true}});
  loop.Lose("lost a");
  loop.TryNext(absl::UnavailableError("gone"));
  ASSERT_TRUE(loop.Run(attempts, {}).ok());
  EXPECT_THAT(attempts.started, ElementsAre("b", "c"));
  // The address in use stays; other learned ones are replaced.
  loop.Learn({"e"});
  EXPECT_EQ(loop.address(), "c");
  EXPECT_THAT(loop.addresses(), ElementsAre("a", "b", "c", "e"));
  loop.UseNextAddress();
  loop.UseNextAddress();
  loop.Learn(std::vector<std::string>(1000, "f"));
  EXPECT_THAT(loop.addresses(), ElementsAre("a", "b", "f"));
  std::vector<std::string> many;
  for (int k = 0; k < 1000; ++k) many.push_back(std::to_string(k));
  loop.Learn(many);
  EXPECT_EQ(loop.addresses().size(), 18u);
}

TEST_F(RetryLoopTest, TellsItsStoryAlsoOnceItHasRecovered) {
  RetryLoop loop = Loop();
  Scripted attempts(clock_, {Scripted::Answer{.opened = true}});
  loop.Lose("lost a (cut)");
  loop.Lose("lost it again");
  loop.TryNext(absl::UnavailableError("gone"));
  ASSERT_TRUE(loop.Run(attempts, {}).ok());
  loop.Recovered();
  EXPECT_FALSE(loop.lost());
  EXPECT_THAT(loop.LossDescription(), HasSubstr("lost a (cut), continued at b after 0"));
}

TEST_F(RetryLoopTest, TriesTheSameAddressWhereItIsToldTo) {
  RetryLoop loop = Loop();
  Scripted attempts(clock_, {Scripted::Answer{.opened = true}});
  loop.Lose("lost a");
  loop.TryAgain(absl::UnavailableError("gone"));
  ASSERT_TRUE(loop.Run(attempts, {}).ok());
  EXPECT_THAT(attempts.started, ElementsAre("a"));
}

TEST_F(RetryLoopTest, EndsWithWhatNoOtherAttemptMayChange) {
  RetryLoop loop = Loop();
  Scripted attempts(clock_,
                    {kBusy, {.opened = absl::NotFoundError("no such"), .retryable = false}});
  loop.Lose("lost a");
  EXPECT_EQ(loop.Run(attempts, {}).status(), absl::NotFoundError("no such"));
  EXPECT_THAT(attempts.started, ElementsAre("a", "b"));
  EXPECT_EQ(attempts.dropped, 2);
}

TEST_F(RetryLoopTest, GivesUpInTimeAndKeepsWhatTheLastAttemptSaid) {
  RetryLoop loop = Loop(milliseconds(30));
  Scripted attempts(clock_, {kBusy, kBusy, {.opened = false}});  // The last one never responds.
  loop.Lose("lost a");
  EXPECT_EQ(*loop.Run(attempts, {}), Outcome::kGaveUp);
  EXPECT_EQ(loop.RefusalText(), "busy");
}

TEST_F(RetryLoopTest, TellsWhatAServerAnsweredBeforeAnotherWasGone) {
  RetryLoop loop = Loop(milliseconds(30));
  const Scripted::Answer answered{
      .opened = ViolationError(absl::StatusCode::kFailedPrecondition,
                               {"CHECKPOINT_SIGNATURE", "checkpoint", "unknown", "must be known"}),
      .retryable = true};
  Scripted attempts(clock_, {answered, kBusy, {.opened = false}});
  loop.Lose("lost a");
  EXPECT_EQ(*loop.Run(attempts, {}), Outcome::kGaveUp);
  EXPECT_EQ(loop.RefusalText(), "busy; before: checkpoint: unknown; must be known");
  loop.Recovered();
  loop.Lose("lost b");
  EXPECT_EQ(loop.RefusalText(), "");
}

TEST_F(RetryLoopTest, AnAttemptThatTakesTooLongIsNotAccepted) {
  RetryLoop loop = Loop(milliseconds(60), milliseconds(10));
  Scripted attempts(clock_, {Scripted::Answer{.opened = false}});
  loop.Lose("lost a");
  EXPECT_EQ(*loop.Run(attempts, {}), Outcome::kGaveUp);
  EXPECT_THAT(loop.RefusalText(), HasSubstr("did not accept the stream"));
  EXPECT_GE(attempts.started.size(), 2u);
}

TEST_F(RetryLoopTest, GoesOnWithTheSameAttemptAtTheNextCall) {
  RetryLoop loop = Loop();
  Scripted attempts(clock_, {Scripted::Answer{.opened = false}});
  loop.Lose("lost a");
  const auto soon = [&] { return clock_.Now() + milliseconds(5); };
  EXPECT_EQ(*loop.Run(attempts, soon()), Outcome::kNotYet);
  EXPECT_EQ(*loop.Run(attempts, soon()), Outcome::kNotYet);
  EXPECT_THAT(attempts.started, ElementsAre("a"));
  attempts.cancelled = true;
  EXPECT_EQ(*loop.Run(attempts, {}), Outcome::kCancelled);
}

TEST_F(RetryLoopTest, SurvivesAServerThatIsStoppedForMinutes) {
  for (const int stopped_for : {12, 39, 40, 41, 45, 60, 299}) {
    EXPECT_EQ(MeetStopped(seconds(stopped_for), {}), Outcome::kOpened) << stopped_for;
  }
  EXPECT_EQ(MeetStopped(seconds(311), {}), Outcome::kGaveUp);
  EXPECT_EQ(MeetStopped(seconds(41), {.give_up_after = kShortPatience}), Outcome::kGaveUp);
}

TEST_F(RetryLoopTest, ReportsHowLongItHasBeenTrying) {
  RetryLoop loop = Loop(seconds(60));
  loop.Lose("lost a (cut)");
  loop.TryNext(absl::UnavailableError("gone"));
  Scripted attempts(clock_, {kBusy});
  EXPECT_EQ(*loop.Run(attempts, clock_.Now() + seconds(7)), Outcome::kNotYet);
  const Reconnecting progress = loop.Progress();
  EXPECT_EQ(progress.loss, "lost a (cut)");
  EXPECT_EQ(progress.refusal, "busy");
  EXPECT_EQ(progress.elapsed, seconds(7));
  EXPECT_EQ(progress.give_up_after, seconds(60));
}

TEST_F(RetryLoopTest, PausesGrowToTheLongest) {
  RetryLoop loop({"a"}, "stream", {}, seconds(2), {&clock_, &random_});
  loop.Lose("lost a");
  Scripted attempts(clock_, {kBusy});
  EXPECT_EQ(*loop.Run(attempts, {}), Outcome::kGaveUp);
  // Pauses of up to 1 s, at least half of it: 300 to 600 attempts, and a few short ones.
  EXPECT_THAT(attempts.started.size(), testing::AllOf(testing::Ge(300u), testing::Le(610u)));
}

}  // namespace
}  // namespace partiemc::client
