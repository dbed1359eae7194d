// Ends and refusals of streams: code, reason and words of each.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;

class Protocol : public ::testing::TestWithParam<Transport> {
 protected:
  // Sends one request as the first of a stream and expects this end.
  void ExpectRefused(const v1::ReconstructRequest& first, grpc::StatusCode code,
                     const std::string& reason, const std::string& words) {
    StreamClient client(channel_);
    client.Send(first);
    const auto status = client.Finish();
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_EQ(client.reason(), reason);
    EXPECT_THAT(status.error_message(), HasSubstr(words));
  }

  std::unique_ptr<Server> server_ = StartServer(TestOptions());
  std::shared_ptr<grpc::Channel> channel_ = Connect(*server_, GetParam());
};

INSTANTIATE_TEST_SUITE_P(Over, Protocol, ::testing::Values(Transport::kInProcess, Transport::kTcp),
                         [](const auto& test) { return TransportName(test.param); });

TEST_P(Protocol, AFrameBeforeOpenEndsTheStream) {
  ExpectRefused(BlobRequest(1, 1, 0), grpc::StatusCode::INVALID_ARGUMENT, "PROTOCOL",
                "request: frame; the first must be `open`");
}

TEST_P(Protocol, AnEmptyFirstRequestEndsTheStream) {
  ExpectRefused({}, grpc::StatusCode::INVALID_ARGUMENT, "PROTOCOL",
                "request: empty; the first must be `open`");
}

TEST_P(Protocol, HalfClosingBeforeOpenEndsTheStream) {
  StreamClient client(channel_);
  client.HalfClose();
  EXPECT_EQ(client.Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(client.reason(), "PROTOCOL");
}

TEST_P(Protocol, ASecondOpenEndsTheStreamOnceTheFramesBeforeItAreAnswered) {
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  EXPECT_TRUE(client.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
  client.Send(OpenRequest());
  const auto status = client.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("open; comes once"));
}

TEST_P(Protocol, AnEmptyRequestEndsTheStream) {
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  client.Send({});
  const auto status = client.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "request: empty; must be `frame`");
}

TEST_P(Protocol, BytesThatAreNoRequestEndTheStream) {
  const StreamEnd first = SendBytes(channel_, {"\x07"});
  EXPECT_EQ(first.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(first.reason, "PROTOCOL");
  EXPECT_EQ(first.status.error_message(), "request: malformed; the first must be `open`");

  const StreamEnd open = SendBytes(channel_, {std::string("\x0a\x02\x0a\x09", 4)});
  EXPECT_EQ(open.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(open.reason, "PROTOCOL");
  EXPECT_EQ(open.status.error_message(),
            "request: malformed; must be a ReconstructRequest of at most 4096 fields");

  const StreamEnd later = SendBytes(channel_, {OpenRequest().SerializeAsString(), "\x12\x7f"});
  EXPECT_EQ(later.status.error_message(), "request: malformed; must be `frame`");
}

TEST_P(Protocol, AFrameThatIsNoMessageIsRefusedAndLeavesNoTrace) {
  const v1::ReconstructRequest good = BlobRequest(2, 1, 0), other = BlobRequest(3, 1, 1);
  const std::string number_1_and_cut_off_positions("\x12\x05\x08\x01\x22\x05p", 7);
  const StreamEnd end = SendBytes(
      channel_, {OpenRequest().SerializeAsString(), number_1_and_cut_off_positions,
                 good.SerializeAsString(), other.SerializeAsString(), std::string("\x07")});
  ASSERT_EQ(end.answers.size(), 4u) << end.status.error_message();
  EXPECT_EQ(end.answers[1].error().reason(), "MALFORMED");
  EXPECT_EQ(end.answers[1].error().next_sequence(), 2u);
  const std::vector<Digests> expected = LocalDigests(1, 2);
  for (const std::size_t k : {0, 1}) {
    EXPECT_EQ(end.answers[k + 2].frame().rings_digest(), expected[k].rings);
    EXPECT_EQ(end.answers[k + 2].frame().mesh_digest(), expected[k].mesh);
  }
}

TEST_P(Protocol, ParametersOutOfRangeAreRefusedWithFieldValueAndRule) {
  auto open = OpenRequest();
  open.mutable_open()->mutable_parameters()->set_kernel_radius(20);
  ExpectRefused(open, grpc::StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE",
                "parameters.kernel_radius: 20; must be in [1.5, 8] spacings");
}

TEST_P(Protocol, NamesAndLabelsOutOfRangeAreRefused) {
  ExpectRefused(OpenRequest("a b"), grpc::StatusCode::INVALID_ARGUMENT, "NAME", "\"a b\"");
  auto labels = OpenRequest();
  (*labels.mutable_open()->mutable_labels())["key"] = std::string(200, 'x');
  ExpectRefused(labels, grpc::StatusCode::INVALID_ARGUMENT, "LABELS", "open.labels");
}

TEST_P(Protocol, ANameInUseIsRefusedAndFreeAtOnceWhenItsStreamHasEnded) {
  {
    StreamClient first(channel_);
    ASSERT_TRUE(first.SendAndReceive(OpenRequest("tank")).has_opened());
    ExpectRefused(OpenRequest("tank"), grpc::StatusCode::ALREADY_EXISTS, "NAME_IN_USE", "tank");
    first.HalfClose();
    EXPECT_TRUE(first.Finish().ok());
  }
  StreamClient second(channel_);
  EXPECT_TRUE(second.SendAndReceive(OpenRequest("tank")).has_opened());
}

TEST_P(Protocol, AFrameFarBeyondTheLimitEndsTheStreamByGrpcItself) {
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  auto request = BlobRequest(1, 1, 0);
  request.mutable_frame()->set_positions(std::string(2'000'000, '\0'));
  client.Send(request);
  EXPECT_EQ(client.Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST(Admission, OneStreamTooManyIsRefusedAtOnceNamingTheLimitAndTheWayOut) {
  ServerOptions options = TestOptions();
  options.limits.max_streams = 2;
  const auto server = StartServer(options);
  const auto channel = Connect(*server, Transport::kTcp);
  StreamClient first(channel), second(channel);
  ASSERT_TRUE(first.SendAndReceive(OpenRequest()).has_opened());
  ASSERT_TRUE(second.SendAndReceive(OpenRequest()).has_opened());
  {
    StreamClient third(channel);
    third.Send(OpenRequest());
    const auto status = third.Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(third.reason(), "TOO_MANY_STREAMS");
    EXPECT_THAT(status.error_message(), HasSubstr("must be at most 2"));
    EXPECT_THAT(status.error_message(), HasSubstr("--max-streams"));
  }
  first.HalfClose();
  EXPECT_TRUE(first.Finish().ok());
  StreamClient fourth(channel);
  EXPECT_TRUE(fourth.SendAndReceive(OpenRequest()).has_opened());
}

}  // namespace
}  // namespace partiemc::server
