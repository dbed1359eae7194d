#include "resume/history.h"

#include <algorithm>
#include <set>

namespace partiemc::resume {
namespace {

using testing::AssertionFailure;
using testing::AssertionSuccess;

}  // namespace

testing::AssertionResult Complete(const History& history) {
  if (!history.end.ok()) return AssertionFailure() << "it ended with " << history.end;
  std::set<std::uint64_t> answered;
  for (const Answer& answer : history.answers) answered.insert(answer.sequence);
  for (std::uint64_t k = 1; k <= history.sent; ++k) {
    if (!answered.contains(k)) return AssertionFailure() << "frame " << k << " has no answer";
  }
  return AssertionSuccess();
}

testing::AssertionResult Ordered(const History& history) {
  const auto& answers = history.answers;
  const auto late = std::ranges::adjacent_find(
      answers, [](const Answer& a, const Answer& b) { return a.sequence > b.sequence; });
  if (late == answers.end()) return AssertionSuccess();
  return AssertionFailure() << "frame " << (late + 1)->sequence << " was answered after frame "
                            << late->sequence;
}

testing::AssertionResult Unique(const History& history) {
  std::set<std::uint64_t> answered;
  for (const Answer& answer : history.answers) {
    if (!answered.insert(answer.sequence).second) {
      return AssertionFailure() << "frame " << answer.sequence << " was answered twice";
    }
  }
  return AssertionSuccess();
}

testing::AssertionResult Identical(const History& history, const History& undisturbed) {
  for (const Answer& answer : history.answers) {
    if (answer.sequence < 1 || answer.sequence > undisturbed.answers.size()) {
      return AssertionFailure() << "there is no frame " << answer.sequence;
    }
    if (!answer.SameAs(undisturbed.answers[answer.sequence - 1])) {
      return AssertionFailure() << "frame " << answer.sequence << " has another answer";
    }
  }
  return AssertionSuccess();
}

testing::AssertionResult Bounded(const History& history, std::size_t window) {
  if (history.most_in_flight <= window) return AssertionSuccess();
  return AssertionFailure() << history.most_in_flight << " frames were in flight, " << window
                            << " are allowed";
}

void ExpectGuarantees(const History& history, const History& undisturbed, std::size_t window,
                      const std::string& what) {
  EXPECT_TRUE(Complete(history)) << what;
  EXPECT_TRUE(Ordered(history)) << what;
  EXPECT_TRUE(Unique(history)) << what;
  EXPECT_TRUE(Identical(history, undisturbed)) << what;
  EXPECT_TRUE(Bounded(history, window)) << what;
}

}  // namespace partiemc::resume
