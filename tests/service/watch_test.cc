// Watching over gRPC: frames, notices, and ends of watches.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;

constexpr std::chrono::milliseconds kGrace{60'000};

class Watch : public ::testing::TestWithParam<Transport> {
 protected:
  void SetUp() override {
    ServerOptions options = TestOptions();
    options.limits.max_watchers = 4;
    server_ = StartServer(options);
    channel_ = Connect(*server_, GetParam());
    producer_ = std::make_unique<StreamClient>(channel_);
  }

  void OpenProducer(bool echo_particles = false) {
    auto open = OpenRequest("tank");
    if (echo_particles) {
      open.mutable_open()->mutable_outputs()->set_rings(true);
      open.mutable_open()->mutable_outputs()->set_mesh(true);
      open.mutable_open()->mutable_outputs()->set_echo_particles(true);
    }
    (*open.mutable_open()->mutable_labels())["run"] = "7";
    ASSERT_TRUE(producer_->SendAndReceive(open).has_opened());
  }
  // Sends frame `index` on the producer's stream; returns the response.
  v1::ReconstructedFrame Produce(std::uint64_t index) {
    return producer_->SendAndReceive(BlobRequest(index + 1, 1, index)).frame();
  }
  std::uint32_t ListedWatchers() {
    TimedContext context;
    v1::ListStreamsResponse streams;
    EXPECT_TRUE(
        v1::ReconstructionService::NewStub(channel_)->ListStreams(&context, {}, &streams).ok());
    return streams.streams_size() == 1 ? streams.streams(0).watchers() : 99;
  }
  void ExpectRefused(WatchClient& watcher, grpc::StatusCode code, const std::string& reason,
                     const std::string& words) {
    const auto status = watcher.Finish();
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_EQ(watcher.reason(), reason);
    EXPECT_THAT(status.error_message(), HasSubstr(words));
  }

  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<StreamClient> producer_;
};

std::string WithoutTimes(v1::ReconstructedFrame frame) {
  frame.mutable_statistics()->clear_stages();
  frame.mutable_statistics()->clear_milliseconds();
  return frame.SerializeAsString();
}

TEST_P(Watch, EveryReceivesTheProducersBytesThenTheEnd) {
  OpenProducer();
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_EVERY, 3);
  const auto opened = watcher.Receive();
  ASSERT_TRUE(opened.has_opened());
  EXPECT_EQ(opened.opened().labels().at("run"), "7");
  EXPECT_TRUE(opened.opened().parameters().has_reference_radius());
  EXPECT_EQ(ListedWatchers(), 1u);
  for (std::uint64_t i = 0; i < 12; ++i) {
    const v1::ReconstructedFrame made = Produce(i);
    const auto seen = watcher.Receive();
    ASSERT_TRUE(seen.has_frame());
    EXPECT_EQ(seen.frame().frame().SerializeAsString(), made.SerializeAsString());
    EXPECT_EQ(seen.frame().dropped(), 0u);
    watcher.Credit(1);
  }
  producer_->HalfClose();
  EXPECT_TRUE(producer_->Finish().ok());
  const auto ended = watcher.Receive();
  EXPECT_EQ(ended.ended().reason(), "FINISHED");
  EXPECT_EQ(ended.ended().dropped(), 0u);
  EXPECT_TRUE(watcher.Finish().ok());
}

TEST_P(Watch, WhoComesLateGetsTheNewestFrameAtOnceAlthoughNobodyWatchedIt) {
  OpenProducer();
  v1::ReconstructedFrame made;
  for (std::uint64_t i = 0; i < 5; ++i) made = Produce(i);
  for (int k = 0; k < 3; ++k) {  // Repeated after the previous one has left.
    WatchClient watcher(channel_, "tank", v1::WATCH_MODE_LATEST, 1);
    ASSERT_TRUE(watcher.Receive().has_opened());
    const auto seen = watcher.Receive();
    EXPECT_EQ(WithoutTimes(seen.frame().frame()), WithoutTimes(made));
    EXPECT_EQ(seen.frame().dropped(), 0u);
  }
}

TEST_P(Watch, LatestWithoutCreditDropsAndTellsHowManyAlsoAtTheEnd) {
  OpenProducer();
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_LATEST, 1);
  ASSERT_TRUE(watcher.Receive().has_opened());
  Produce(0);
  EXPECT_EQ(watcher.Receive().frame().frame().sequence(), 1u);
  for (std::uint64_t i = 1; i < 6; ++i) Produce(i);
  watcher.Credit(1);
  // The dispatcher may still process the last frames when the credit arrives.
  std::uint64_t dropped = 0;
  std::uint64_t sequence = 0;
  while (sequence < 6) {
    const auto seen = watcher.Receive();
    ASSERT_TRUE(seen.has_frame());
    EXPECT_EQ(seen.frame().frame().sequence(),
              sequence + seen.frame().dropped() + 1 + (sequence == 0 ? 1 : 0));
    sequence = seen.frame().frame().sequence();
    dropped += seen.frame().dropped();
    if (sequence < 6) watcher.Credit(1);
  }
  for (std::uint64_t i = 6; i < 10; ++i) Produce(i);
  producer_->HalfClose();
  EXPECT_TRUE(producer_->Finish().ok());
  watcher.HalfClose();  // No credit follows for the pending frame.
  const auto ended = watcher.Receive();
  if (ended.ended().reason() == "FINISHED") {
    EXPECT_EQ(ended.ended().dropped(), 4u);
  } else {  // Before the last frame was offered.
    EXPECT_EQ(ended.ended().reason(), "CREDIT_USED");
    EXPECT_LE(ended.ended().dropped(), 4u);
  }
  EXPECT_TRUE(watcher.Finish().ok());
}

TEST_P(Watch, ShowsTheLastFrameIfItsCreditComesAfterTheEnd) {
  OpenProducer();
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_LATEST, 1);
  ASSERT_TRUE(watcher.Receive().has_opened());
  Produce(0);
  EXPECT_EQ(watcher.Receive().frame().frame().sequence(), 1u);
  for (std::uint64_t i = 1; i < 4; ++i) Produce(i);
  producer_->HalfClose();
  EXPECT_TRUE(producer_->Finish().ok());
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  watcher.Credit(1);
  const auto last = watcher.Receive();
  EXPECT_EQ(last.frame().frame().sequence(), 4u);
  EXPECT_EQ(last.frame().dropped(), 2u);
  EXPECT_EQ(watcher.Receive().ended().reason(), "FINISHED");
  EXPECT_TRUE(watcher.Finish().ok());
}

TEST_P(Watch, EchoesParticlesToWatchersButNotToTheProducer) {
  OpenProducer(/*echo_particles=*/true);
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_EVERY, 9);
  ASSERT_TRUE(watcher.Receive().has_opened());
  for (std::uint64_t i = 0; i < 4; ++i) {
    const v1::ReconstructRequest request = BlobRequest(i + 1, 1, i);
    const auto made = producer_->SendAndReceive(request);
    EXPECT_TRUE(made.frame().particles().empty());
    v1::ReconstructedFrame seen = watcher.Receive().frame().frame();
    EXPECT_EQ(seen.particle_format(), request.frame().position_format());
    EXPECT_TRUE(seen.particles() == request.frame().positions());
    seen.clear_particles();
    seen.clear_particle_format();
    EXPECT_EQ(seen.SerializeAsString(), made.frame().SerializeAsString());
  }
}

TEST_P(Watch, AFrameErrorIsNotShownAndNoDrop) {
  OpenProducer();
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_EVERY, 9);
  ASSERT_TRUE(watcher.Receive().has_opened());
  Produce(0);
  auto bad = BlobRequest(2, 1, 1);
  bad.mutable_frame()->mutable_positions()->pop_back();
  EXPECT_TRUE(producer_->SendAndReceive(bad).has_error());
  Produce(2);
  EXPECT_EQ(watcher.Receive().frame().frame().sequence(), 1u);
  const auto next = watcher.Receive();
  EXPECT_EQ(next.frame().frame().sequence(), 3u);
  EXPECT_EQ(next.frame().dropped(), 0u);
}

TEST_P(Watch, AHalfClosedWatchGoesOnForAsLongAsItHasCredit) {
  OpenProducer();
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_LATEST, 2);
  watcher.HalfClose();
  ASSERT_TRUE(watcher.Receive().has_opened());
  Produce(0);
  EXPECT_TRUE(watcher.Receive().has_frame());
  Produce(1);
  EXPECT_TRUE(watcher.Receive().has_frame());
  EXPECT_EQ(watcher.Receive().ended().reason(), "CREDIT_USED");
  EXPECT_TRUE(watcher.Finish().ok());
}

TEST_P(Watch, AProducerThatIsGoneIsTold) {
  OpenProducer();
  WatchClient watcher(channel_, "tank", v1::WATCH_MODE_LATEST, 2);
  ASSERT_TRUE(watcher.Receive().has_opened());
  producer_->Cancel();
  EXPECT_EQ(watcher.Receive().ended().reason(), "PRODUCER_LOST");
  EXPECT_TRUE(watcher.Finish().ok());
}

TEST_P(Watch, ALineageStaysThroughAResumeIsNoOtherStreamsAndTellsNoToken) {
  const auto lineage = [&](const std::string& name) {
    WatchClient watcher(channel_, name, v1::WATCH_MODE_LATEST, 1);
    return watcher.Receive().opened().lineage();
  };
  const auto opened = producer_->SendAndReceive(OpenRequest("tank")).opened();
  StreamClient other(channel_);
  ASSERT_TRUE(other.SendAndReceive(OpenRequest("pond")).has_opened());
  const std::string before = lineage("tank");
  auto resume = OpenRequest("tank");
  resume.mutable_open()->mutable_resume()->set_stream_token(opened.stream_token());
  StreamClient resumed(channel_);
  ASSERT_TRUE(resumed.SendAndReceive(resume).has_opened());
  EXPECT_EQ(lineage("tank"), before);
  EXPECT_EQ(before.size(), 32u);
  EXPECT_NE(before, opened.stream_token());
  EXPECT_NE(lineage("pond"), before);
}

TEST_P(Watch, AWatcherThatWasAwayLearnsThatItsStreamHasFinished) {
  OpenProducer();
  std::string lineage;
  {
    WatchClient watcher(channel_, "tank", v1::WATCH_MODE_EVERY, 9);
    lineage = watcher.Receive().opened().lineage();
    for (std::uint64_t k = 0; k < 3; ++k) Produce(k);
  }
  producer_->HalfClose();
  ASSERT_TRUE(producer_->Finish().ok());
  WatchClient back(channel_);
  v1::WatchStreamRequest request;
  v1::OpenWatch& open = *request.mutable_open();
  open.set_stream_name("tank");
  open.set_credits(1);
  open.set_lineage(lineage);
  back.Send(request);
  const auto opened = back.Receive().opened();
  EXPECT_EQ(opened.lineage(), lineage);
  EXPECT_EQ(opened.labels().at("run"), "7");
  EXPECT_TRUE(opened.has_frames());
  EXPECT_EQ(opened.newest_sequence(), 3u);
  EXPECT_EQ(back.Receive().ended().reason(), "FINISHED");
  EXPECT_TRUE(back.Finish().ok());
  const std::vector<std::pair<std::string, std::string>> strangers = {
      {"tank", ""}, {"tank", "no lineage"}, {"pond", lineage}};
  for (const auto& [name, other] : strangers) {
    WatchClient stranger(channel_);
    open.set_stream_name(name);
    open.set_lineage(other);
    stranger.Send(request);
    ExpectRefused(stranger, grpc::StatusCode::NOT_FOUND, "NO_SUCH_STREAM", "open stream");
  }
  producer_ = std::make_unique<StreamClient>(channel_);
  OpenProducer();
  WatchClient next(channel_);
  open.set_stream_name("tank");
  open.set_lineage(lineage);
  next.Send(request);
  EXPECT_NE(next.Receive().opened().lineage(), lineage) << "an open stream comes first";
}

TEST_P(Watch, WhatCannotBeWatchedIsRefusedWithItsReason) {
  OpenProducer();
  WatchClient unknown(channel_, "tonk", v1::WATCH_MODE_LATEST, 1);
  ExpectRefused(unknown, grpc::StatusCode::NOT_FOUND, "NO_SUCH_STREAM",
                "open.stream_name: \"tonk\"; must be the name of an open stream");
  WatchClient mode(channel_, "tank", static_cast<v1::WatchMode>(9), 1);
  ExpectRefused(mode, grpc::StatusCode::INVALID_ARGUMENT, "UNSUPPORTED", "open.mode: 9; must be");
  WatchClient credits(channel_, "tank", v1::WATCH_MODE_LATEST, 0);
  ExpectRefused(credits, grpc::StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE",
                "open.credits: 0; must be at least 1");
  WatchClient early(channel_);
  early.Credit(1);
  ExpectRefused(early, grpc::StatusCode::INVALID_ARGUMENT, "PROTOCOL",
                "request: no `open`; the first must be `open`");
  WatchClient silent(channel_);
  silent.HalfClose();
  ExpectRefused(silent, grpc::StatusCode::INVALID_ARGUMENT, "PROTOCOL", "request: none;");
}

TEST_P(Watch, BrokenRulesEndAWatchAndAreTold) {
  OpenProducer();
  v1::WatchStreamRequest second_open, no_frames, empty;
  second_open.mutable_open()->set_stream_name("tank");
  no_frames.mutable_credit();
  for (const auto& [request, reason] :
       {std::pair(second_open, "PROTOCOL"), std::pair(empty, "PROTOCOL"),
        std::pair(no_frames, "OUT_OF_RANGE")}) {
    WatchClient watcher(channel_, "tank", v1::WATCH_MODE_LATEST, 1);
    ASSERT_TRUE(watcher.Receive().has_opened());
    watcher.Send(request);
    EXPECT_EQ(watcher.Receive().ended().reason(), reason);
    ExpectRefused(watcher, grpc::StatusCode::INVALID_ARGUMENT, reason, "must be");
  }
}

TEST_P(Watch, ACallThatNeverOpensGivesUpItsPlace) {
  ServerOptions options = TestOptions();
  options.limits.max_watchers = 1;
  options.limits.idle.opening = std::chrono::milliseconds(20);
  const auto server = StartServer(options);
  WatchClient silent(Connect(*server, GetParam()));
  ExpectRefused(silent, grpc::StatusCode::DEADLINE_EXCEEDED, "IDLE", "sends no `open` for 0.02 s");
  WatchClient next(Connect(*server, GetParam()), "tonk", v1::WATCH_MODE_LATEST, 1);
  ExpectRefused(next, grpc::StatusCode::NOT_FOUND, "NO_SUCH_STREAM", "tonk");
}

TEST_P(Watch, RefusesOneWatcherTooManyUntilASlotIsFree) {
  OpenProducer();
  std::vector<std::unique_ptr<WatchClient>> watchers;
  for (int k = 0; k < 4; ++k) {
    watchers.push_back(std::make_unique<WatchClient>(channel_, "tank", v1::WATCH_MODE_LATEST, 1));
    ASSERT_TRUE(watchers.back()->Receive().has_opened());
  }
  EXPECT_EQ(ListedWatchers(), 4u);
  WatchClient fifth(channel_, "tank", v1::WATCH_MODE_LATEST, 1);
  ExpectRefused(fifth, grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_WATCHERS",
                "watchers: 4 watch; must be at most 4");
  watchers.pop_back();
  for (bool in = false; !in;) {  // The server sees it a little later.
    WatchClient again(channel_, "tank", v1::WATCH_MODE_LATEST, 1);
    in = again.Receive().has_opened();
  }
}

TEST_P(Watch, TheLoadTellsWatchersAndWhatTheyHaveNotTaken) {
  const auto wait_for = [&](auto expected) {
    EXPECT_TRUE(Eventually([&] {
      const v1::ServerLoad load = InfoOf(channel_).load();
      EXPECT_EQ(load.memory_budget(), TestOptions().limits.FrameBudget());
      return expected(load);
    }));
  };
  OpenProducer();
  {
    WatchClient watcher(channel_, "tank", v1::WATCH_MODE_EVERY, 1);
    ASSERT_TRUE(watcher.Receive().has_opened());
    std::uint64_t bytes = 0;
    for (std::uint64_t i = 0; i < 3; ++i) bytes += Produce(i).ByteSizeLong();
    EXPECT_TRUE(watcher.Receive().has_frame());
    wait_for([&](const v1::ServerLoad& load) {
      return load.watchers() == 1 && load.watched_bytes() > bytes / 2 && load.memory_held() == 0 &&
             load.frames_waiting() == 0;
    });
  }
  wait_for(
      [](const v1::ServerLoad& load) { return load.watchers() == 0 && load.watched_bytes() == 0; });
}

TEST_P(Watch, ADrainDeliversWhatIsDoneAndSaysGoodbye) {
  OpenProducer();
  WatchClient idle(channel_, "tank", v1::WATCH_MODE_EVERY, 9);
  WatchClient without_credit(channel_, "tank", v1::WATCH_MODE_EVERY, 1);
  ASSERT_TRUE(idle.Receive().has_opened());
  ASSERT_TRUE(without_credit.Receive().has_opened());
  Produce(0);
  Produce(1);
  std::thread drain([&] { server_->Drain(kGrace); });
  std::thread producer([&] { producer_->Finish(); });
  for (WatchClient* watcher : {&idle, &without_credit}) {
    std::uint64_t frames = 0;
    auto message = watcher->Receive();
    for (; message.has_frame(); message = watcher->Receive()) ++frames;
    EXPECT_EQ(message.ended().reason(), "DRAINING");
    EXPECT_EQ(frames + message.ended().dropped(), 2u);
    EXPECT_LE(frames, watcher == &idle ? 2u : 1u);
    ExpectRefused(*watcher, grpc::StatusCode::UNAVAILABLE, "DRAINING", "server: draining");
  }
  producer.join();
  drain.join();
}

INSTANTIATE_TEST_SUITE_P(Over, Watch, ::testing::Values(Transport::kInProcess, Transport::kTcp),
                         [](const auto& over) { return TransportName(over.param); });

}  // namespace
}  // namespace partiemc::server
