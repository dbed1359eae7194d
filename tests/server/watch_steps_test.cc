// WatchStateMachine step by step, over a transport whose writes end on request: credit, drops,
// limits, eviction.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/memory_watcher.h"
#include "server/stream/stream_state_machine.h"
#include "server/watch/watch_registry.h"
#include "server/watch/watch_state_machine.h"
#include "server/watch_fixture.h"
#include "support/tries.h"

namespace partiemc::server {
namespace {

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
  const int orders = support::Tries(3000);
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

}  // namespace
}  // namespace partiemc::server
