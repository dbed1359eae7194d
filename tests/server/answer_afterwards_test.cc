// When a worker serves watchers: after the producer's response has been written.
#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "server/compute/memory_budget.h"
#include "server/moving_blob.h"
#include "server/scripted_transport.h"

namespace partiemc::server {
namespace {

class AnswerAfterwards : public ::testing::Test {
 protected:
  // The write in progress when the worker ran the work after an answer.
  struct Moment {
    std::optional<Outgoing> what;
    std::uint64_t sequence = 0;
  };

  void SetUp() override {
    transport_.afterwards = [this] {
      const auto& writing = transport_.writing();
      moments_.push_back(writing ? Moment{writing->what, writing->sequence} : Moment{});
    };
    transport_.BringRequest({.kind = RequestKind::kOpen, .positions = {}});
  }
  void SendFrame(std::uint64_t sequence) {
    transport_.BringRequest(
        {.kind = RequestKind::kFrame, .sequence = sequence, .positions = MovingBlob(1, sequence)});
  }

  SteppedPool pool_;
  MemoryBudget budget_{std::uint64_t{1} << 30};
  ScriptedTransport transport_{pool_, budget_, 4, BlobParameters(), kBlobLimits};
  std::vector<Moment> moments_;
};

TEST_F(AnswerAfterwards, ComesOnceTheAnswerIsOnItsWay) {
  transport_.EndWrite(true);  // Ends the write of `opened`.
  for (std::uint64_t k = 1; k <= 3; ++k) {
    SendFrame(k);
    pool_.Step();
    ASSERT_EQ(moments_.size(), k);
    EXPECT_EQ(moments_.back().what, Outgoing::kAnswer);
    EXPECT_EQ(moments_.back().sequence, k);
    transport_.EndWrite(true);
  }
}

TEST_F(AnswerAfterwards, DoesNotWaitForAClientThatTakesNoAnswers) {
  ASSERT_EQ(transport_.writing()->what, Outgoing::kOpened);  // Stays in progress.
  for (std::uint64_t k = 1; k <= 4; ++k) {
    SendFrame(k);
    pool_.Step();
    ASSERT_EQ(moments_.size(), k);
    EXPECT_EQ(moments_.back().what, Outgoing::kOpened);
  }
}

TEST_F(AnswerAfterwards, ComesForAFrameWhoseStreamEndsWhileItIsComputed) {
  transport_.EndWrite(true);
  SendFrame(1);
  transport_.meanwhile = [this] {
    transport_.EndReads();
    transport_.machine().Cancelled();
  };
  pool_.Step();
  EXPECT_TRUE(transport_.finished());
  ASSERT_EQ(moments_.size(), 1u);
  EXPECT_EQ(moments_.back().what, std::nullopt);
}

}  // namespace
}  // namespace partiemc::server
