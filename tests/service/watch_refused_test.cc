// The rows of the table of watches in proto/PROTOCOL.md: one test per row, named by its reason,
// with exact code, reason and words. error_table_test.cc finds rows without a test.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "service/error_testing.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

using grpc::StatusCode;
using ::testing::MatchesRegex;

constexpr char kToken[] = "0123456789abcdef0123456789abcdef";

class WatchRefused : public ErrorTable {
 protected:
  void SetUp() override { options_.limits.max_watchers = 1; }

  // Serves a stream named "tank".
  void OpenProducer() {
    Serve();
    producer_ = std::make_unique<StreamClient>(channel_);
    ASSERT_TRUE(producer_->SendAndReceive(OpenRequest("tank")).has_opened());
  }
  void Expect(WatchClient& watcher, StatusCode code, const std::string& reason,
              const std::string& message) {
    const auto status = watcher.Finish();
    EXPECT_EQ(status.error_code(), code);
    EXPECT_EQ(watcher.reason(), reason);
    EXPECT_THAT(status.error_message(), MatchesRegex(message));
    ExpectDetails(status, reason);
  }
  void ExpectOfOpen(const std::string& name, v1::WatchMode mode, std::uint32_t credits,
                    StatusCode code, const std::string& reason, const std::string& message) {
    OpenProducer();
    WatchClient watcher(channel_);
    watcher.Open(name, mode, credits);
    Expect(watcher, code, reason, message);
  }
  // Expects this end of a watcher in mode `every` with one credit, while the producer runs.
  void ExpectOfFrames(std::uint64_t max_watcher_bytes, const std::string& reason,
                      const std::string& message) {
    options_.limits.max_watcher_bytes = max_watcher_bytes;
    options_.limits.history_bytes = 0;  // It would wait in the history.
    OpenProducer();
    WatchClient watcher(channel_);
    watcher.Open("tank", v1::WATCH_MODE_EVERY, 1);
    ASSERT_TRUE(watcher.Receive().has_opened());
    for (std::uint64_t k = 1; k <= 40; ++k) {
      ASSERT_TRUE(producer_->SendAndReceive(BlobRequest(k, 1, k)).has_frame());
    }
    Expect(watcher, StatusCode::RESOURCE_EXHAUSTED, reason, message);
  }

  const support::TemporaryFolder folder_;
  std::unique_ptr<StreamClient> producer_;
};

TEST_F(WatchRefused, PROTOCOL) {
  OpenProducer();
  WatchClient watcher(channel_);
  watcher.Credit(1);
  Expect(watcher, StatusCode::INVALID_ARGUMENT, "PROTOCOL",
         "request: no `open`; the first must be `open`");
}

TEST_F(WatchRefused, IDLE) {
  options_.limits.idle.opening = std::chrono::milliseconds(20);
  Serve();
  WatchClient watcher(channel_);
  Expect(watcher, StatusCode::DEADLINE_EXCEEDED, "IDLE",
         "client: sends no `open` for 0.02 s; must do so within this time "
         "\\(Limits.idle_timeout_seconds once open\\); open a new stream");
}

TEST_F(WatchRefused, OUT_OF_RANGE) {
  ExpectOfOpen("tank", v1::WATCH_MODE_LATEST, 0, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE",
               "open.credits: 0; must be at least 1");
}

TEST_F(WatchRefused, UNSUPPORTED) {
  ExpectOfOpen("tank", static_cast<v1::WatchMode>(9), 1, StatusCode::INVALID_ARGUMENT,
               "UNSUPPORTED", "open.mode: 9; must be WATCH_MODE_LATEST or WATCH_MODE_EVERY");
}

TEST_F(WatchRefused, NO_SUCH_STREAM) {
  ExpectOfOpen("tonk", v1::WATCH_MODE_LATEST, 1, StatusCode::NOT_FOUND, "NO_SUCH_STREAM",
               "open.stream_name: \"tonk\"; must be the name of an open stream; ListStreams tells "
               "them");
}

TEST_F(WatchRefused, TOO_MANY_WATCHERS) {
  OpenProducer();
  WatchClient first(channel_);
  first.Open("tank", v1::WATCH_MODE_LATEST, 1);
  ASSERT_TRUE(first.Receive().has_opened());
  WatchClient second(channel_);
  second.Open("tank", v1::WATCH_MODE_LATEST, 1);
  Expect(second, StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_WATCHERS",
         "watchers: 1 watch; must be at most 1; try again when one has left, or start the server "
         "with a larger --max-watchers");
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
  EXPECT_EQ(status.error_message(),
            "caller.watchers: 1 going on; must be at most 1 of one caller, which is a token or, "
            "without tokens, an address; try again when a call of it has ended");
  producing.TryCancel();
  watching.TryCancel();
}

TEST_F(WatchRefused, FELL_BEHIND) {
  ExpectOfFrames(200'000, "FELL_BEHIND",
                 "watcher: [0-9]+ frames of [0-9]+ bytes behind; must be at most 200000 bytes "
                 "behind in mode `every`; give credit sooner, or watch in mode `latest`");
}

TEST_F(WatchRefused, WATCHED_BYTES) {
  ExpectOfFrames(100, "WATCHED_BYTES",
                 "frame: [0-9]+ bytes; must be at most 100 to be watched; have the producer ask "
                 "for less, or start the server with a larger --max-watcher-bytes");
}

}  // namespace
}  // namespace partiemc::server
