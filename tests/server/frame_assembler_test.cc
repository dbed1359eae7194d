// Frames in parts: every order of arrival, and every defect of a part. Also under ThreadSanitizer.
#include "server/stream/frame_assembler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/status.h"
#include "server/base/call_errors.h"
#include "support/reason_of.h"

namespace partiemc::server {
namespace {

using support::ReasonOf;

using std::chrono::milliseconds;

struct NumberedPart final : PartBytes {
  NumberedPart(std::uint32_t p, std::uint64_t s) : part(p), sequence(s) {}
  const std::uint32_t part;
  const std::uint64_t sequence;
};

class Member final : public AssemblyMember {
 public:
  void LookAgain() override { ++looks; }
  void LeftOut(const absl::Status& status) override { left.push_back(status); }

  int looks = 0;
  std::vector<absl::Status> left;
};

// An assembler with one member per part; member 0 is the leader.
class FrameAssemblerTest : public ::testing::Test {
 protected:
  void Begin(std::uint32_t parts, FrameAssembler::Terms terms = {}) {
    terms.parts = parts;
    terms.window = 4;
    if (terms.max_frame_bytes == 0) terms.max_frame_bytes = 1000;
    if (terms.timeout.count() == 0) terms.timeout = milliseconds(100);
    assembler_ = std::make_unique<FrameAssembler>(terms);
    members_.clear();
    seats_ = {{}};
    for (std::uint32_t part = 0; part < parts; ++part) {
      members_.push_back(std::make_shared<Member>());
      if (part > 0) seats_.push_back(*assembler_->Join(part, members_[part]));
    }
    assembler_->SetLeader(members_[0]);
  }
  absl::Status Offer(std::uint32_t part, std::uint64_t sequence, std::uint64_t bytes = 10,
                     milliseconds age = milliseconds(0)) {
    return assembler_->Offer(seats_[part], sequence, bytes,
                             std::make_shared<NumberedPart>(part, sequence), begin_ + age);
  }
  std::string Refusal(std::uint32_t part, std::uint64_t sequence, std::uint64_t bytes = 10) {
    return ReasonOf(Offer(part, sequence, bytes));
  }
  bool IsReady(std::uint64_t sequence, milliseconds age = milliseconds(0)) const {
    return assembler_->IsReady(sequence, begin_, begin_ + age);
  }
  // Takes frame `sequence`, which must be complete, and checks its parts.
  void ExpectWhole(std::uint64_t sequence) {
    const auto taken = assembler_->Take();
    ASSERT_TRUE(taken.ok()) << taken.status();
    for (std::uint32_t part = 1; part < assembler_->parts(); ++part) {
      const auto& bytes = static_cast<const NumberedPart&>(*taken->at(part - 1));
      EXPECT_EQ(bytes.part, part);
      EXPECT_EQ(bytes.sequence, sequence);
    }
    assembler_->Answered(sequence + 1, false);
  }

  const FrameAssembler::Clock::time_point begin_ = FrameAssembler::Clock::now();
  std::unique_ptr<FrameAssembler> assembler_;
  std::vector<std::shared_ptr<Member>> members_;
  std::vector<FrameAssembler::Seat> seats_;
};

TEST_F(FrameAssemblerTest, AFrameIsWholeWhenAllPartsHaveComeWhateverTheirOrder) {
  // Events: parts 1 to 3 of frames 1 and 2. Frame 2 may be complete before frame 1.
  std::vector<int> order(6);
  std::iota(order.begin(), order.end(), 0);
  do {
    Begin(4);
    int come[3] = {0, 0, 0};
    std::uint64_t next = 1;
    for (const int event : order) {
      const std::uint64_t sequence = 1 + event / 3;
      ASSERT_TRUE(Offer(1 + event % 3, sequence).ok());
      ++come[sequence];
      while (next <= 2 && come[next] == 3) {
        ASSERT_TRUE(IsReady(next));
        ExpectWhole(next++);
      }
      if (next <= 2) {
        ASSERT_FALSE(IsReady(next));
      }
    }
    ASSERT_EQ(next, 3u);
    ASSERT_GE(members_[0]->looks, 1);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST_F(FrameAssemblerTest, SixtyFourPartsInRandomOrdersOverAWindowOfFrames) {
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    SCOPED_TRACE(round);
    Begin(64);
    std::vector<std::pair<std::uint32_t, std::uint64_t>> events;
    for (std::uint32_t part = 1; part < 64; ++part) {
      for (std::uint64_t sequence = 1; sequence <= 4; ++sequence) {
        events.emplace_back(part, sequence);
      }
    }
    std::shuffle(events.begin(), events.end(), random);
    for (const auto& [part, sequence] : events) ASSERT_TRUE(Offer(part, sequence).ok());
    for (std::uint64_t sequence = 1; sequence <= 4; ++sequence) {
      ASSERT_TRUE(IsReady(sequence));
      ExpectWhole(sequence);
    }
  }
}

TEST_F(FrameAssemblerTest, OnePartAloneIsReadyAtOnce) {
  Begin(1);
  EXPECT_TRUE(IsReady(1));
  ExpectWhole(1);
}

TEST_F(FrameAssemblerTest, AMissingPartIsNamedOnceItsTimeIsOverAndTheNextFrameGoesOn) {
  Begin(4);
  ASSERT_TRUE(Offer(2, 1).ok());
  EXPECT_FALSE(IsReady(1, milliseconds(99)));
  EXPECT_TRUE(IsReady(1, milliseconds(100)));
  const auto taken = assembler_->Take();
  EXPECT_EQ(taken.status().message(),
            "parts: 1, 3; must come within 100 ms of the first part of their frame");
  EXPECT_EQ(ReasonOf(taken.status()), kReasonPartsMissing);
  EXPECT_EQ(Refusal(1, 1), kReasonPartLate);  // Not answered yet, but too late.
  assembler_->Answered(2, false);
  EXPECT_EQ(Refusal(3, 1), kReasonPartLate);
  for (std::uint32_t part = 1; part < 4; ++part) EXPECT_TRUE(Offer(part, 2).ok());
  ASSERT_TRUE(IsReady(2));
  ExpectWhole(2);
}

TEST_F(FrameAssemblerTest, OfManyMissingPartsTheFirstAreNamed) {
  Begin(64);
  EXPECT_EQ(FindViolation(assembler_->Take().status())->value,
            "1, 2, 3, 4, 5, 6, 7, 8 and 55 more");
}

TEST_F(FrameAssemblerTest, APartThatIsDoubledLateOrAheadIsRefusedAndChangesNothing) {
  Begin(2);
  ASSERT_TRUE(Offer(1, 1).ok());
  EXPECT_EQ(Refusal(1, 1), kReasonPartDuplicate);
  EXPECT_EQ(Refusal(1, 5), kReasonPartAhead);
  EXPECT_EQ(Refusal(1, std::numeric_limits<std::uint64_t>::max()), kReasonPartAhead);
  EXPECT_EQ(Refusal(1, 0), kReasonPartLate);
  ASSERT_TRUE(Offer(1, 4).ok());
  ExpectWhole(1);
  EXPECT_EQ(Refusal(1, 1), kReasonPartLate);
  ASSERT_TRUE(Offer(1, 5).ok());
}

TEST_F(FrameAssemblerTest, AFrameHoldsNoMoreBytesThanItMay) {
  Begin(3, {.max_frame_bytes = 100});
  ASSERT_TRUE(Offer(1, 1, 60).ok());
  EXPECT_EQ(Refusal(2, 1, 41), kReasonFrameBytes);
  EXPECT_EQ(Refusal(2, 2, 101), kReasonFrameBytes);
  EXPECT_EQ(Refusal(2, 2, std::numeric_limits<std::uint64_t>::max()), kReasonFrameBytes);
  ASSERT_TRUE(Offer(2, 1, 40).ok());
  ExpectWhole(1);
}

TEST_F(FrameAssemblerTest, PartsOfACallThatLeavesAreGoneAndComeAgainFromTheNext) {
  Begin(3);
  ASSERT_TRUE(Offer(1, 1).ok());
  ASSERT_TRUE(Offer(2, 1).ok());
  EXPECT_TRUE(IsReady(1));
  assembler_->Leave(seats_[1]);
  EXPECT_FALSE(IsReady(1));
  EXPECT_TRUE(absl::IsCancelled(Offer(1, 1)));
  seats_[1] = *assembler_->Join(1, members_[1]);
  ASSERT_TRUE(Offer(1, 1).ok());
  EXPECT_TRUE(IsReady(1));
  ExpectWhole(1);
}

TEST_F(FrameAssemblerTest, ACallTakesOverAPartFromAnotherWhichThenCannotTakeItAway) {
  Begin(2);
  const auto former = seats_[1];
  const auto second = std::make_shared<Member>();
  seats_[1] = *assembler_->Join(1, second);
  ASSERT_EQ(members_[1]->left.size(), 1u);
  EXPECT_EQ(ReasonOf(members_[1]->left[0]), kReasonTakenOver);
  ASSERT_TRUE(Offer(1, 1).ok());
  assembler_->Leave(former);
  EXPECT_TRUE(IsReady(1));
  EXPECT_TRUE(second->left.empty());
}

TEST_F(FrameAssemblerTest, TheTimeoutBeginsWithTheFirstPartThatIsHeld) {
  Begin(3);
  ASSERT_TRUE(Offer(1, 1).ok());
  const auto later = begin_ + milliseconds(60);  // Part 0 arrives.
  assembler_->LeaderSent(1);
  EXPECT_FALSE(assembler_->IsReady(1, later, begin_ + milliseconds(99)));
  EXPECT_TRUE(assembler_->IsReady(1, later, begin_ + milliseconds(100)));
}

TEST_F(FrameAssemblerTest, PartsAreNotHeldForAPart0ThatDoesNotCome) {
  Begin(3);
  ASSERT_TRUE(Offer(1, 1, 900).ok());
  EXPECT_FALSE(assembler_->IsOver(1, begin_ + milliseconds(99)));
  EXPECT_TRUE(assembler_->IsOver(1, begin_ + milliseconds(100)));
  EXPECT_EQ(assembler_->BytesOfNext(), 0u);
  EXPECT_EQ(ReasonOf(assembler_->OutcomeOf(1)), kReasonPartsMissing);
  EXPECT_EQ(FindViolation(assembler_->OutcomeOf(1))->value, "0, 1, 2");
  EXPECT_EQ(Refusal(2, 1), kReasonPartLate);
  EXPECT_EQ(Refusal(1, 2), "OK") << "the next frame is another one";
  // Part 0 arrives too late.
  assembler_->LeaderSent(1);
  EXPECT_TRUE(IsReady(1));
  EXPECT_EQ(ReasonOf(assembler_->Take().status()), kReasonPartsMissing);
}

TEST_F(FrameAssemblerTest, APartThatIsWithdrawnCanComeAgain) {
  Begin(2);
  ASSERT_TRUE(Offer(1, 1).ok());
  assembler_->Withdraw(seats_[1], 1);
  EXPECT_FALSE(IsReady(1));
  EXPECT_EQ(Refusal(1, 1), "OK");
  EXPECT_TRUE(IsReady(1));
}

TEST_F(FrameAssemblerTest, TheTimeoutForgetsPartsThatWereDropped) {
  Begin(3);
  const auto is_ready = [&](int age) {  // Part 0 arrives later than the parts.
    const auto since = begin_ + milliseconds(1000);
    return assembler_->IsReady(1, since, begin_ + milliseconds(age));
  };
  ASSERT_TRUE(Offer(1, 1).ok());
  ASSERT_TRUE(Offer(2, 1, 10, milliseconds(60)).ok());
  assembler_->Withdraw(seats_[1], 1);
  EXPECT_FALSE(is_ready(159)) << "part 2 is held since 60 ms";
  EXPECT_TRUE(is_ready(160));
  assembler_->Leave(seats_[2]);
  EXPECT_FALSE(is_ready(160)) << "no part is held";
  ASSERT_TRUE(Offer(1, 1, 10, milliseconds(500)).ok());
  EXPECT_FALSE(is_ready(599));
  EXPECT_FALSE(assembler_->IsOver(1, begin_ + milliseconds(599)));
  EXPECT_TRUE(is_ready(600));
}

TEST_F(FrameAssemblerTest, MembersAreToldOfAnswersAndOfTheEnd) {
  Begin(3);
  EXPECT_FALSE(assembler_->IsOver(1, begin_));
  ASSERT_TRUE(Offer(1, 1).ok());
  ASSERT_TRUE(Offer(2, 1).ok());
  ExpectWhole(1);
  assembler_->TellMembers();
  EXPECT_EQ(members_[1]->looks, 1);
  EXPECT_TRUE(assembler_->IsOver(1, begin_));
  EXPECT_TRUE(assembler_->OutcomeOf(1).ok());
  ASSERT_TRUE(Offer(1, 2).ok());
  assembler_->End(absl::OkStatus());
  ASSERT_EQ(members_[1]->left.size(), 1u);
  EXPECT_TRUE(members_[1]->left[0].ok());
  EXPECT_EQ(ReasonOf(assembler_->OutcomeOf(2)), kReasonPartLate);
  EXPECT_EQ(ReasonOf(assembler_->Join(1, members_[1]).status()), kReasonLeaderGone);
  assembler_->End(absl::OkStatus());  // Reported once.
  EXPECT_EQ(members_[1]->left.size(), 1u);
}

TEST_F(FrameAssemblerTest, MembersOfALeaderThatIsLostAreToldToComeBack) {
  Begin(2);
  assembler_->End(absl::CancelledError("gone"));
  EXPECT_EQ(ReasonOf(members_[1]->left.at(0)), kReasonLeaderGone);
  EXPECT_TRUE(absl::IsUnavailable(members_[1]->left[0]));
}

TEST_F(FrameAssemblerTest, DropsPartsWhenACheckpointThatCoversThemHasArrived) {
  Begin(1, {.has_checkpoints = true});
  EXPECT_EQ(assembler_->resume_sequence(), 1u);
  for (std::uint64_t sequence = 1; sequence <= 4; ++sequence) {
    ASSERT_TRUE(assembler_->Take().ok());
    assembler_->Answered(sequence + 1, sequence == 2);
  }
  assembler_->LeaderSent(5);  // The client has received answer 1.
  EXPECT_EQ(assembler_->resume_sequence(), 1u);
  assembler_->LeaderSent(6);
  EXPECT_EQ(assembler_->resume_sequence(), 3u);
  Begin(1);
  ASSERT_TRUE(assembler_->Take().ok());
  assembler_->Answered(2, false);
  EXPECT_EQ(assembler_->resume_sequence(), 2u);
}

TEST_F(FrameAssemblerTest, CallsOfManyThreadsLoseNothing) {
  constexpr std::uint64_t kFrames = 200;
  Begin(8);
  std::vector<std::thread> senders;
  for (std::uint32_t part = 1; part < 8; ++part) {
    senders.emplace_back([this, part] {
      for (std::uint64_t sequence = 1; sequence <= kFrames;) {
        if (Refusal(part, sequence) == kReasonPartAhead) {
          std::this_thread::yield();
        } else {
          ++sequence;
        }
      }
    });
  }
  for (std::uint64_t sequence = 1; sequence <= kFrames; ++sequence) {
    while (!IsReady(sequence)) std::this_thread::yield();
    ExpectWhole(sequence);
  }
  for (std::thread& sender : senders) sender.join();
}

}  // namespace
}  // namespace partiemc::server
