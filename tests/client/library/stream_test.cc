// A stream to a server that keeps the protocol.
#include "partiemc/client/stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include "client/library/fake_server.h"
#include "partiemc/client/server_info.h"

namespace partiemc::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Frame FrameOf(const std::vector<double>& positions) {
  return {.positions = std::span<const double>(positions)};
}

TEST(Stream, AnswersComeInOrderWithTheirTimesAndGeometry) {
  FakeServer server(AnswerAll);
  const auto stream = Stream::Open(server.address(), {.parameters = {.spacing = 0.5}});
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_EQ((*stream)->info().stream_id, "fake");
  EXPECT_EQ((*stream)->info().parameters.spacing, 0.5);
  EXPECT_EQ((*stream)->info().frames_in_flight, 2);

  constexpr int kFrames = 50;
  std::thread sender([&] {
    for (int k = 1; k <= kFrames; ++k) {
      const std::vector<double> positions = {10.0 * k, -1.0 * k};
      const auto sequence = (*stream)->Send(FrameOf(positions), 0.25 * k);
      ASSERT_TRUE(sequence.ok()) << sequence.status();
      EXPECT_EQ(*sequence, k);
    }
    EXPECT_TRUE((*stream)->FinishSending().ok());
  });
  Event event;
  for (int k = 1; k <= kFrames; ++k) {
    const auto received = (*stream)->Receive(event);
    ASSERT_TRUE(received.ok()) << received.status();
    ASSERT_EQ(*received, Received::kEvent);
    ASSERT_EQ(event.kind, Event::Kind::kResult);
    EXPECT_EQ(event.sequence, k);
    EXPECT_EQ(event.time, 0.25 * k);
    EXPECT_EQ(event.frame.rings_digest, k);
    EXPECT_THAT(event.frame.result.rings.points,
                ElementsAre(10.0 * k, -k, 10.0 * k + 1, -k, 10.0 * k, -k + 1.0));
  }
  const auto end = (*stream)->Receive(event);
  ASSERT_TRUE(end.ok()) << end.status();
  EXPECT_EQ(*end, Received::kEnd);
  EXPECT_EQ((*stream)->InFlight(), 0);
  sender.join();
}

TEST(Stream, NeverHasMoreFramesUnansweredThanTheServerAllows) {
  // Reads as fast as possible, answers one of three frames.
  std::atomic<int> most_unanswered = 0;
  FakeServer server([&](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    Accept(rpc, 3);
    std::mutex mutex;
    std::vector<v1::ParticleFrame> unanswered;
    std::atomic<bool> over = false;
    std::thread reader([&] {
      v1::ParticleFrame frame;
      while (ReadFrame(rpc, frame)) {
        const std::scoped_lock lock(mutex);
        unanswered.push_back(frame);
        most_unanswered = std::max<int>(most_unanswered, static_cast<int>(unanswered.size()));
      }
      over = true;
    });
    while (true) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      const bool last = over;
      const std::scoped_lock lock(mutex);
      if (unanswered.empty() && last) break;
      if (unanswered.empty()) continue;
      rpc.Write(TriangleAt(unanswered.front()));
      unanswered.erase(unanswered.begin());
    }
    reader.join();
    return grpc::Status::OK;
  });
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  std::thread sender([&] {
    const std::vector<double> positions = {1, 2};
    for (int k = 0; k < 40; ++k) ASSERT_TRUE((*stream)->Send(FrameOf(positions), k).ok());
    ASSERT_TRUE((*stream)->FinishSending().ok());
  });
  Event event;
  int answers = 0;
  for (auto got = (*stream)->Receive(event); got.ok() && *got == Received::kEvent;
       got = (*stream)->Receive(event)) {
    ++answers;
  }
  sender.join();
  EXPECT_EQ(answers, 40);
  EXPECT_LE(most_unanswered, 3);
  EXPECT_GE(most_unanswered, 1);
}

TEST(Stream, ARefusedFrameIsAnEventAndTheStreamGoesOn) {
  FakeServer server([](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    Accept(rpc, 2);
    v1::ParticleFrame frame;
    while (ReadFrame(rpc, frame)) {
      v1::ReconstructResponse response = TriangleAt(frame);
      if (frame.sequence() == 2) {
        v1::FrameError& error = *response.mutable_error();
        error.set_sequence(2);
        error.set_reason("NOT_FINITE");
        error.set_field("positions[0].x");
        error.set_message("positions[0].x: nan; must be finite");
      }
      rpc.Write(response);
    }
    return grpc::Status::OK;
  });
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  const std::vector<double> positions = {1, 2};
  std::vector<Event::Kind> kinds;
  Event event;
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE((*stream)->Send(FrameOf(positions), k).ok());
    ASSERT_TRUE((*stream)->Receive(event).ok());
    kinds.push_back(event.kind);
    if (k == 1) {
      EXPECT_EQ(event.violation.reason, "NOT_FINITE");
      EXPECT_EQ(event.message, "positions[0].x: nan; must be finite");
    }
  }
  EXPECT_THAT(kinds,
              ElementsAre(Event::Kind::kResult, Event::Kind::kRefusal, Event::Kind::kResult));
}

TEST(Stream, RefusesAFrameAboveTheServersLimitBeforeSending) {
  FakeServer server([](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    Accept(rpc, 2, /*max_frame_bytes=*/100);
    v1::ParticleFrame frame;
    while (ReadFrame(rpc, frame)) rpc.Write(TriangleAt(frame));
    return grpc::Status::OK;
  });
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  const std::vector<double> large(20, 1.0);
  const auto refused = (*stream)->Send(FrameOf(large), 0);
  const auto violation = FindViolation(refused.status());
  ASSERT_TRUE(violation.has_value()) << refused.status();
  EXPECT_EQ(violation->reason, "MESSAGE_TOO_LARGE");
  const std::vector<double> small = {1, 2};
  const auto sent = (*stream)->Send(FrameOf(small), 0);
  ASSERT_TRUE(sent.ok()) << sent.status();
  EXPECT_EQ(*sent, 1);
}

TEST(Stream, ANoticeIsAnEventBetweenAnswers) {
  FakeServer server([](grpc::ServerContext&, FakeServer::Rpc& rpc) {
    Accept(rpc, 2);
    v1::ParticleFrame frame;
    ReadFrame(rpc, frame);
    v1::ReconstructResponse notice;
    notice.mutable_notice()->set_message("going away");
    rpc.Write(notice);
    rpc.Write(TriangleAt(frame));
    return grpc::Status(grpc::StatusCode::UNAVAILABLE, "draining");
  });
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  const std::vector<double> positions = {1, 2};
  ASSERT_TRUE((*stream)->Send(FrameOf(positions), 0).ok());
  Event event;
  ASSERT_TRUE((*stream)->Receive(event).ok());
  EXPECT_EQ(event.kind, Event::Kind::kNotice);
  EXPECT_EQ(event.message, "going away");
  ASSERT_TRUE((*stream)->Receive(event).ok());
  EXPECT_EQ(event.kind, Event::Kind::kResult);
  const auto end = (*stream)->Receive(event);
  EXPECT_EQ(end.status().code(), absl::StatusCode::kUnavailable) << end.status();
}

TEST(Stream, ReceiveWithAWaitReturnsWhenNothingHasCome) {
  FakeServer server(AnswerAll);
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  Event event;
  const auto received = (*stream)->Receive(event, std::chrono::milliseconds(10));
  ASSERT_TRUE(received.ok()) << received.status();
  EXPECT_EQ(*received, Received::kNothingYet);
}

TEST(Stream, SendAfterFinishSendingIsRefused) {
  FakeServer server(AnswerAll);
  const auto stream = Stream::Open(server.address(), {});
  ASSERT_TRUE(stream.ok()) << stream.status();
  ASSERT_TRUE((*stream)->FinishSending().ok());
  const std::vector<double> positions = {1, 2};
  EXPECT_EQ((*stream)->Send(FrameOf(positions), 0).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(ServerInfo, TellsWhatTheServerSaysAndLeavesOutWhatThisVersionDoesNotKnow) {
  FakeServer server(AnswerAll);
  const auto info = GetServerInfo(server.address());
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->version, "1.2.3");
  EXPECT_EQ(info->limits.max_particles_per_frame, 1000);
  EXPECT_THAT(info->placements, ElementsAre(Placement::kQef));
  EXPECT_THAT(info->fills, ElementsAre(Fill::kGrid));
  EXPECT_THAT(info->capabilities, ElementsAre("resume"));
}

}  // namespace
}  // namespace partiemc::client
