// After a loss: which address is tried when, and what comes of it.
#include "client/library/retry_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <string>
#include <thread>
#include <vector>

namespace partiemc::client {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Outcome = RetryLoop::Outcome;

// What each attempt says in turn; the last one says it for ever.
class Scripted final : public Attempts {
 public:
  struct Answer {
    absl::StatusOr<bool> opened = false;
    bool retryable = true;
  };

  explicit Scripted(std::vector<Answer> answers) : answers_(answers.begin(), answers.end()) {}

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
  void Wait(Clock::time_point until) override { std::this_thread::sleep_until(until); }

  std::vector<std::string> started;
  int dropped = 0;
  bool cancelled = false;

 private:
  std::deque<Answer> answers_;
};

RetryLoop Loop(milliseconds give_up_after = milliseconds(10000),
               milliseconds connect_timeout = milliseconds(1000)) {
  return RetryLoop({"a", "b"}, "stream",
                   {.give_up_after = give_up_after,
                    .first_pause = milliseconds(1),
                    .longest_pause = milliseconds(2)},
                   connect_timeout);
}

const Scripted::Answer kBusy{.opened = absl::UnavailableError("busy")};

TEST(RetryLoop, TriesOneAddressAfterTheOtherUntilOneOpens) {
  RetryLoop loop = Loop();
  Scripted attempts({kBusy, kBusy, {.opened = true}});
  loop.Lose("lost a");
  loop.TryNext(absl::UnavailableError("gone"));
  const auto outcome = loop.Run(attempts, {});
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(*outcome, Outcome::kOpened);
  EXPECT_THAT(attempts.started, ElementsAre("b", "a", "b"));
  EXPECT_EQ(attempts.dropped, 2);
  EXPECT_TRUE(loop.lost());
}

TEST(RetryLoop, TriesWhatItLearnedAfterWhatItWasGiven) {
  RetryLoop loop = Loop();
  loop.Learn({"c", "a", "d"});
  EXPECT_THAT(loop.addresses(), ElementsAre("a", "b", "c", "d"));
  Scripted attempts({kBusy, {.opened = true}});
  loop.Lose("lost a");
  loop.TryNext(absl::UnavailableError("gone"));
  ASSERT_TRUE(loop.Run(attempts, {}).ok());
  EXPECT_THAT(attempts.started, ElementsAre("b", "c"));
  // The one in use stays, what was learned before does not.
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

TEST(RetryLoop, TellsItsStoryAlsoOnceItHasRecovered) {
  RetryLoop loop = Loop();
  Scripted attempts({Scripted::Answer{.opened = true}});
  loop.Lose("lost a (cut)");
  loop.Lose("lost it again");
  loop.TryNext(absl::UnavailableError("gone"));
  ASSERT_TRUE(loop.Run(attempts, {}).ok());
  loop.Recovered();
  EXPECT_FALSE(loop.lost());
  EXPECT_THAT(loop.Story(), HasSubstr("lost a (cut), went on at b after 0"));
}

TEST(RetryLoop, TriesTheSameAddressWhereItIsToldTo) {
  RetryLoop loop = Loop();
  Scripted attempts({Scripted::Answer{.opened = true}});
  loop.Lose("lost a");
  loop.TryAgain(absl::UnavailableError("gone"));
  ASSERT_TRUE(loop.Run(attempts, {}).ok());
  EXPECT_THAT(attempts.started, ElementsAre("a"));
}

TEST(RetryLoop, EndsWithWhatNoOtherAttemptMayChange) {
  RetryLoop loop = Loop();
  Scripted attempts({kBusy, {.opened = absl::NotFoundError("no such"), .retryable = false}});
  loop.Lose("lost a");
  EXPECT_EQ(loop.Run(attempts, {}).status(), absl::NotFoundError("no such"));
  EXPECT_THAT(attempts.started, ElementsAre("a", "b"));
  EXPECT_EQ(attempts.dropped, 2);
}

TEST(RetryLoop, GivesUpInTimeAndKeepsWhatTheLastAttemptSaid) {
  RetryLoop loop = Loop(milliseconds(30));
  Scripted attempts({kBusy, kBusy, {.opened = false}});  // The last one never says a word.
  loop.Lose("lost a");
  EXPECT_EQ(*loop.Run(attempts, {}), Outcome::kGaveUp);
  EXPECT_EQ(loop.refusal(), absl::UnavailableError("busy"));
}

TEST(RetryLoop, AnAttemptThatTakesTooLongIsNotAccepted) {
  RetryLoop loop = Loop(milliseconds(60), milliseconds(10));
  Scripted attempts({Scripted::Answer{.opened = false}});
  loop.Lose("lost a");
  EXPECT_EQ(*loop.Run(attempts, {}), Outcome::kGaveUp);
  EXPECT_THAT(std::string(loop.refusal().message()), HasSubstr("did not accept the stream"));
  EXPECT_GE(attempts.started.size(), 2u);
}

TEST(RetryLoop, GoesOnWithTheSameAttemptAtTheNextCall) {
  RetryLoop loop = Loop();
  Scripted attempts({Scripted::Answer{.opened = false}});
  loop.Lose("lost a");
  const auto soon = [] { return Attempts::Clock::now() + milliseconds(5); };
  EXPECT_EQ(*loop.Run(attempts, soon()), Outcome::kNotYet);
  EXPECT_EQ(*loop.Run(attempts, soon()), Outcome::kNotYet);
  EXPECT_THAT(attempts.started, ElementsAre("a"));
  attempts.cancelled = true;
  EXPECT_EQ(*loop.Run(attempts, {}), Outcome::kCancelled);
}

}  // namespace
}  // namespace partiemc::client
