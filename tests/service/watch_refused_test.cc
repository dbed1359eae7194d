// The rows of the table of watches in proto/PROTOCOL.md: one test per row, named by its reason,
// with exact code, reason and message (golden_messages.txt). error_table_test.cc finds rows without
// a test.
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "relay/forging_peer.h"
#include "relay/nats_process.h"
#include "server/merging_balls.h"
#include "service/error_testing.h"
#include "support/temporary_folder.h"
#include "wire/codec.h"

namespace partiemc::server {
namespace {

using grpc::StatusCode;

class WatchRefused : public ErrorTable {
 protected:
  void SetUp() override { options_.limits.max_watchers = 1; }

  // Serves a stream named "tank".
  void OpenProducer() {
    Serve();
    producer_ = std::make_unique<StreamClient>(channel_);
    ASSERT_TRUE(producer_->SendAndReceive(OpenRequest("tank")).has_opened());
  }
  // Serves a stream of surfaces named "tank".
  void OpenProducerOfSurfaces() {
    Serve();
    v1::ReconstructRequest open = OpenRequest("tank");
    wire::EncodeParameters(MergingBallsParameters(), *open.mutable_open()->mutable_parameters());
    producer_ = std::make_unique<StreamClient>(channel_);
    ASSERT_TRUE(producer_->SendAndReceive(open).has_opened());
  }
  static v1::WatchStreamRequest RequestOf(const v1::LevelOfDetail& level) {
    v1::WatchStreamRequest request;
    request.mutable_open()->set_stream_name("tank");
    request.mutable_open()->set_mode(v1::WATCH_MODE_EVERY);
    request.mutable_open()->set_credits(9);
    *request.mutable_open()->mutable_level_of_detail() = level;
    return request;
  }
  // Expects this end of a watch with this level.
  void ExpectOfLevel(const v1::LevelOfDetail& level, StatusCode code, const std::string& reason) {
    WatchClient watcher(channel_);
    watcher.Send(RequestOf(level));
    Expect(watcher, code, reason);
  }
  void Expect(WatchClient& watcher, StatusCode code, const std::string& reason) {
    const auto status = watcher.Finish();
    EXPECT_EQ(status.error_code(), code);
    EXPECT_EQ(watcher.reason(), reason);
    messages_.Expect(status.error_message());
    ExpectDetails(status, reason);
  }
  void ExpectOfOpen(const std::string& name, v1::WatchMode mode, std::uint32_t credits,
                    StatusCode code, const std::string& reason) {
    OpenProducer();
    WatchClient watcher(channel_, name, mode, credits);
    Expect(watcher, code, reason);
  }
  // Expects this end of a watcher in mode `every` with one credit, while the producer runs.
  void ExpectOfFrames(std::uint64_t max_watcher_bytes, const std::string& reason) {
    options_.limits.max_watcher_bytes = max_watcher_bytes;
    options_.limits.history_bytes = 0;  // It would wait in the history.
    OpenProducer();
    WatchClient watcher(channel_, "tank", v1::WATCH_MODE_EVERY, 1);
    ASSERT_TRUE(watcher.Receive().has_opened());
    for (std::uint64_t k = 1; k <= 40; ++k) {
      ASSERT_TRUE(producer_->SendAndReceive(BlobRequest(k, 1, k)).has_frame());
    }
    Expect(watcher, StatusCode::RESOURCE_EXHAUSTED, reason);
  }

  const support::TemporaryFolder folder_;
  std::unique_ptr<StreamClient> producer_;
};

TEST_F(WatchRefused, PROTOCOL) {
  OpenProducer();
  WatchClient watcher(channel_);
  watcher.Credit(1);
  Expect(watcher, StatusCode::INVALID_ARGUMENT, "PROTOCOL");
}

TEST_F(WatchRefused, IDLE) {
  options_.limits.idle.opening = std::chrono::milliseconds(20);
  Serve();
  WatchClient watcher(channel_);
  Expect(watcher, StatusCode::DEADLINE_EXCEEDED, "IDLE");
}

TEST_F(WatchRefused, OUT_OF_RANGE) {
  ExpectOfOpen("tank", v1::WATCH_MODE_LATEST, 0, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
  producer_.reset();
  OpenProducerOfSurfaces();
  v1::LevelOfDetail level;
  ExpectOfLevel(level, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
  for (const double error : {0.0, -1.0, 1.5, std::numeric_limits<double>::quiet_NaN()}) {
    level.set_max_error(error);
    ExpectOfLevel(level, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
  }
  level.set_max_triangles(0);
  ExpectOfLevel(level, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
}

TEST_F(WatchRefused, UNSUPPORTED) {
  ExpectOfOpen("tank", static_cast<v1::WatchMode>(9), 1, StatusCode::INVALID_ARGUMENT,
               "UNSUPPORTED");
  v1::LevelOfDetail level;
  level.set_max_error(.1);
  ExpectOfLevel(level, StatusCode::INVALID_ARGUMENT, "UNSUPPORTED");  // A stream of outlines.
}

TEST_F(WatchRefused, TOO_MANY_LEVELS) {
  options_.limits.max_watchers = 20;
  OpenProducerOfSurfaces();
  std::vector<std::unique_ptr<WatchClient>> watchers;
  v1::LevelOfDetail level;
  for (int k = 1; k <= 8; ++k) {
    level.set_max_triangles(100 * k);
    watchers.push_back(std::make_unique<WatchClient>(channel_));
    watchers.back()->Send(RequestOf(level));
    ASSERT_TRUE(watchers.back()->Receive().has_opened());
  }
  WatchClient shares(channel_);
  shares.Send(RequestOf(level));
  EXPECT_TRUE(shares.Receive().has_opened());
  level.set_max_error(.1);
  ExpectOfLevel(level, StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_LEVELS");
}

TEST_F(WatchRefused, MEMORY_BUDGET) {
  options_.limits.memory_budget = 1 << 20;
  OpenProducerOfSurfaces();
  v1::LevelOfDetail level;
  level.set_max_error(.1);
  WatchClient watcher(channel_);
  watcher.Send(RequestOf(level));
  ASSERT_TRUE(watcher.Receive().has_opened());
  v1::ReconstructRequest request;
  wire::EncodeFrame(MergingBalls(0).AsFrame(0), *request.mutable_frame());
  request.mutable_frame()->set_sequence(1);
  ASSERT_TRUE(producer_->SendAndReceive(request).has_frame());
  Expect(watcher, StatusCode::RESOURCE_EXHAUSTED, "MEMORY_BUDGET");
}

TEST_F(WatchRefused, INVALID_RESULT) {
  const NatsProcess nats;
  options_.nats = nats.url();
  Serve();
  ForgingPeer peer(nats.url(), "tank");
  peer.Publish("no message");
  ASSERT_TRUE(Eventually([&] {
    WatchClient exact(channel_, "tank", v1::WATCH_MODE_EVERY, 9);
    return exact.Receive().has_opened();
  }));
  v1::LevelOfDetail level;
  level.set_max_error(.1);
  // The place of the former watcher may not be free yet.
  ASSERT_TRUE(Eventually([&] {
    WatchClient watcher(channel_);
    watcher.Send(RequestOf(level));
    watcher.Finish();
    return watcher.reason() != "TOO_MANY_WATCHERS";
  }));
  ExpectOfLevel(level, StatusCode::DATA_LOSS, "INVALID_RESULT");
}

TEST_F(WatchRefused, NO_SUCH_STREAM) {
  ExpectOfOpen("tonk", v1::WATCH_MODE_LATEST, 1, StatusCode::NOT_FOUND, "NO_SUCH_STREAM");
}

TEST_F(WatchRefused, TOO_MANY_WATCHERS) {
  OpenProducer();
  WatchClient first(channel_, "tank", v1::WATCH_MODE_LATEST, 1);
  ASSERT_TRUE(first.Receive().has_opened());
  WatchClient second(channel_, "tank", v1::WATCH_MODE_LATEST, 1);
  Expect(second, StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_WATCHERS");
}

TEST_F(WatchRefused, CALLER_WATCHERS) {
  options_.limits.max_watchers = 2;
  options_.token_file = folder_.Write("tokens", std::string(kToken) + " watchers=1\n");
  Serve();
  const auto begin = [&](grpc::ClientContext& context) {
    SetDeadline(context);
    context.AddMetadata("authorization", std::string("Bearer ") + kToken);
  };
  grpc::ClientContext producing, watching, too_many;
  begin(producing), begin(watching), begin(too_many);
  const auto producer = stub_->Reconstruct(&producing);
  v1::ReconstructResponse opened;
  ASSERT_TRUE(producer->Write(OpenRequest("tank")) && producer->Read(&opened));
  v1::WatchStreamRequest open;
  open.mutable_open()->set_stream_name("tank");
  open.mutable_open()->set_credits(1);
  v1::WatchStreamResponse response;
  const auto first = stub_->WatchStream(&watching), second = stub_->WatchStream(&too_many);
  ASSERT_TRUE(first->Write(open) && first->Read(&response));
  EXPECT_TRUE(second->Write(open));
  EXPECT_FALSE(second->Read(&response));
  const auto status = second->Finish();
  EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(too_many), "CALLER_WATCHERS");
  messages_.Expect(status.error_message());
  producing.TryCancel();
  watching.TryCancel();
}

TEST_F(WatchRefused, FELL_BEHIND) { ExpectOfFrames(200'000, "FELL_BEHIND"); }

TEST_F(WatchRefused, WATCHED_BYTES) { ExpectOfFrames(100, "WATCHED_BYTES"); }

}  // namespace
}  // namespace partiemc::server
