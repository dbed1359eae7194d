// A watch through events in random orders: the rules of its transport hold, it ends once, and all
// states that it reaches are in the table.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

#include "server/memory_watcher.h"
#include "server/reached_states.h"
#include "server/watch/result_broadcaster.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch/watch_state_machine.h"
#include "support/random.h"

namespace partiemc::server {
namespace {

constexpr std::size_t kScriptedMaxBytes = 4 * (100 + kPublishedBytes);

// The other side of the watch is the test.
class ScriptedWatch final : private WatchTransport {
 public:
  explicit ScriptedWatch(WatchTerms terms) : terms_(std::move(terms)) {
    machine->Start(absl::OkStatus());
  }

  void Bring(const WatchRequest& request) {
    reading = false;
    machine->ReadDone(request);
  }
  void EndReads() {
    reading = false;
    machine->ReadEnded();
  }
  void EndOpening(bool ok) {
    opening = false;
    ok ? machine->Opened(terms_) : machine->Opened(absl::NotFoundError("no such stream"));
  }
  void EndWrite(bool ok) {
    writing = writing_frame = false;
    machine->WriteDone(ok);
  }
  // The frame in write has no level of detail.
  void GiveUpWrite(bool skips) {
    writing = writing_frame = false;
    skips ? machine->WriteSkipped() : machine->WriteRefused(absl::ResourceExhaustedError("memory"));
  }

  bool reading = false, opening = false, writing = false, writing_frame = false;
  std::optional<absl::Status> finished;
  const std::shared_ptr<WatchStateMachine> machine =
      std::make_shared<WatchStateMachine>(static_cast<WatchTransport&>(*this), kScriptedMaxBytes);

 private:
  void StartRead() override { Begin(reading); }
  void StartOpen() override { Begin(opening); }
  void WriteOpened(const HeldFrames&) override { Begin(writing); }
  void WriteFrame(const Published&, std::uint64_t, std::uint64_t) override {
    Begin(writing);
    writing_frame = true;
  }
  void WriteEnded(const WatchEnd&, std::uint64_t) override { Begin(writing); }
  void Cut() override {
    if (finished) throw std::logic_error("cut after the end");
  }
  void Finish(const absl::Status& status) override {
    if (finished || writing || opening) throw std::logic_error("finished too early, or twice");
    finished = status;
  }
  void Begin(bool& what) {
    if (what || finished) throw std::logic_error("begun twice, or after the end");
    what = true;
  }

  const WatchTerms terms_;
};

class WatchOrder {
 public:
  WatchOrder(std::uint64_t seed, std::shared_ptr<ResultBroadcaster> broadcaster,
             ReachedStates& reached)
      : random_(seed),
        reached_(reached),
        watch_({.broadcaster = std::move(broadcaster),
                .mode = random_.Chance(0.5) ? WatchMode::kLatest : WatchMode::kEvery,
                .credit = 1 + random_.Below(3)}) {}

  void Run() {
    for (int step = 0; step < 40 && !watch_.finished; ++step) {
      Step();
      reached_.Add(watch_.machine->state());
    }
    watch_.machine->Cancelled();
    reached_.Add(watch_.machine->state());
    if (watch_.opening) watch_.EndOpening(true);
    if (watch_.writing) watch_.EndWrite(false);
    EXPECT_TRUE(watch_.finished.has_value());
    if (watch_.reading) watch_.EndReads();
    reached_.Add(watch_.machine->state());
    EXPECT_EQ(watch_.machine->held_bytes(), 0u);
  }

 private:
  void Step() {
    const std::size_t dice = random_.Below(20);
    if (dice < 6) {
      if (watch_.reading) random_.Chance(0.1) ? watch_.EndReads() : Bring();
    } else if (dice < 9) {
      if (watch_.opening) watch_.EndOpening(random_.Chance(0.95));
    } else if (dice < 13) {
      if (watch_.writing_frame && random_.Chance(0.2)) {
        watch_.GiveUpWrite(random_.Chance(0.9));
      } else if (watch_.writing) {
        watch_.EndWrite(random_.Chance(0.95));
      }
    } else if (dice < 17) {
      const Published frame{std::make_shared<NumberedFrame>(
                                number_ + 1, random_.Chance(0.02) ? kScriptedMaxBytes : 100),
                            number_ + 1, number_ + 1};
      ++number_;
      watch_.machine->Offer({&frame, 1});
    } else if (random_.Chance(0.3)) {
      SomethingElse();
    }
  }

  void Bring() {
    const bool first = std::exchange(first_, false);
    if (first != random_.Chance(0.03)) return watch_.Bring({WatchRequest::Kind::kOpen, 0});
    if (random_.Chance(0.03)) return watch_.Bring({WatchRequest::Kind::kMalformed, 0});
    watch_.Bring({WatchRequest::Kind::kCredit, random_.Chance(0.03) ? 0 : 1 + random_.Below(3)});
  }

  void SomethingElse() {
    WatchStateMachine& machine = *watch_.machine;
    const absl::Status status = absl::ResourceExhaustedError("no memory");
    const std::vector<std::function<void()>> events = {
        [&] { machine.StreamEnded(WatchEnd::OfStream(absl::OkStatus())); },
        [&] { machine.StreamEnded(WatchEnd::OfStream(absl::CancelledError("left"))); },
        [&] { machine.Drain(); },
        [&] { machine.GiveUp(status); },
        [&] { machine.GiveWay(status); },
        [&] { machine.Cut(); },
        [&] { machine.Cancelled(); },
        [&] {
          machine.EndIfSilent(std::chrono::seconds(1),
                              std::chrono::steady_clock::now() + std::chrono::hours(1));
        },
        [&] {
          const std::chrono::seconds limit(1);
          machine.EndIfPaused({.pause = limit, .write = limit},
                              std::chrono::steady_clock::now() + std::chrono::hours(1));
        }};
    events[random_.Below(events.size())]();
  }

  support::Random random_;
  ReachedStates& reached_;
  ScriptedWatch watch_;
  bool first_ = true;
  std::uint64_t number_ = 0;
};

TEST(WatchStates, RandomEventsReachLegalStatesOnly) {
  WatchDispatcher dispatcher;
  const auto broadcaster = std::make_shared<ResultBroadcaster>(
      dispatcher, ResultBroadcaster::Limits{.mailbox_bytes = kScriptedMaxBytes, .kept_bytes = 256});
  ReachedStates reached;
  for (std::uint64_t seed = 1; seed <= 20'000 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    WatchOrder(seed, broadcaster, reached).Run();
  }
  reached.ExpectAllRowsOf(MachineKind::kWatch);
}

}  // namespace
}  // namespace partiemc::server
