// The rows of "A part is refused" in proto/PROTOCOL.md: one test per row, named by its reason, with
// exact reason and words. error_table_test.cc finds rows without a test.
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
    ASSERT_TRUE(Eventually([&] {
      grpc::ClientContext context;
      SetDeadline(context);
      v1::GetServerInfoResponse info;
      return stub_->GetServerInfo(&context, {}, &info).ok() && info.load().memory_held() >= bytes;
    }));
  }
  static void ExpectError(const v1::ReconstructResponse& answer, const std::string& reason,
                          const std::string& message) {
    ASSERT_TRUE(answer.has_error()) << answer.ShortDebugString().substr(0, 200);
    const v1::FrameError& error = answer.error();
    EXPECT_EQ(error.reason(), reason);
    EXPECT_EQ(error.message(), message);
    EXPECT_TRUE(IsFieldOrSubject(error.field())) << error.field();
  }
  void ExpectEnd(StreamClient& client, grpc::StatusCode code, const std::string& reason,
                 const std::string& message) {
    const grpc::Status status = client.Finish();
    EXPECT_EQ(status.error_code(), code);
    EXPECT_EQ(client.reason(), reason);
    EXPECT_EQ(status.error_message(), message);
    ExpectDetails(status, reason);
  }
  void ExpectNotOpened(const v1::ReconstructRequest& open, grpc::StatusCode code,
                       const std::string& reason, const std::string& message) {
    StreamClient client(Connect(*server_, Transport::kTcp));
    EXPECT_FALSE(client.SendAndReceive(open).has_opened());
    ExpectEnd(client, code, reason, message);
  }
};

TEST_F(PartRefused, PARTS_MISSING) {
  Ranks ranks(*server_, "tank", 3, 50);
  ranks.Send(0, 1);
  ExpectError(ranks[0].Receive(), "PARTS_MISSING",
              "parts: 1, 2; must come within 50 ms of the first part of their frame");
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
  ExpectError(AnswerAfterIdling(*stub_, "", part), "MEMORY_BUDGET",
              "frame: " + std::to_string(part.ByteSizeLong()) +
                  " bytes; must fit with what is being worked on into 100 bytes; try again later, "
                  "or start the server with a larger --memory-budget");
}

TEST_F(PartRefused, CALLER_BYTES) {
  constexpr char kToken[] = "parts-0123456789abcdef";
  const support::TemporaryFolder folder;
  options_.token_file = folder.Write("tokens", std::string(kToken) + " ranks bytes=100B\n");
  options_.limits.streams_beyond_budget = 1;
  Serve();
  const auto part = PartRequest(1, 2, 1, 1, 0, true);
  ExpectError(AnswerAfterIdling(*stub_, kToken, part), "CALLER_BYTES",
              "caller.bytes: " + std::to_string(part.ByteSizeLong()) +
                  " more; must not make it more than is free, nor more than the `bytes=` of one "
                  "caller, which is a token or, without tokens, an address; try again when a call "
                  "of it has ended");
}

TEST_F(PartRefused, PART_MISMATCH) {
  Ranks ranks(*server_, "tank", 2);
  ranks.Send(0, 1, 1, /*ids=*/true);
  ranks.Send(1, 1, 1, /*ids=*/false);
  const auto answer = ranks[0].Receive();
  ExpectError(answer, "PART_MISMATCH",
              "parts[1].ids: 0 bytes; must be there, as in the parts before");
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
  ExpectError(ranks[1].Receive(), "PART_LATE",
              "sequence: 1; must be at least 2; this frame is over");
}

TEST_F(PartRefused, PART_DUPLICATE) {
  Ranks ranks(*server_, "tank", 2);
  ranks.Send(1, 1);
  ranks.Send(1, 1);
  // Part 0 comes after both.
  WaitUntilHeld(2 * PartRequest(1, 2, 1, 1, 0, true).ByteSizeLong());
  ranks.Send(0, 1);
  ranks.ExpectTaken(1, 1);
  ExpectError(ranks[1].Receive(), "PART_DUPLICATE",
              "sequence: 1; must be sent once by part 1; the first one counts");
}

TEST_F(PartRefused, PART_AHEAD) {
  Ranks ranks(*server_, "tank", 2);
  ranks.Send(1, 5);
  ExpectError(ranks[1].Receive(), "PART_AHEAD",
              "sequence: 5; must be below 5; frames before it are unanswered");
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
  ExpectError(ranks[1].Receive(), "MALFORMED",
              "frame: " + std::to_string(strange.ByteSizeLong()) +
                  " bytes; must be a ParticleFrame of at most 4096 fields");
  ranks.SendAll(1);
  EXPECT_TRUE(ranks[0].Receive().has_frame());
}

TEST_F(PartRefused, OUT_OF_RANGE) {
  const auto expect = [this](const v1::ReconstructRequest& open, const std::string& message) {
    ExpectNotOpened(open, grpc::StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE", message);
  };
  expect(OpenPart("tank", 0, 5),
         "open.parts: 5; must be at most 4; start the server with a larger --max-parts");
  expect(OpenPart("tank", 3, 3), "open.part: 3; must be below open.parts");
  expect(OpenPart("tank", 1, 0), "open.part: 1; must be below open.parts");
  auto open = OpenPart("tank", 0, 2);
  open.mutable_open()->set_part_timeout_ms(600'001);
  expect(open, "open.part_timeout_ms: 600001; must be at most 600000");
  open = OpenPart("tank", 0, 2);
  open.mutable_open()->set_parts_token("line\nbreak");
  expect(open, "open.parts_token: 10 bytes; must be at most 128 bytes of printable ASCII");
}

TEST_F(PartRefused, NO_SUCH_STREAM) {
  ExpectNotOpened(OpenPart("tank", 1, 2), grpc::StatusCode::NOT_FOUND, "NO_SUCH_STREAM",
                  "open.stream_name: \"tank\"; must be the name of an open stream; ListStreams "
                  "tells them");
}

TEST_F(PartRefused, PARTS_COUNT) {
  StreamClient whole(channel_);
  auto open = OpenRequest("whole");
  open.mutable_open()->set_parts_token(kPartsToken);
  ASSERT_TRUE(whole.SendAndReceive(open).has_opened());
  ExpectNotOpened(OpenPart("whole", 1, 2), grpc::StatusCode::FAILED_PRECONDITION, "PARTS_COUNT",
                  "open.parts: 2; must be 0, as in part 0");
  Ranks ranks(*server_, "tank", 2);
  ExpectNotOpened(OpenPart("tank", 2, 3), grpc::StatusCode::FAILED_PRECONDITION, "PARTS_COUNT",
                  "open.parts: 3; must be 2, as in part 0");
}

TEST_F(PartRefused, PARTS_TOKEN) {
  Ranks ranks(*server_, "tank", 2);
  auto open = OpenPart("tank", 1, 2);
  open.mutable_open()->set_parts_token("guessed");
  ExpectNotOpened(open, grpc::StatusCode::PERMISSION_DENIED, "PARTS_TOKEN",
                  "open.parts_token: 7 characters; must be that of part 0");
  ranks.SendAll(1);
  EXPECT_TRUE(ranks[0].Receive().has_frame());
}

TEST_F(PartRefused, TOO_MANY_PARTS) {
  Ranks first(*server_, "first", 4), second(*server_, "second", 2);
  StreamClient third(channel_);
  ASSERT_TRUE(third.SendAndReceive(OpenPart("third", 0, 2)).has_opened());
  ExpectNotOpened(
      OpenPart("third", 1, 2), grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_PARTS",
      "streams: 4 connections that send parts; must be at most 4; start the server with "
      "a larger --max-parts");
}

TEST_F(PartRefused, TAKEN_OVER) {
  Ranks ranks(*server_, "tank", 2);
  StreamClient second(Connect(*server_, Transport::kTcp));
  ASSERT_TRUE(second.SendAndReceive(OpenPart("tank", 1, 2)).has_opened());
  ExpectEnd(ranks[1], grpc::StatusCode::ABORTED, "TAKEN_OVER",
            "open.part: sent by another call now; must be sent by one call of the stream");
}

TEST_F(PartRefused, LEADER_GONE) {
  Ranks ranks(*server_, "tank", 2);
  ranks[0].Cancel();
  ExpectEnd(
      ranks[1], grpc::StatusCode::UNAVAILABLE, "LEADER_GONE",
      "stream: part 0 has left; must have a part 0; try again when it has resumed the stream");
}

}  // namespace
}  // namespace partiemc::server
