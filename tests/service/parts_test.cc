// Frames in parts over gRPC: the same digests for any number of parts in any order, and ranks that
// lose, repeat, delay or confuse parts, or die.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "service/parts_testing.h"

namespace partiemc::server {
namespace {

class Parts : public ::testing::Test {
 protected:
  void SetUp() override { server_ = StartServer(TestOptions()); }

  v1::GetServerInfoResponse Info() { return InfoOf(Connect(*server_, Transport::kTcp)); }

  std::unique_ptr<Server> server_;
  const std::vector<Digests> expected_ = LocalDigests(1, 12);
};

TEST_F(Parts, DigestsEqualWholeFramesForAnyPartsInAnyOrder) {
  std::mt19937 random(11);
  for (const bool ids : {true, false}) {
    for (const std::uint32_t parts : {1u, 4u, 16u, 64u}) {
      SCOPED_TRACE(testing::Message() << parts << " parts, ids " << ids);
      Ranks ranks(*server_, "tank", parts);
      // Each rank sends its parts in order; ranks take turns at random, up to a window ahead.
      std::vector<std::uint32_t> turns;
      for (std::uint32_t part = 0; part < parts; ++part) turns.insert(turns.end(), 4, part);
      std::ranges::shuffle(turns, random);
      std::vector<std::uint64_t> sent(parts);
      for (const std::uint32_t part : turns) {
        ASSERT_TRUE(ranks.Send(part, ++sent[part], 1, ids));
      }
      for (std::uint64_t sequence = 1; sequence <= 4; ++sequence) {
        ranks.ExpectAnswered(sequence, expected_[sequence - 1]);
      }
      for (std::uint32_t part = 0; part < parts; ++part) ranks[part].HalfClose();
      for (std::uint32_t part = 0; part < parts; ++part) EXPECT_TRUE(ranks[part].Finish().ok());
    }
  }
}

TEST_F(Parts, EmptyPartsAreLegalAndAFrameMayHaveNothingElse) {
  Ranks ranks(*server_, "tank", 3);
  v1::ReconstructRequest empty;
  empty.mutable_frame()->set_sequence(1);
  for (std::uint32_t part = 0; part < 3; ++part) ranks[part].Send(empty);
  const auto nothing = ranks[0].Receive();
  ASSERT_TRUE(nothing.has_frame()) << nothing.ShortDebugString();
  EXPECT_EQ(nothing.frame().statistics().particles(), 0u);
  empty.mutable_frame()->set_sequence(2);
  ranks[0].Send(empty);
  ranks[2].Send(empty);
  ranks[1].Send(PartRequest(0, 1, 2, 1, 0, true));
  const auto answer = ranks[0].Receive();
  ASSERT_TRUE(answer.has_frame());
  EXPECT_EQ(answer.frame().rings_digest(), expected_[0].rings);
}

TEST_F(Parts, ALostPartIsOneErrorAndTheStreamGoesOn) {
  Ranks ranks(*server_, "tank", 4, 200);
  for (const std::uint32_t part : {0u, 1u, 3u}) ranks.Send(part, 1);
  ranks.ExpectRefused(0, 1, "PARTS_MISSING");
  ranks.ExpectTaken(1, 1);
  ranks.ExpectTaken(3, 1);
  ranks.SendAll(2);
  const auto answer = ranks[0].Receive();
  ASSERT_TRUE(answer.has_frame());
  EXPECT_EQ(answer.frame().sequence(), 2u);
  EXPECT_EQ(answer.frame().statistics().particles(), MovingBlob(1, 1).size() / 2);
}

TEST_F(Parts, RefusesDoubledLateAndForeignPartsAndContinues) {
  Ranks ranks(*server_, "tank", 2, 1000);
  ranks.Send(1, 1);
  ranks.Send(1, 1);
  ranks.Send(1, 100);
  ranks.Send(0, 1);
  EXPECT_TRUE(ranks[0].Receive().has_frame());
  ranks.ExpectTaken(1, 1);
  ranks.ExpectRefused(1, 1, "PART_DUPLICATE");
  ranks.ExpectRefused(1, 100, "PART_AHEAD");
  ranks.Send(0, 2);
  ranks.ExpectRefused(0, 2, "PARTS_MISSING");
  ranks.Send(1, 2);
  ranks.ExpectRefused(1, 2, "PART_LATE");
  ranks.SendAll(3);
  EXPECT_TRUE(ranks[0].Receive().has_frame());
  ranks.ExpectTaken(1, 3);
}

TEST_F(Parts, NumbersOfPartZeroThatAreWrongAreRefusedAtOnce) {
  Ranks ranks(*server_, "tank", 2);
  ranks.Send(0, 5);
  ranks.ExpectRefused(0, 5, "SEQUENCE_GAP");
  ranks.SendAll(1);
  ranks.ExpectAnswered(1, expected_[0]);
  ranks.Send(0, 1);
  ranks.ExpectRefused(0, 1, "SEQUENCE_DUPLICATE");
  ranks.SendAll(2);
  ranks.ExpectAnswered(2, expected_[1]);
}

TEST_F(Parts, ARankThatDiesCostsOneErrorAFrameUntilItComesBack) {
  Ranks ranks(*server_, "tank", 3, 1000);
  ranks.SendAll(1);
  ranks.ExpectAnswered(1, expected_[0]);
  ranks[2].Cancel();
  ranks[2].Finish();
  ranks.Send(0, 2);
  ranks.Send(1, 2);
  ranks.ExpectRefused(0, 2, "PARTS_MISSING");
  ranks.ExpectTaken(1, 2);
  EXPECT_EQ(ranks.Reopen(2).next_sequence(), 3u);
  ranks.SendAll(3);
  EXPECT_TRUE(ranks[0].Receive().has_frame());
}

TEST_F(Parts, AReconnectedRankResendsItsParts) {
  Ranks ranks(*server_, "tank", 3);
  ranks.Send(2, 1);
  ranks.Send(2, 2);
  ranks[2].Cancel();
  ranks[2].Finish();
  EXPECT_EQ(ranks.Reopen(2).next_sequence(), 1u);
  ranks.SendAll(1);
  ranks.ExpectAnswered(1, expected_[0]);
  ranks.SendAll(2);
  ranks.ExpectAnswered(2, expected_[1]);
}

TEST_F(Parts, ARankTakesItsPartOverFromACallThatNobodyKnowsToBeDead) {
  Ranks ranks(*server_, "tank", 2);
  StreamClient second(Connect(*server_, Transport::kTcp));
  ASSERT_TRUE(second.SendAndReceive(OpenPart("tank", 1, 2)).has_opened());
  EXPECT_EQ(ranks[1].Finish().error_code(), grpc::StatusCode::ABORTED);
  EXPECT_EQ(ranks[1].reason(), "TAKEN_OVER");
  ranks.Send(0, 1);
  second.Send(PartRequest(1, 2, 1, 1, 0, true));
  const auto answer = ranks[0].Receive();
  EXPECT_EQ(answer.frame().rings_digest(), expected_[0].rings);
}

TEST_F(Parts, WhenPartZeroDiesTheOthersRejoinTheStreamItResumes) {
  Ranks ranks(*server_, "tank", 3, 0, 2);
  v1::ResumeStream resume;
  resume.set_stream_token(ranks.opened().stream_token());
  for (std::uint64_t sequence = 1; sequence <= 7; ++sequence) {
    ranks.SendAll(sequence);
    const auto answer = ranks[0].Receive();
    ASSERT_TRUE(answer.has_frame());
    if (!answer.checkpoint().empty()) resume.set_checkpoint(answer.checkpoint());
    for (const std::uint32_t part : {1u, 2u}) {
      const auto taken = ranks[part].Receive();
      // With a window of 4, sending frame 6 implies that the answer to frame 2 was received.
      EXPECT_EQ(taken.part().resume_sequence(), sequence < 6 ? 1u : 3u);
    }
  }
  ranks[0].Cancel();
  for (const std::uint32_t part : {1u, 2u}) {
    EXPECT_EQ(ranks[part].Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(ranks[part].reason(), "LEADER_GONE");
  }
  auto open = OpenPart("tank", 0, 3);
  open.mutable_open()->set_checkpoint_interval(2);
  *open.mutable_open()->mutable_resume() = resume;
  EXPECT_EQ(ranks.Open(0, open).next_sequence(), 7u);
  for (const std::uint32_t part : {1u, 2u}) EXPECT_EQ(ranks.Reopen(part).next_sequence(), 7u);
  for (std::uint64_t sequence = 7; sequence <= 9; ++sequence) {
    ranks.SendAll(sequence);
    ranks.ExpectAnswered(sequence, expected_[sequence - 1]);
  }
}

TEST_F(Parts, TheEndOfPartZeroEndsTheOthers) {
  Ranks ranks(*server_, "tank", 2);
  ranks.SendAll(1);
  ranks.ExpectAnswered(1, expected_[0]);
  EXPECT_TRUE(Eventually([&] { return Info().load().memory_held() == 0; }));
  ranks.Send(1, 2);  // Part 0 never sends this frame.
  EXPECT_TRUE(Eventually([&] { return Info().load().memory_held() > 0; }));
  ranks[0].HalfClose();
  ranks.ExpectRefused(1, 2, "PART_LATE");
  EXPECT_TRUE(ranks[1].Finish().ok());
  EXPECT_TRUE(ranks[0].Finish().ok());
}

TEST_F(Parts, ARankThatHasFinishedHasSentItsParts) {
  Ranks ranks(*server_, "tank", 2);
  ranks.Send(1, 1);
  ranks[1].HalfClose();
  ranks.Send(0, 1);
  ranks.ExpectAnswered(1, expected_[0]);
  EXPECT_TRUE(ranks[1].Finish().ok());
}

TEST_F(Parts, PartsThatRunAheadHoldNoMoreMemoryThanAWindowOfThem) {
  Ranks ranks(*server_, "tank", 9);
  std::vector<std::thread> senders;
  v1::ReconstructRequest large;
  large.mutable_frame()->set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  large.mutable_frame()->set_positions(std::string(96'000, '\0'));
  for (std::uint32_t part = 1; part < 9; ++part) {
    senders.emplace_back([&ranks, part, large]() mutable {
      for (std::uint64_t sequence = 1; sequence <= 100; ++sequence) {
        large.mutable_frame()->set_sequence(sequence);
        if (!ranks[part].Send(large)) return;
      }
    });
  }
  const std::uint64_t window = Info().frames_in_flight(), part = 96'100;
  EXPECT_TRUE(Eventually([&] { return Info().load().memory_held() >= window * 8 * 96'000; }));
  for (int look = 0; look < 20; ++look) {
    EXPECT_LE(Info().load().memory_held(), window * 8 * part);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  for (std::uint32_t k = 0; k < 9; ++k) ranks[k].Cancel();
  for (std::thread& sender : senders) sender.join();
  EXPECT_TRUE(Eventually([&] { return Info().load().memory_held() == 0; }));
}

TEST_F(Parts, ADrainDoesNotWaitForPartsAndAnswersNothingThatLacksThem) {
  Ranks ranks(*server_, "tank", 2);
  ranks.Send(0, 1);
  EXPECT_TRUE(Eventually([&] { return Info().load().memory_held() > 0; }));
  const auto begin = std::chrono::steady_clock::now();
  server_->Drain(std::chrono::seconds(8));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  EXPECT_TRUE(ranks[0].Receive().has_notice());
  EXPECT_EQ(ranks[0].Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(ranks[0].reason(), "DRAINING");
  EXPECT_EQ(ranks[1].Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(Parts, WatchersGetTheParticlesOfAllParts) {
  auto open = OpenPart("echoing", 0, 2);
  open.mutable_open()->mutable_outputs()->set_rings(true);
  open.mutable_open()->mutable_outputs()->set_echo_particles(true);
  StreamClient zero(Connect(*server_, Transport::kTcp)), one(Connect(*server_, Transport::kTcp));
  ASSERT_TRUE(zero.SendAndReceive(open).has_opened());
  ASSERT_TRUE(one.SendAndReceive(OpenPart("echoing", 1, 2)).has_opened());
  WatchClient watcher(Connect(*server_, Transport::kTcp), "echoing", v1::WATCH_MODE_EVERY, 4);
  ASSERT_TRUE(watcher.Receive().has_opened());
  zero.Send(PartRequest(0, 2, 1, 1, 0, true));
  one.Send(PartRequest(1, 2, 1, 1, 0, true));
  const auto watched = watcher.Receive();
  ASSERT_TRUE(watched.has_frame());
  EXPECT_EQ(watched.frame().frame().particles(),
            PartRequest(0, 1, 1, 1, 0, true).frame().positions());
}

}  // namespace
}  // namespace partiemc::server
