// A stream in parts against a scripted server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "client/library/fake_server.h"
#include "partiemc/client/stream.h"
#include "partiemc/status.h"

namespace partiemc::client {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

StreamOptions PartOptions(std::uint32_t part) {
  StreamOptions options;
  options.name = "tank";
  options.parts = {.parts = 3, .part = part, .token = "secret"};
  options.deadline = milliseconds(20000);
  return options;
}

v1::OpenStream AcceptPart(FakeServer::Rpc& rpc, std::uint64_t next_sequence) {
  v1::ReconstructRequest request;
  rpc.Read(&request);
  v1::ReconstructResponse response;
  v1::StreamOpened& opened = *response.mutable_opened();
  *opened.mutable_parameters() = request.open().parameters();
  opened.set_frames_in_flight(4);
  opened.mutable_limits()->set_max_parts(8);
  opened.set_next_sequence(next_sequence);
  rpc.Write(response);
  return request.open();
}

// Reads `count` parts and returns their numbers.
std::vector<std::uint64_t> ReadParts(FakeServer::Rpc& rpc, int count) {
  std::vector<std::uint64_t> sequences;
  v1::ParticleFrame frame;
  while (count-- > 0 && ReadFrame(rpc, frame)) sequences.push_back(frame.sequence());
  return sequences;
}

void Take(FakeServer::Rpc& rpc, std::uint64_t sequence, std::uint64_t resume_sequence) {
  v1::ReconstructResponse response;
  response.mutable_part()->set_sequence(sequence);
  response.mutable_part()->set_resume_sequence(resume_sequence);
  rpc.Write(response);
}

grpc::Status LeaderGone(grpc::ServerContext& context) {
  context.AddTrailingMetadata("partiemc-reason", "LEADER_GONE");
  return grpc::Status(grpc::StatusCode::UNAVAILABLE, "part 0 has left");
}

// Part 1 sends three frames. The first call answers the first and ends; the second requests parts
// from `next_sequence` and answers all. Returns the resent parts; expects that all are reported as
// accepted.
std::vector<std::uint64_t> SentAgain(std::uint64_t resume_sequence, std::uint64_t next_sequence) {
  int calls = 0;
  std::vector<std::uint64_t> again;
  FakeServer server([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    if (++calls == 1) {
      EXPECT_EQ(AcceptPart(rpc, 1).part(), 1u);
      EXPECT_THAT(ReadParts(rpc, 3), ElementsAre(1, 2, 3));
      Take(rpc, 1, resume_sequence);
      return LeaderGone(context);
    }
    EXPECT_FALSE(AcceptPart(rpc, next_sequence).has_resume());
    v1::ParticleFrame frame;
    while (ReadFrame(rpc, frame)) {
      again.push_back(frame.sequence());
      Take(rpc, frame.sequence(), resume_sequence);
    }
    return grpc::Status::OK;
  });
  const auto stream = Stream::Open(server.address(), PartOptions(1));
  EXPECT_TRUE(stream.ok()) << stream.status();
  const std::vector<double> xy = {1, 2};
  for (int k = 0; k < 3; ++k) EXPECT_TRUE((*stream)->Send({.positions = std::span(xy)}, 0).ok());
  std::vector<std::uint64_t> taken;
  Event event;
  while (taken.size() < 3 && *(*stream)->Receive(event) == Received::kEvent) {
    EXPECT_EQ(event.kind, Event::Kind::kPartTaken);
    taken.push_back(event.sequence);
  }
  EXPECT_THAT(taken, ElementsAre(1, 2, 3));
  EXPECT_TRUE((*stream)->FinishSending().ok());
  EXPECT_EQ(*(*stream)->Receive(event), Received::kEnd);
  EXPECT_EQ(calls, 2);
  return again;
}

TEST(StreamParts, WhatIsUnansweredIsSentAgainWhereItIsStillWanted) {
  EXPECT_THAT(SentAgain(1, 2), ElementsAre(2, 3));
  EXPECT_THAT(SentAgain(2, 3), ElementsAre(3)) << "frame 2 was over when the call was replaced";
  EXPECT_THAT(SentAgain(2, 9), IsEmpty()) << "so were all";
}

TEST(StreamParts, WhatAResumedStreamWantsIsSentAgainThoughItWasAnswered) {
  EXPECT_THAT(SentAgain(1, 1), ElementsAre(1, 2, 3));
}

TEST(StreamParts, APartThatComesBeforePartZeroWaitsForIt) {
  int calls = 0;
  FakeServer server([&](grpc::ServerContext& context, FakeServer::Rpc& rpc) {
    if (++calls < 3) {
      context.AddTrailingMetadata("partiemc-reason", "NO_SUCH_STREAM");
      return grpc::Status(grpc::StatusCode::NOT_FOUND, "nobody there");
    }
    AcceptPart(rpc, 1);
    return WaitForCancel(context);
  });
  EXPECT_TRUE(Stream::Open(server.address(), PartOptions(2)).ok());
  EXPECT_EQ(calls, 3);
}

TEST(StreamParts, TheEndOfPartZeroIsTheEndOfTheOthers) {
  FakeServer server([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    AcceptPart(rpc, 1);
    return grpc::Status::OK;
  });
  const auto stream = Stream::Open(server.address(), PartOptions(1));
  ASSERT_TRUE(stream.ok()) << stream.status();
  Event event;
  const auto received = (*stream)->Receive(event);
  ASSERT_TRUE(received.ok()) << received.status();
  EXPECT_EQ(*received, Received::kEnd);
  const std::vector<double> xy = {1, 2};
  EXPECT_FALSE((*stream)->Send({.positions = std::span(xy)}, 0).ok());
}

TEST(StreamParts, AServerThatTakesNoneIsNotSentAny) {
  FakeServer server(AnswerAll);
  EXPECT_EQ(Stream::Open(server.address(), PartOptions(0)).status().code(),
            absl::StatusCode::kUnimplemented);
}

TEST(StreamParts, OptionsThatCannotBeAreRefusedBeforeAnythingIsSent) {
  const auto field = [](const StreamOptions& options) {
    const auto status = Stream::Open("127.0.0.1:1", options).status();
    const auto violation = FindViolation(status);
    return violation ? violation->field : std::string(status.message());
  };
  EXPECT_EQ(field(PartOptions(3)), "part");
  StreamOptions options = PartOptions(0);
  options.name = "";
  EXPECT_EQ(field(options), "name");
  options = PartOptions(0);
  options.parts.timeout = milliseconds(0);
  EXPECT_EQ(field(options), "timeout");
  options.parts.timeout = options.deadline + milliseconds(1);
  EXPECT_EQ(field(options), "timeout");
  options.parts.parts = 0;
  options.parts.part = 1;
  EXPECT_EQ(field(options), "part");
}

}  // namespace
}  // namespace partiemc::client
