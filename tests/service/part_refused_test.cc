// The rows of "A part is refused" in proto/PROTOCOL.md: one test per row, named by its reason, with
// exact reason and message (golden_messages.txt). error_table_test.cc finds rows without a test.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "service/error_testing.h"
#include "service/parts_testing.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

class PartRefused : public ErrorTable {
 protected:
  void SetUp() override {
    options_.limits.max_parts = 4;
    Serve();
  }

  // Waits until parts of at least these bytes have arrived.
  void WaitUntilHeld(std::uint64_t bytes) {
    ASSERT_TRUE(Eventually([&] { return InfoOf(channel_).load().memory_held() >= bytes; }));
  }
  void ExpectError(const v1::ReconstructResponse& answer, const std::string& reason) {
    ASSERT_TRUE(answer.has_error()) << answer.ShortDebugString().substr(0, 200);
    const v1::FrameError& error = answer.error();
    EXPECT_EQ(error.reason(), reason);
    messages_.Expect(error.message());
    EXPECT_TRUE(IsFieldOrSubject(error.field())) << error.field();
  }
  void ExpectEnd(StreamClient& client, grpc::StatusCode code, const std::string& reason) {
    const grpc::Status status = client.Finish();
    EXPECT_EQ(status.error_code(), code);
    EXPECT_EQ(client.reason(), reason);
    messages_.Expect(status.error_message());
    ExpectDetails(status, reason);
  }
  void ExpectNotOpened(const v1::ReconstructRequest& open, grpc::StatusCode code,
                       const std::string& reason) {
    StreamClient client(Connect(*server_, Transport::kTcp));
    EXPECT_FALSE(client.SendAndReceive(open).has_opened());
    ExpectEnd(client, code, reason);
  }
};

TEST_F(PartRefused, PARTS_MISSING) {
  Ranks ranks(*server_, "tank", 3, 50);
  ranks.Send(0, 1);
  ExpectError(ranks[0].Receive(), "PARTS_MISSING");
}

// One Reconstruct call, optionally with a token.
class TokenCall {
 public:
  TokenCall(v1::ReconstructionService::Stub& stub, const std::string& token) {
    SetDeadline(context_);
    if (!token.empty()) context_.AddMetadata("authorization", "Bearer " + token);
    call_ = stub.Reconstruct(&context_);
  }
  v1::ReconstructResponse Exchange(const v1::ReconstructRequest& request) {
    v1::ReconstructResponse response;
    EXPECT_TRUE(call_->Write(request) && call_->Read(&response));
    return response;
  }
  ~TokenCall() {
    context_.TryCancel();
    call_->Finish();
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::ReconstructRequest, v1::ReconstructResponse>> call_;
};

// The answer to a part of a call that was idle while another stream waited for the only slot.
v1::ReconstructResponse AnswerAfterIdling(v1::ReconstructionService::Stub& stub,
                                          const std::string& token,
                                          const v1::ReconstructRequest& part) {
  TokenCall leader(stub, token), member(stub, token), other(stub, token);
  EXPECT_TRUE(leader.Exchange(OpenPart("tank", 0, 2)).has_opened());
  EXPECT_TRUE(member.Exchange(OpenPart("tank", 1, 2)).has_opened());
  EXPECT_TRUE(other.Exchange(OpenRequest("other")).has_opened());
  // Each of these takes the slot of the idle calls.
  EXPECT_TRUE(other.Exchange(BlobRequest(1, 1, 0)).has_frame());
  EXPECT_TRUE(other.Exchange(BlobRequest(2, 1, 1)).has_frame());
  return member.Exchange(part);
}

TEST_F(PartRefused, MEMORY_BUDGET) {
  options_.limits.memory_budget = 100;
  options_.limits.history_bytes = 0;  // It shares the budget.
  options_.limits.streams_beyond_budget = 1;
  Serve();
  const auto part = PartRequest(1, 2, 1, 1, 0, true);
  ExpectError(AnswerAfterIdling(*stub_, "", part), "MEMORY_BUDGET");
}

TEST_F(PartRefused, CALLER_BYTES) {
  constexpr char kToken[] = "parts-0123456789abcdef";
  const support::TemporaryFolder folder;
  options_.token_file = folder.Write("tokens", std::string(kToken) + " ranks bytes=100B\n");
  options_.limits.streams_beyond_budget = 1;
  Serve();
  const auto part = PartRequest(1, 2, 1, 1, 0, true);
  ExpectError(AnswerAfterIdling(*stub_, kToken, part), "CALLER_BYTES");
}

TEST_F(PartRefused, PART_MISMATCH) {
  Ranks ranks(*server_, "tank", 2);
  ranks.Send(0, 1, 1, /*ids=*/true);
  ranks.Send(1, 1, 1, /*ids=*/false);
  const auto answer = ranks[0].Receive();
  ExpectError(answer, "PART_MISMATCH");
  EXPECT_EQ(answer.error().next_sequence(), 2u);
  ranks.ExpectTaken(1, 1);
  ranks.SendAll(2);
  EXPECT_TRUE(ranks[0].Receive().has_frame());
}

TEST_F(PartRefused, PART_LATE) {
  Ranks ranks(*server_, "tank", 2, 50);
  ranks.Send(0, 1);
  EXPECT_TRUE(ranks[0].Receive().has_error());
  ranks.Send(1, 1);
  ExpectError(ranks[1].Receive(), "PART_LATE");
}

TEST_F(PartRefused, PART_DUPLICATE) {
  Ranks ranks(*server_, "tank", 2);
  ranks.Send(1, 1);
  ranks.Send(1, 1);
  // Part 0 comes after both.
  WaitUntilHeld(2 * PartRequest(1, 2, 1, 1, 0, true).ByteSizeLong());
  ranks.Send(0, 1);
  ranks.ExpectTaken(1, 1);
  ExpectError(ranks[1].Receive(), "PART_DUPLICATE");
}

TEST_F(PartRefused, PART_AHEAD) {
  Ranks ranks(*server_, "tank", 2);
  ranks.Send(1, 5);
  ExpectError(ranks[1].Receive(), "PART_AHEAD");
}

TEST_F(PartRefused, FRAME_BYTES) {
  Ranks ranks(*server_, "tank", 3);
  auto large = PartRequest(1, 3, 1, 1, 0, false);
  large.mutable_frame()->set_positions(std::string(700'000, 'x'));
  ranks[1].Send(large);
  WaitUntilHeld(700'000);
  ranks[2].Send(large);
  EXPECT_EQ(ranks[2].Receive().error().reason(), "FRAME_BYTES");
}

TEST_F(PartRefused, MALFORMED) {
  Ranks ranks(*server_, "tank", 2);
  auto strange = PartRequest(1, 2, 1, 1, 0, true);
  for (int k = 0; k < 5000; ++k) strange.mutable_frame()->add_scalars()->set_name("s");
  ranks[1].Send(strange);
  ExpectError(ranks[1].Receive(), "MALFORMED");
  ranks.SendAll(1);
  EXPECT_TRUE(ranks[0].Receive().has_frame());
}

TEST_F(PartRefused, OUT_OF_RANGE) {
  const auto expect = [this](const v1::ReconstructRequest& open) {
    ExpectNotOpened(open, grpc::StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
  };
  expect(OpenPart("tank", 0, 5));
  expect(OpenPart("tank", 3, 3));
  expect(OpenPart("tank", 1, 0));
  auto open = OpenPart("tank", 0, 2);
  open.mutable_open()->set_part_timeout_ms(600'001);
  expect(open);
  open = OpenPart("tank", 0, 2);
  open.mutable_open()->set_parts_token("line\nbreak");
  expect(open);
}

TEST_F(PartRefused, NO_SUCH_STREAM) {
  ExpectNotOpened(OpenPart("tank", 1, 2), grpc::StatusCode::NOT_FOUND, "NO_SUCH_STREAM");
}

TEST_F(PartRefused, PARTS_COUNT) {
  StreamClient whole(channel_);
  auto open = OpenRequest("whole");
  open.mutable_open()->set_parts_token(kPartsToken);
  ASSERT_TRUE(whole.SendAndReceive(open).has_opened());
  ExpectNotOpened(OpenPart("whole", 1, 2), grpc::StatusCode::FAILED_PRECONDITION, "PARTS_COUNT");
  Ranks ranks(*server_, "tank", 2);
  ExpectNotOpened(OpenPart("tank", 2, 3), grpc::StatusCode::FAILED_PRECONDITION, "PARTS_COUNT");
}

TEST_F(PartRefused, PARTS_TOKEN) {
  Ranks ranks(*server_, "tank", 2);
  auto open = OpenPart("tank", 1, 2);
  open.mutable_open()->set_parts_token("guessed");
  ExpectNotOpened(open, grpc::StatusCode::PERMISSION_DENIED, "PARTS_TOKEN");
  ranks.SendAll(1);
  EXPECT_TRUE(ranks[0].Receive().has_frame());
}

TEST_F(PartRefused, TOO_MANY_PARTS) {
  Ranks first(*server_, "first", 4), second(*server_, "second", 2);
  StreamClient third(channel_);
  ASSERT_TRUE(third.SendAndReceive(OpenPart("third", 0, 2)).has_opened());
  ExpectNotOpened(OpenPart("third", 1, 2), grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_PARTS");
}

TEST_F(PartRefused, TAKEN_OVER) {
  Ranks ranks(*server_, "tank", 2);
  StreamClient second(Connect(*server_, Transport::kTcp));
  ASSERT_TRUE(second.SendAndReceive(OpenPart("tank", 1, 2)).has_opened());
  ExpectEnd(ranks[1], grpc::StatusCode::ABORTED, "TAKEN_OVER");
}

TEST_F(PartRefused, LEADER_GONE) {
  Ranks ranks(*server_, "tank", 2);
  ranks[0].Cancel();
  ExpectEnd(ranks[1], grpc::StatusCode::UNAVAILABLE, "LEADER_GONE");
}

}  // namespace
}  // namespace partiemc::server
