// WatchStateMachine over an in-memory transport: what watchers receive from a producer, in which
// order and at which rate. Also under ThreadSanitizer.
#include "server/watch/watch_state_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/memory_watcher.h"
#include "server/stream/stream_state_machine.h"
#include "server/watch/watch_registry.h"

namespace partiemc::server {
namespace {

using ::testing::ElementsAre;

constexpr std::size_t kFrameBytes = 1000;
constexpr std::size_t kMaxBytes = 10 * (kFrameBytes + kPublishedBytes);

class WatchTest : public ::testing::Test {
 protected:
  // Publishes frame `number`.
  void Publish(std::uint64_t number, std::size_t bytes = kFrameBytes) {
    if (broadcaster_->Publish(std::make_shared<NumberedFrame>(number, bytes), number))
      broadcaster_->Announce();
  }
  std::unique_ptr<MemoryWatcher> Join(WatchMode mode, std::uint64_t credit) {
    return std::make_unique<MemoryWatcher>(broadcaster_, mode, credit, kMaxBytes);
  }
  void EndStream() { broadcaster_->End(WatchEnd::OfStream(absl::OkStatus())); }

  WatchDispatcher dispatcher_;
  std::shared_ptr<ResultBroadcaster> broadcaster_ = std::make_shared<ResultBroadcaster>(
      dispatcher_,
      ResultBroadcaster::Limits{.mailbox_bytes = kMaxBytes, .kept_bytes = 2 * kFrameBytes});
};

TEST_F(WatchTest, ALateOneGetsTheNewestFrameAtOnceAndAgainWhenAllHadLeft) {
  for (std::uint64_t k = 1; k <= 5; ++k) Publish(k);
  for (int round = 0; round < 3; ++round) {
    const auto watcher = Join(WatchMode::kLatest, 1);
    watcher->WaitForFrames(1);
    EXPECT_THAT(watcher->seen(), ElementsAre(SeenFrame{5, 0}));
  }
}

TEST_F(WatchTest, AFrameTooLargeToBeKeptForNobodyIsNot) {
  Publish(1);
  Publish(2, 3 * kFrameBytes);
  const auto watcher = Join(WatchMode::kLatest, 1);
  while (broadcaster_->watcher_count() == 0) std::this_thread::yield();
  Publish(3);
  watcher->WaitForFrames(1);
  EXPECT_THAT(watcher->seen(), ElementsAre(SeenFrame{3, 0}));
}

TEST_F(WatchTest, AFrameThatIsLargerThanAWatcherMayHoldEndsTheWatch) {
  for (const WatchMode mode : {WatchMode::kLatest, WatchMode::kEvery}) {
    const auto watcher = Join(mode, 9);
    while (broadcaster_->watcher_count() == 0) std::this_thread::yield();
    Publish(1, kMaxBytes);
    EXPECT_EQ(watcher->status().code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(watcher->end_reason(), kReasonWatchedBytes);
    EXPECT_EQ(watcher->end_dropped(), 1u);
  }
}

TEST_F(WatchTest, EveryHoldsAsMuchAsItMayAndEndsWithTheFirstFrameBeyond) {
  const auto watcher = Join(WatchMode::kEvery, 1);
  Publish(1);
  watcher->WaitForFrames(1);
  for (std::uint64_t k = 2; k <= 10; ++k) Publish(k);  // Nine frames without credit.
  watcher->Credit(2);
  watcher->WaitForFrames(3);
  EXPECT_EQ(watcher->seen().back(), (SeenFrame{3, 0}));
  for (std::uint64_t k = 11; k <= 14; ++k) Publish(k);  // Seven are held, and these do not all fit.
  EXPECT_EQ(watcher->status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(watcher->end_reason(), kReasonFellBehind);
  EXPECT_EQ(watcher->seen().size(), 3u);
  EXPECT_EQ(watcher->end_dropped(), watcher->machine().counts().dropped);
}

TEST_F(WatchTest, ResultsLostBetweenServersLoseTheProducerInModeEvery) {
  const auto every = Join(WatchMode::kEvery, 9), latest = Join(WatchMode::kLatest, 9);
  while (broadcaster_->watcher_count() < 2) std::this_thread::yield();
  const auto publish = [&](std::uint64_t number, std::uint64_t last_loss) {
    broadcaster_->PublishNumbered(
        {std::make_shared<NumberedFrame>(number, kFrameBytes), number, number, last_loss});
  };
  publish(1, 0);
  every->WaitForFrames(1);
  latest->WaitForFrames(1);
  publish(4, 4);
  EXPECT_TRUE(every->status().ok());
  EXPECT_EQ(every->end_reason(), kReasonProducerLost);
  EXPECT_EQ(every->end_dropped(), 3u);
  latest->WaitForFrames(2);
  EXPECT_EQ(latest->seen().back(), (SeenFrame{4, 2}));
}

TEST_F(WatchTest, OneThatTakesNothingHoldsUpNobody) {
  const auto stuck = Join(WatchMode::kLatest, 1000);
  stuck->StopReading();
  const auto reading = Join(WatchMode::kEvery, 1000);
  while (broadcaster_->watcher_count() < 2) std::this_thread::yield();
  for (std::uint64_t k = 1; k <= 100; ++k) {
    Publish(k);
    reading->WaitForFrames(k);
  }
  EndStream();
  EXPECT_TRUE(reading->status().ok());
  EXPECT_EQ(reading->seen().size(), 100u);
  EXPECT_LE(stuck->seen().size(), 1u);
}

// Only the clock orders the end after the dispatcher's work, so ThreadSanitizer can see whether
// both hold the broadcaster's lock.
TEST_F(WatchTest, AStreamEndsWhileItsWatchersAreServed) {
  const auto watcher = Join(WatchMode::kLatest, 1);
  while (broadcaster_->watcher_count() == 0) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EndStream();
  EXPECT_TRUE(watcher->status().ok());
}

TEST_F(WatchTest, ADrainEndsThoseWithoutCreditAndCutsThoseWhoTakeNothing) {
  WatchRegistry registry(2);
  const auto poor = Join(WatchMode::kEvery, 1);
  const auto stuck = Join(WatchMode::kLatest, 9);
  EXPECT_TRUE(registry.Enter(poor->machine().shared_from_this()).ok());
  EXPECT_TRUE(registry.Enter(stuck->machine().shared_from_this()).ok());
  Publish(1);
  poor->WaitForFrames(1);
  stuck->WaitForFrames(1);
  stuck->StopReading();
  Publish(2);
  stuck->WaitForFrames(2);
  registry.Drain(std::chrono::steady_clock::now() + std::chrono::milliseconds(50));
  EXPECT_EQ(poor->status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(poor->end_reason(), kReasonDraining);
  EXPECT_EQ(stuck->status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(registry.Enter(poor->machine().shared_from_this()).code(),
            absl::StatusCode::kUnavailable);
}

// A transport whose writes end on request; it records them.
class StepTransport final : public WatchTransport {
 public:
  explicit StepTransport(WatchTerms terms_of_open) : terms(std::move(terms_of_open)) {}

  void StartRead() override {}
  void StartOpen() override { opening = true; }
  void WriteOpened(const HeldFrames&) override { ++under_way; }
  void WriteFrame(const Published& published, std::uint64_t dropped, std::uint64_t) override {
    ++under_way;
    written.push_back({static_cast<const NumberedFrame&>(*published.frame).number, dropped});
  }
  void WriteEnded(const WatchEnd& end, std::uint64_t dropped) override {
    ++under_way;
    ended = {end.reason, dropped};
  }
  void Cut() override { cut = true; }
  void Finish(const absl::Status& end) override { status = end; }

  const WatchTerms terms;
  bool opening = false, cut = false;
  int under_way = 0;
  std::vector<SeenFrame> written;
  std::optional<std::pair<std::string, std::uint64_t>> ended;
  std::optional<absl::Status> status;
};

// Sends `open`; the stream is found.
void Open(WatchStateMachine& machine, const StepTransport& transport) {
  machine.ReadDone({WatchRequest::Kind::kOpen, 0});
  EXPECT_TRUE(transport.opening);
  machine.Opened(transport.terms);
}

TEST_F(WatchTest, ASkippedFrameCountsAsDroppedAndReturnsItsCredit) {
  StepTransport transport({broadcaster_, WatchMode::kLatest, 2});
  const auto machine = std::make_shared<WatchStateMachine>(transport, kMaxBytes);
  machine->Start();
  Open(*machine, transport);
  machine->WriteDone(true);  // `opened`.
  Publish(1);
  dispatcher_.Flush();
  Publish(2);
  Publish(3);
  dispatcher_.Flush();
  machine->WriteSkipped();
  machine->WriteDone(true);
  Publish(4);
  dispatcher_.Flush();
  EXPECT_EQ(transport.written, (std::vector<SeenFrame>{{1, 0}, {3, 2}, {4, 0}}));
  EXPECT_EQ(machine->counts().frames, 2u);
  EXPECT_EQ(machine->counts().dropped, 2u);
  machine->WriteRefused(absl::ResourceExhaustedError("memory"));
  ASSERT_TRUE(transport.ended.has_value());
  EXPECT_EQ(transport.ended->second, 1u);
  EXPECT_EQ(machine->held_bytes(), 0u);
  machine->WriteDone(true);
  ASSERT_TRUE(transport.status.has_value());
  EXPECT_EQ(transport.status->code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(WatchTest, OfWhatIsPublishedAfterItIsInAWatcherOfEveryMissesNothing) {
  for (std::uint64_t round = 0; round < 200; ++round) {
    const auto watcher = Join(WatchMode::kEvery, 9);
    watcher->WaitUntilOpened();
    const std::uint64_t first = 10 * round + 1;
    for (std::uint64_t k = first; k < first + 4; ++k) Publish(k);
    const std::size_t newest = round == 0 ? 0 : 1;  // From the previous round.
    watcher->WaitForFrames(newest + 4);
    const auto seen = watcher->seen();
    ASSERT_EQ(seen.size(), newest + 4) << "round " << round;
    EXPECT_EQ(seen[newest].number, first);
  }
}

// For ThreadSanitizer: the stream may end on another thread than the one that serves its watchers.
TEST_F(WatchTest, AnEndWhileWatchersAreServedIsNoRace) {
  for (int round = 0; round < 200; ++round) {
    broadcaster_ = std::make_shared<ResultBroadcaster>(
        dispatcher_,
        ResultBroadcaster::Limits{.mailbox_bytes = kMaxBytes, .kept_bytes = 2 * kFrameBytes});
    const auto watcher = Join(WatchMode::kLatest, 1000);
    watcher->WaitUntilOpened();
    std::thread producer([this] {
      for (std::uint64_t k = 1; k <= 30; ++k) Publish(k);
    });
    EndStream();
    producer.join();
    EXPECT_TRUE(watcher->status().ok());
    EXPECT_EQ(watcher->end_reason(), kReasonFinished);
  }
}

TEST_F(WatchTest, AsManyMayWatchAsTheServerAndTheirCallerAllow) {
  WatchRegistry registry(2);
  const auto terms = std::make_shared<const CallerTerms>();
  const Caller modest(terms, std::make_shared<CallerAccount>(CallerQuota{.watchers = 1}));
  std::vector<std::shared_ptr<WatchStateMachine>> machines;
  StepTransport transport({broadcaster_, WatchMode::kLatest, 1});
  for (int i = 0; i < 4; ++i) {
    machines.push_back(std::make_shared<WatchStateMachine>(transport, kMaxBytes));
    ASSERT_TRUE(registry.Enter(machines.back()).ok()) << "it has not said yet what it wants";
  }
  EXPECT_EQ(registry.count(), 0u);
  const auto reason = [](const absl::Status& status) { return FindViolation(status)->reason; };
  EXPECT_TRUE(registry.Open(*machines[0], modest).ok());
  EXPECT_EQ(reason(registry.Open(*machines[1], modest)), kReasonCallerWatchers);
  EXPECT_TRUE(registry.Open(*machines[2]).ok());
  EXPECT_EQ(reason(registry.Open(*machines[3])), kReasonTooManyWatchers);
  EXPECT_EQ(registry.count(), 2u);
  registry.Close(*machines[0]);
  EXPECT_TRUE(registry.Open(*machines[1], modest).ok());
  for (const auto& machine : machines) registry.Leave(*machine);
  EXPECT_EQ(registry.count(), 0u);
  EXPECT_EQ(modest.account()->held(CallerAccount::Kind::kWatcher), 0u);
}

TEST_F(WatchTest, ASilentOneGivesWayAndOneThatHasOpenedDoesNot) {
  StepTransport silent({broadcaster_, WatchMode::kLatest, 1}),
      open({broadcaster_, WatchMode::kLatest, 1});
  const auto silent_machine = std::make_shared<WatchStateMachine>(silent, kMaxBytes);
  const auto open_machine = std::make_shared<WatchStateMachine>(open, kMaxBytes);
  silent_machine->Start();
  open_machine->Start();
  Open(*open_machine, open);
  silent_machine->GiveWay(absl::ResourceExhaustedError("others come"));
  open_machine->GiveWay(absl::ResourceExhaustedError("others come"));
  ASSERT_TRUE(silent.status.has_value());
  EXPECT_EQ(silent.status->message(), "others come");
  EXPECT_FALSE(open.status.has_value());
  open_machine->Cancelled();
  open_machine->WriteDone(false);
  EXPECT_TRUE(open.status.has_value());
}

TEST_F(WatchTest, WithoutMemoryEndsOpenWatchesAndCutsThoseBeingWritten) {
  StepTransport idle({broadcaster_, WatchMode::kEvery, 1}),
      writing({broadcaster_, WatchMode::kEvery, 1}), silent({broadcaster_, WatchMode::kLatest, 1});
  std::vector<std::shared_ptr<WatchStateMachine>> machines;
  for (StepTransport* const transport : {&idle, &writing, &silent}) {
    machines.push_back(std::make_shared<WatchStateMachine>(*transport, kMaxBytes));
    machines.back()->Start();
    if (transport != &silent) Open(*machines.back(), *transport);
  }
  machines[0]->WriteDone(true);
  for (const auto& machine : machines) machine->GiveUp(absl::ResourceExhaustedError("no memory"));
  ASSERT_TRUE(idle.status.has_value());
  EXPECT_EQ(idle.status->message(), "no memory");
  EXPECT_TRUE(writing.cut);
  EXPECT_FALSE(writing.status.has_value()) << "the write has not come back";
  machines[1]->WriteDone(false);
  ASSERT_TRUE(writing.status.has_value());
  EXPECT_EQ(writing.status->message(), "no memory");
  EXPECT_FALSE(silent.status.has_value()) << "it is not open";
  machines[2]->Cancelled();
}

TEST_F(WatchTest, OneThatNeverSaysWhatItWantsToWatchEndsAndItsPlaceIsFree) {
  using std::chrono::minutes;
  WatchRegistry registry(1);
  const auto now = std::chrono::steady_clock::now();
  StepTransport silent({broadcaster_, WatchMode::kLatest, 1}),
      next({broadcaster_, WatchMode::kLatest, 1});
  const auto machine = std::make_shared<WatchStateMachine>(silent, kMaxBytes);
  ASSERT_TRUE(registry.Enter(machine).ok());
  machine->Start();
  EXPECT_GE(registry.EndSilent(minutes(1), now), now + minutes(1));
  EXPECT_EQ(registry.EndSilent(minutes(0), now + minutes(9)),
            std::chrono::steady_clock::time_point::max());
  EXPECT_FALSE(silent.status.has_value());
  registry.EndSilent(minutes(1), now + minutes(2));
  ASSERT_TRUE(silent.status.has_value());
  EXPECT_EQ(silent.status->code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(FindViolation(*silent.status)->reason, kReasonIdle);
  EXPECT_EQ(FindViolation(*silent.status)->value, "sends no `open` for 60 s");
  registry.Close(*machine);
  EXPECT_EQ(registry.count(), 0u);
  const auto other = std::make_shared<WatchStateMachine>(next, kMaxBytes);
  ASSERT_TRUE(registry.Enter(other).ok());
  other->Start();
  Open(*other, next);
  EXPECT_EQ(registry.EndSilent(minutes(1), now + minutes(9)),
            std::chrono::steady_clock::time_point::max());
  EXPECT_FALSE(next.status.has_value());
  other->Cancelled();
  registry.Leave(*machine);
  registry.Leave(*other);
  broadcaster_->Leave(*other);
}

// The frames that a watcher should receive, computed as simply as possible.
struct Reference {
  WatchMode mode;
  std::uint64_t credit;
  bool writing = true;  // Writes `opened`.
  bool stream_ended = false, fell_behind = false, end_written = false;
  std::vector<std::uint64_t> waiting = {};
  std::uint64_t in_write = 0, lost = 0, told = 0;
  std::vector<SeenFrame> written = {};

  void Offer(std::uint64_t number) {
    if (stream_ended || fell_behind) return;
    if (mode == WatchMode::kLatest) {
      lost += waiting.size();
      waiting = {number};
    } else if (waiting.size() + (in_write != 0 ? 1 : 0) == 10) {
      lost += waiting.size() + 1;
      waiting.clear();
      fell_behind = true;
    } else {
      waiting.push_back(number);
    }
  }
  void Go() {
    if (writing) return;
    if (!waiting.empty() && credit > 0) {
      --credit;
      in_write = waiting.front();
      waiting.erase(waiting.begin());
      written.push_back({in_write, lost - told});
      told = lost;
      writing = true;
    } else if ((stream_ended || fell_behind) && waiting.empty() && !end_written) {
      end_written = writing = true;
    }
  }
  void WriteDone() {
    writing = false;
    in_write = 0;
  }
};

TEST_F(WatchTest, RandomOrdersGiveWhatAPlainReferenceSays) {
  const char* const asked = std::getenv("PARTIEMC_WATCH_ORDERS");
  const int orders = asked != nullptr ? std::atoi(asked) : 3000;
  std::uint64_t steps = 0, drops = 0, fell_behind = 0;
  for (int seed = 0; seed < orders; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    const auto pick = [&](unsigned n) { return static_cast<unsigned>(random() % n); };
    const WatchMode mode = pick(2) == 0 ? WatchMode::kLatest : WatchMode::kEvery;
    const std::uint64_t credit = 1 + pick(4);
    const unsigned generosity = 1 + pick(6);  // Of credit and connection.
    StepTransport transport({broadcaster_, mode, credit});
    const auto machine = std::make_shared<WatchStateMachine>(transport, kMaxBytes);
    machine->Start();
    Open(*machine, transport);
    Reference reference{.mode = mode, .credit = credit};
    std::uint64_t number = pick(100);
    const int length = 20 + static_cast<int>(pick(100));
    for (int step = 0; step < length || !transport.status; ++step, ++steps) {
      const unsigned what = step < length ? pick(8) : 6 + pick(2);
      if (step == length && !reference.stream_ended) {
        machine->StreamEnded(WatchEnd::OfStream(absl::OkStatus()));
        reference.stream_ended = true;
      } else if (what < 3) {
        const Published published{std::make_shared<NumberedFrame>(++number, kFrameBytes), number};
        machine->Offer({&published, 1});
        reference.Offer(number);
      } else if (what < 5 || (step < length && pick(generosity) != 0)) {
        continue;
      } else if (what == 6) {
        const std::uint64_t frames = 1 + pick(3);
        machine->ReadDone({WatchRequest::Kind::kCredit, frames});
        reference.credit += frames;
      } else if (transport.under_way > 0) {
        --transport.under_way;
        reference.WriteDone();
        machine->WriteDone(true);
      }
      reference.Go();
      ASSERT_LE(transport.under_way, 1) << "seed " << seed;
      ASSERT_EQ(transport.written, reference.written) << "seed " << seed << " step " << step;
      ASSERT_EQ(transport.ended.has_value(), reference.end_written) << "seed " << seed;
    }
    const WatchCounts counts = machine->counts();
    ASSERT_EQ(counts.dropped, reference.lost) << "seed " << seed;
    std::uint64_t told = transport.ended->second;
    for (const SeenFrame& seen : transport.written) told += seen.dropped;
    ASSERT_EQ(told, counts.dropped) << "seed " << seed;
    ASSERT_EQ(transport.ended->first, reference.fell_behind ? kReasonFellBehind : kReasonFinished);
    drops += counts.dropped;
    fell_behind += reference.fell_behind ? 1 : 0;
  }
  std::printf("%d orders, %llu steps, %llu drops, %llu fell behind\n", orders,
              static_cast<unsigned long long>(steps), static_cast<unsigned long long>(drops),
              static_cast<unsigned long long>(fell_behind));
  EXPECT_GT(drops, 0u);
  EXPECT_GT(fell_behind, 0u);
}

// Checks that reported and counted drops agree, and that every gap in the numbers was reported.
void ExpectSound(const MemoryWatcher& watcher, bool every) {
  EXPECT_EQ(watcher.unpaid(), 0u);
  const auto seen = watcher.seen();
  for (std::size_t k = 1; k < seen.size(); ++k) {
    EXPECT_EQ(seen[k].number, seen[k - 1].number + seen[k].dropped + 1);
    if (every) {
      EXPECT_EQ(seen[k].dropped, 0u);
    }
  }
}

TEST_F(WatchTest, WatchersComeAndGoAndDawdleWhileTheProducerNeverWaits) {
  constexpr std::uint64_t kFrames = 20'000;
  std::atomic<bool> done = false;
  std::vector<std::thread> audience;
  for (unsigned seed = 0; seed < 6; ++seed) {
    audience.emplace_back([&, seed] {
      std::mt19937 random(seed);
      while (!done) {
        const bool every = random() % 2 == 0;
        const auto watcher = Join(every ? WatchMode::kEvery : WatchMode::kLatest, 1 + random() % 3);
        const std::size_t frames = random() % 20;
        for (std::size_t k = 1; k <= frames && !done; ++k) {
          watcher->WaitForFrames(k);
          watcher->Credit(1 + random() % 2);
          if (random() % 8 == 0) std::this_thread::yield();
        }
        ExpectSound(*watcher, every);
      }
    });
  }
  const auto stuck = Join(WatchMode::kLatest, 1000);
  stuck->StopReading();
  const auto last = Join(WatchMode::kLatest, kFrames);
  while (broadcaster_->watcher_count() < 2) std::this_thread::yield();
  for (std::uint64_t k = 1; k <= kFrames; ++k) {
    Publish(k);
    if (k % 16 == 0) std::this_thread::yield();
  }
  EndStream();
  EXPECT_TRUE(last->status().ok());
  done = true;
  stuck->Cancel();
  for (std::thread& watcher : audience) watcher.join();
  ExpectSound(*last, /*every=*/false);
  ASSERT_FALSE(last->seen().empty());
  EXPECT_EQ(last->seen().back().number, kFrames);  // The last frame is never missed.
  const SeenFrame first = last->seen().front();
  EXPECT_EQ(last->seen().size() + last->machine().counts().dropped,
            kFrames - (first.number - first.dropped) + 1);
#ifndef PARTIEMC_SANITIZED  // Sanitizers' allocators delay this.
  EXPECT_EQ(broadcaster_->producer_waits(), 0u);
#endif
}

}  // namespace
}  // namespace partiemc::server
