// Three replicas that share streams over NATS behind a proxy. Watchers use any of them, while they
// are updated or killed and NATS restarts.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"
#include "relay/nats_process.h"
#include "resume/fleet.h"
#include "resume/options.h"
#include "resume/watch_history.h"
#include "resume/workload.h"
#include "support/random.h"

namespace partiemc::resume {
namespace {

using std::chrono::milliseconds;

constexpr std::size_t kWatchedServers = 3, kProducers = 8, kWatchers = 16;
constexpr double kWatchedRate = 30;
// Limits from a disturbance to the next frame (tests/PROMISES.md).
constexpr double kMaxProducerGapMs = 1000, kMaxWatcherGapMs = 2000;

double Milliseconds(Clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

// Disturbances and their times.
struct Disturbances {
  std::vector<Clock::time_point> at;

  void Now() { at.push_back(Clock::now()); }
  // Time from the last disturbance before `told` to `until`; 0 if there is none.
  double MsUntil(Clock::time_point told, Clock::time_point until) const {
    const auto after = std::ranges::upper_bound(at, told);
    return after == at.begin() ? 0 : Milliseconds(until - *(after - 1));
  }
};

double Percentile(std::vector<double> values, double part) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(part * static_cast<double>(values.size())))];
}

class WatchAnywhere : public testing::TestWithParam<Route> {
 protected:
  WatchAnywhere() : fleet_(kWatchedServers, {"--nats", nats_.url()}) {
    for (std::size_t k = 0; k < kProducers; ++k) {
      workloads_.push_back(k % 2 == 0 ? DamBreak() : k == 1 ? Merge() : Leap());
      workloads_.back().name += "-" + std::to_string(k);
    }
  }

  // Eight producers and sixteen watchers run while `disturb` runs; checks their histories.
  void Run(const char* what, const std::function<void(Disturbances&)>& disturb) {
    const ProxyProcess proxy(GetParam(), fleet_.addresses());
    std::atomic<bool> over = false;
    std::vector<std::unique_ptr<client::FrameStream>> streams;
    std::vector<History> histories(kProducers);
    std::vector<WatchHistory> seen(kWatchers);
    std::vector<std::thread> threads;
    for (const Workload& workload : workloads_) {
      client::StreamOptions options{.name = workload.name, .parameters = workload.parameters};
      options.connect_timeout = kGrace;
      options.reconnect.announce = true;
      auto stream = client::Stream::Open(proxy.address(), options);
      ASSERT_TRUE(stream.ok()) << stream.status();
      streams.push_back(*std::move(stream));
    }
    std::vector<std::size_t> windows;
    for (std::size_t k = 0; k < kProducers; ++k) {
      windows.push_back(streams[k]->info().frames_in_flight);
      threads.emplace_back([&, k] {
        histories[k] = RunThrough(*streams[k], workloads_[k], kWatchedRate,
                                  [&](std::uint64_t) -> bool { return over; });
      });
    }
    for (std::size_t k = 0; k < kWatchers; ++k) {
      threads.emplace_back([&, k] {
        const auto watcher = client::Watcher::Open(
            proxy.address(), workloads_[k % kProducers].name,
            {.mode = k < kProducers ? client::WatchMode::kLatest : client::WatchMode::kEvery,
             .credits = 4});
        seen[k].end = watcher.status();
        if (watcher.ok()) seen[k] = WatchAll(**watcher);
      });
    }
    std::this_thread::sleep_for(milliseconds(500));
    Disturbances disturbances;
    disturb(disturbances);
    over = true;
    for (std::thread& thread : threads) thread.join();
    for (std::size_t k = 0; k < kProducers; ++k) {
      const History undisturbed = RunUndisturbed(workloads_[k], histories[k].sent);
      ExpectGuarantees(histories[k], undisturbed, windows[k], workloads_[k].name);
      for (const std::size_t w : {k, k + kProducers}) {
        EXPECT_TRUE(seen[w].end.ok()) << seen[w].end;
        EXPECT_EQ(seen[w].reason, "FINISHED");
        EXPECT_TRUE(Rising(seen[w])) << "watcher " << w;
        EXPECT_TRUE(Accounted(seen[w], histories[k].sent)) << "watcher " << w;
        EXPECT_TRUE(Identical(seen[w], undisturbed)) << "watcher " << w;
      }
    }
    Judge(what, disturbances, histories, seen);
  }

  // Prints the figures and checks the gaps: 99 of 100 within the limits, or within the machine's
  // own delays.
  static void Judge(const char* what, const Disturbances& disturbances,
                    const std::vector<History>& histories, const std::vector<WatchHistory>& seen) {
    std::vector<double> producers, watchers;
    double pause = 0;
    std::uint64_t answers = 0, frames = 0, dropped = 0, gaps = 0;
    for (const History& history : histories) {
      answers += history.answers.size();
      for (const auto told : history.reconnections) {
        const auto answer = std::ranges::find_if(history.answers,
                                                 [&](const Answer& one) { return one.at >= told; });
        if (answer != history.answers.end())
          producers.push_back(disturbances.MsUntil(told, answer->at));
      }
      for (std::size_t k = 1; k < history.answers.size(); ++k) {
        const auto from = history.answers[k - 1].at, to = history.answers[k].at;
        const bool is_disturbed = std::ranges::any_of(
            history.reconnections, [&](auto told) { return from <= told && told <= to; });
        if (!is_disturbed) pause = std::max(pause, Milliseconds(to - from));
      }
    }
    for (const WatchHistory& one : seen) {
      frames += one.seen.size();
      for (std::size_t k = 0; k < one.seen.size(); ++k) {
        dropped += one.seen[k].dropped;
        gaps += one.seen[k].gap;
        // The gap begins with the previous frame.
        if (!one.seen[k].rejoined || k == 0) continue;
        watchers.push_back(std::min(Milliseconds(one.seen[k].at - one.seen[k - 1].at),
                                    disturbances.MsUntil(one.seen[k].at, one.seen[k].at)));
      }
    }
    const auto n = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
    std::printf(
        "%s, %s: %zu disturbances; %llu answers, %zu producers back after p50 %.0f, p99 %.0f, most "
        "%.0f ms; %llu frames watched, %llu dropped, %llu in gaps, %zu watchers back after p50 "
        "%.0f, p99 %.0f, most %.0f ms; longest pause otherwise %.0f ms\n",
        RouteName(GetParam()).c_str(), what, disturbances.at.size(), n(answers), producers.size(),
        Percentile(producers, .5), Percentile(producers, .99), Percentile(producers, 1), n(frames),
        n(dropped), n(gaps), watchers.size(), Percentile(watchers, .5), Percentile(watchers, .99),
        Percentile(watchers, 1), pause);
    EXPECT_FALSE(producers.empty());
    EXPECT_FALSE(watchers.empty());
    if (GetOptions().time_limits == 0) return;
    EXPECT_LE(Percentile(producers, .99), kMaxProducerGapMs + pause);
    EXPECT_LE(Percentile(watchers, .99), kMaxWatcherGapMs + pause);
  }

  server::NatsProcess nats_;
  Fleet fleet_;
  std::vector<Workload> workloads_;
};

INSTANTIATE_TEST_SUITE_P(Behind, WatchAnywhere, testing::Values(Route::kHaproxy, Route::kNginx),
                         [](const auto& test) { return RouteName(test.param); });

TEST_P(WatchAnywhere, RollingUpdatesAreSeenByNobody) {
  Run("updates", [&](Disturbances& disturbances) {
    for (std::uint64_t k = 0; k < kWatchedServers * GetOptions().updates; ++k) {
      std::this_thread::sleep_for(milliseconds(400));
      disturbances.Now();
      EXPECT_EQ(fleet_.TerminateAndRestart(k % kWatchedServers, kGrace), std::optional(0));
    }
  });
}

TEST_P(WatchAnywhere, KillsAndABusThatGoesAreSeenInNoFrame) {
  support::Random random(GetOptions().seed);
  Run("kills", [&](Disturbances& disturbances) {
    for (std::uint64_t k = 0; k < GetOptions().kills; ++k) {
      std::this_thread::sleep_for(milliseconds(static_cast<int>(random.Uniform(400, 800))));
      if (k % 3 == 2) {
        nats_.Stop();
        std::this_thread::sleep_for(milliseconds(300));
        disturbances.Now();
        nats_.Start();
      } else {
        disturbances.Now();
        fleet_.KillAndRestart(random.Below(kWatchedServers));
      }
    }
  });
}

}  // namespace
}  // namespace partiemc::resume
