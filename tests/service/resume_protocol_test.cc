// Checkpoints, tokens and takeover as they look on the wire (proto/PROTOCOL.md, "Resume").
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "server/checkpoint.h"
#include "server/moving_blob.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

constexpr unsigned kSeed = 7;
constexpr std::uint64_t kFrames = 8;

v1::ReconstructRequest OpenWithCheckpoints(std::uint32_t interval) {
  auto open = OpenRequest("tank");
  open.mutable_open()->set_checkpoint_interval(interval);
  return open;
}

v1::ReconstructRequest Resume(const std::string& checkpoint, const std::string& token) {
  auto open = OpenWithCheckpoints(1);
  open.mutable_open()->mutable_resume()->set_checkpoint(checkpoint);
  open.mutable_open()->mutable_resume()->set_stream_token(token);
  return open;
}

class ResumeProtocol : public ::testing::TestWithParam<Transport> {
 protected:
  // What is expected of the end of a stream that `open` would open.
  void ExpectRefused(const v1::ReconstructRequest& open, grpc::StatusCode code,
                     const std::string& reason) {
    StreamClient client(channel_);
    client.Send(open);
    const grpc::Status status = client.Finish();
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_EQ(client.reason(), reason);
  }

  std::unique_ptr<Server> server_ = StartServer(TestOptions());
  std::shared_ptr<grpc::Channel> channel_ = Connect(*server_, GetParam());
};

INSTANTIATE_TEST_SUITE_P(Over, ResumeProtocol,
                         ::testing::Values(Transport::kInProcess, Transport::kTcp),
                         [](const auto& test) { return TransportName(test.param); });

TEST_P(ResumeProtocol, ACheckpointComesWithEveryKthFrameWhateverItsAnswer) {
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenWithCheckpoints(3)).has_opened());
  for (std::uint64_t k = 1; k <= 7; ++k) {
    auto request = BlobRequest(k, kSeed, k);
    if (k == 6) request.mutable_frame()->mutable_positions()->pop_back();
    const auto answer = client.SendAndReceive(request);
    ASSERT_EQ(answer.has_error(), k == 6);
    const std::string& checkpoint =
        k == 6 ? answer.error().checkpoint() : answer.frame().checkpoint();
    EXPECT_EQ(!checkpoint.empty(), k % 3 == 0) << k;
  }
  const auto gap = client.SendAndReceive(BlobRequest(9, kSeed, 9));
  EXPECT_EQ(gap.error().reason(), "SEQUENCE_GAP");
  EXPECT_TRUE(gap.error().checkpoint().empty()) << "uses up no number";
}

TEST_P(ResumeProtocol, AResumedStreamGivesTheDigestsOfAnUndisturbedOne) {
  const std::vector<Digests> expected = LocalDigests(kSeed, kFrames);
  std::string token, checkpoint;
  for (std::uint64_t k = 0; k < kFrames; ++k) {
    // Each frame in a call of its own, while the call before is still open.
    StreamClient client(channel_);
    const auto opened =
        client.SendAndReceive(k == 0 ? OpenWithCheckpoints(1) : Resume(checkpoint, token));
    ASSERT_TRUE(opened.has_opened());
    EXPECT_EQ(opened.opened().next_sequence(), k + 1);
    ASSERT_EQ(opened.opened().stream_token().size(), 32u);
    if (k > 0) {
      EXPECT_EQ(opened.opened().stream_token(), token) << "it stays the same";
    }
    token = opened.opened().stream_token();
    const auto answer = client.SendAndReceive(BlobRequest(k + 1, kSeed, k));
    ASSERT_TRUE(answer.has_frame());
    EXPECT_EQ((Digests{answer.frame().rings_digest(), answer.frame().mesh_digest()}), expected[k]);
    checkpoint = answer.frame().checkpoint();
  }
}

TEST_P(ResumeProtocol, WhoHasTheTokenTakesOverAtOnceAndTheOldCallEnds) {
  StreamClient old_call(channel_);
  const auto opened = old_call.SendAndReceive(OpenWithCheckpoints(1));
  ASSERT_TRUE(opened.has_opened());
  ExpectRefused(OpenWithCheckpoints(1), grpc::StatusCode::ALREADY_EXISTS, "NAME_IN_USE");
  ExpectRefused(Resume("", std::string(32, 'a')), grpc::StatusCode::ALREADY_EXISTS, "NAME_IN_USE");

  StreamClient new_call(channel_);
  EXPECT_TRUE(new_call.SendAndReceive(Resume("", opened.opened().stream_token())).has_opened());
  EXPECT_FALSE(old_call.Finish().ok());
  EXPECT_TRUE(new_call.SendAndReceive(BlobRequest(1, kSeed, 0)).has_frame());
}

TEST_P(ResumeProtocol, WhatDoesNotFitIsRefused) {
  StreamClient client(channel_);
  const auto opened = client.SendAndReceive(OpenWithCheckpoints(1));
  const std::string token = opened.opened().stream_token();
  const auto answer = client.SendAndReceive(BlobRequest(1, kSeed, 0));
  const std::string checkpoint = answer.frame().checkpoint();

  ExpectRefused(Resume(checkpoint, "mine"), grpc::StatusCode::INVALID_ARGUMENT, "STREAM_TOKEN");
  ExpectRefused(Resume("nonsense", token), grpc::StatusCode::INVALID_ARGUMENT,
                "CORRUPT_CHECKPOINT");
  std::string damaged = checkpoint;
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  ExpectRefused(Resume(damaged, token), grpc::StatusCode::INVALID_ARGUMENT, "CORRUPT_STATE");
  auto other = Resume(checkpoint, token);
  other.mutable_open()->mutable_parameters()->set_kernel_radius(2);
  ExpectRefused(other, grpc::StatusCode::FAILED_PRECONDITION, "CHECKPOINT_MISMATCH");

  EXPECT_TRUE(client.SendAndReceive(BlobRequest(2, kSeed, 1)).has_frame()) << "undisturbed";
}

}  // namespace
}  // namespace partiemc::server
