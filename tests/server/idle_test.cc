// Streams that keep the server waiting. Tests pass times to the machine instead of waiting, except
// for the timer itself.
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <thread>

#include "partiemc/status.h"
#include "server/memory_transport.h"
#include "server/memory_watcher.h"
#include "server/moving_blob.h"
#include "server/scripted_transport.h"
#include "server/stream/idle_timer.h"
#include "server/stream/stream_registry.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::minutes;
using std::chrono::steady_clock;

constexpr FrameLimits kBlobLimits{.max_particles = 2000, .max_tiles = 1000};
constexpr IdleLimits kIdleLimits{.opening = minutes(1), .streaming = minutes(10)};

class Idle : public ::testing::Test {
 protected:
  // EndIfIdle of the machine as if `later` had passed.
  steady_clock::time_point EndIfIdle(milliseconds later, const IdleLimits& limits = kIdleLimits) {
    return transport_.machine().EndIfIdle(limits, steady_clock::now() + later);
  }
  void ExpectIdle(const char* value) {
    EXPECT_EQ(transport_.status().code(), absl::StatusCode::kDeadlineExceeded);
    const auto violation = FindViolation(transport_.status());
    ASSERT_TRUE(violation.has_value());
    EXPECT_EQ(violation->reason, kReasonIdle);
    EXPECT_EQ(violation->value, value);
  }

  // Opens a stream and sends two frames. The only worker is busy until `go` is set.
  void SendTwoThatWaitFor(std::promise<void>& go) {
    pool_.Submit([future = go.get_future().share()](Worker&) { future.wait(); });
    transport_.Open();
    ASSERT_EQ(transport_.Receive()->what, Outgoing::kOpened);
    transport_.Send(1, MovingBlob(1, 0));
    transport_.Send(2, MovingBlob(1, 1));
    transport_.WaitUntilRead(2);  // So the machine has accepted the first one.
  }

  ComputePool pool_{1};
  MemoryTransport transport_{pool_, 2, BlobParameters(), kBlobLimits};
};

TEST_F(Idle, ACallThatNeverOpensEnds) {
  const auto look_again = EndIfIdle(milliseconds(0));
  EXPECT_LE(look_again, steady_clock::now() + kIdleLimits.opening);
  EndIfIdle(kIdleLimits.opening);
  EXPECT_FALSE(transport_.Receive().has_value());
  ExpectIdle("sends no `open` for 60 s");
}

TEST_F(Idle, AStreamWithoutAFrameEndsAndOneThatHadOneInTimeDoesNot) {
  transport_.Open();
  ASSERT_EQ(transport_.Receive()->what, Outgoing::kOpened);
  EndIfIdle(minutes(9));
  const auto before_frame = steady_clock::now();
  transport_.Send(1, MovingBlob(1, 0));
  ASSERT_EQ(transport_.Receive()->sequence, 1u);
  EXPECT_GE(EndIfIdle(milliseconds(0)), before_frame + kIdleLimits.streaming);
  EndIfIdle(minutes(10));
  EXPECT_FALSE(transport_.Receive().has_value());
  ExpectIdle("sends no frame for 600 s");
}

TEST_F(Idle, AClientThatTakesNoAnswersIsCut) {
  transport_.Open();
  for (std::uint64_t i = 1; i <= 6; ++i) transport_.Send(i, MovingBlob(1, i));
  transport_.WaitUntilRead(2);
  // Waits until both are computed; this wait is the server's, not the client's.
  while (transport_.machine().counts().frames < 2) std::this_thread::yield();
  EndIfIdle(minutes(10));
  ExpectIdle("takes no answer for 600 s");
}

TEST_F(Idle, WaitingForAWorkerDoesNotCount) {
  std::promise<void> go;
  SendTwoThatWaitFor(go);
  EndIfIdle(minutes(100));
  go.set_value();
  EXPECT_EQ(transport_.Receive()->sequence, 1u);
  EXPECT_EQ(transport_.Receive()->sequence, 2u);
  transport_.HalfClose();
  EXPECT_TRUE(transport_.status().ok());
}

TEST_F(Idle, TheTimeToTakeAnAnswerBeginsWithItsWrite) {
  std::promise<void> go;
  SendTwoThatWaitFor(go);
  const auto before_answer = steady_clock::now();
  go.set_value();
  while (transport_.machine().counts().frames < 2) std::this_thread::yield();
  EXPECT_GE(EndIfIdle(milliseconds(0)), before_answer + kIdleLimits.streaming);
}

TEST(IdleStream, WaitingForAPermitToReadDoesNotCount) {
  SteppedPool pool;
  MemoryBudget budget(1, {.reads = {.streams_beyond = 1, .message_bytes = 1000}});
  ScriptedTransport first(pool, budget, 2, BlobParameters(), kBlobLimits);
  ScriptedTransport second(pool, budget, 2, BlobParameters(), kBlobLimits);
  for (ScriptedTransport* transport : {&first, &second}) {
    transport->BringRequest({.kind = RequestKind::kOpen, .positions = {}});
    transport->EndWrite(true);
  }
  ASSERT_TRUE(first.reading());
  ASSERT_FALSE(second.reading()) << "the first stream has the only slot";
  second.machine().EndIfIdle(kIdleLimits, steady_clock::now() + minutes(100));
  ASSERT_FALSE(second.finished().has_value());
  const auto before_read = steady_clock::now();
  first.machine().Cancelled();
  ASSERT_TRUE(second.reading());
  EXPECT_GE(second.machine().EndIfIdle(kIdleLimits, before_read),
            before_read + kIdleLimits.streaming);
  second.machine().EndIfIdle(kIdleLimits, steady_clock::now() + minutes(10));
  EXPECT_TRUE(second.finished().has_value());
}

TEST_F(Idle, WithoutALimitNothingEnds) {
  EXPECT_EQ(EndIfIdle(minutes(1000), {}), steady_clock::time_point::max());
  transport_.Open();
  ASSERT_EQ(transport_.Receive()->what, Outgoing::kOpened);
  EXPECT_EQ(EndIfIdle(minutes(1000), {}), steady_clock::time_point::max());
  transport_.HalfClose();
  EXPECT_TRUE(transport_.status().ok());
}

TEST(IdleTimer, EndsEveryStreamOfTheRegistryThatWaitsForTooLong) {
  ComputePool pool(1);
  StreamRegistry registry(10);
  WatchRegistry watchers(10);
  UnaryRegistry calls(10);
  ServerLimits limits;
  limits.idle = {.opening = milliseconds(20), .streaming = minutes(10)};
  const IdleTimer timer(registry, watchers, calls, limits);
  // The timer already sleeps when they arrive.
  for (int round = 0; round < 3; ++round) {
    MemoryTransport transport(pool, 2, BlobParameters(), kBlobLimits);
    ASSERT_TRUE(registry.Enter(transport.machine().shared_from_this()).ok());
    EXPECT_EQ(FindViolation(transport.status())->reason, kReasonIdle);
    registry.Leave(transport.machine());
  }
}

TEST(IdleTimer, EndsAWatcherThatPausesAfterTheEndOfItsStream) {
  StreamRegistry registry(10);
  WatchRegistry watchers(10);
  UnaryRegistry calls(10);
  HistoryRoom room(1'000'000, 1'000'000);
  WatchDispatcher dispatcher;
  const auto broadcaster =
      std::make_shared<ResultBroadcaster>(dispatcher, ResultBroadcaster::Limits{});
  broadcaster->BeginHistory(room, nullptr, 1);
  for (std::uint64_t k = 1; k <= 3; ++k) {
    EXPECT_FALSE(broadcaster->Publish(std::make_shared<NumberedFrame>(k, 1000), k));
  }
  ServerLimits limits;
  limits.paused = {.pause = milliseconds(20), .write = minutes(10)};
  const IdleTimer timer(registry, watchers, calls, limits);
  MemoryWatcher watcher(broadcaster, WatchMode::kEvery, 1, 100'000, 1);
  ASSERT_TRUE(watchers.Enter(watcher.machine().shared_from_this()).ok());
  watcher.WaitForFrames(1);
  broadcaster->End(WatchEnd::OfStream(absl::OkStatus()));
  EXPECT_EQ(FindViolation(watcher.status())->reason, kReasonIdle);
  watchers.Leave(watcher.machine());
}

}  // namespace
}  // namespace partiemc::server
