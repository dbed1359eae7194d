// A part that completes the last frame gets its response, even if the stream of part 0 ends before
// the server has counted the part.
#include <gtest/gtest.h>

#include <cstdint>

#include "absl/status/status.h"
#include "server/compute/memory_budget.h"
#include "server/moving_blob.h"
#include "server/scripted_transport.h"

namespace partiemc::server {
namespace {

class LastPart : public ::testing::Test {
 protected:
  void SetUp() override {
    transport_.BringRequest({.kind = RequestKind::kOpen, .positions = {}});
    transport_.EndWrite(true);  // Ends the write of `opened`.
  }
  StreamStateMachine& machine() { return transport_.machine(); }
  void BringPart() {
    transport_.BringRequest(
        {.kind = RequestKind::kFrame, .sequence = 1, .positions = MovingBlob(1, 1)});
  }

  SteppedPool pool_;
  MemoryBudget budget_{std::uint64_t{1} << 30};
  ScriptedTransport transport_{pool_, budget_, 4, BlobParameters(), kBlobLimits};
};

TEST_F(LastPart, IsAnsweredAlthoughTheStreamOfPartZeroHasEnded) {
  machine().PartArrives();
  machine().LeftOut(absl::OkStatus());
  EXPECT_FALSE(transport_.finished());
  BringPart();
  pool_.Step();
  ASSERT_TRUE(transport_.writing());
  EXPECT_EQ(transport_.writing()->sequence, 1u);
  EXPECT_FALSE(transport_.finished());
  transport_.EndWrite(true);
  ASSERT_TRUE(transport_.finished());
  EXPECT_TRUE(transport_.finished()->ok()) << *transport_.finished();
}

TEST_F(LastPart, DoesNotDelayAnErrorOfPartZero) {
  machine().PartArrives();
  machine().LeftOut(absl::UnavailableError("part 0 is gone"));
  ASSERT_TRUE(transport_.finished());
  EXPECT_EQ(transport_.finished()->code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace partiemc::server
