// All attacks at once beside two honest streams, in a cgroup of the size that the server prints,
// and a flood without tokens. A minute and ten seconds by default; on demand
//   attack_test --gtest_filter='Hostile*' --minutes 60 --flood-seconds 60 --slowdown 3
// one attack alone: --attack unknown-fields. The attackers share the processors with the server;
// with --first they cannot take processor time from it.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <deque>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "attack/attacked_server.h"
#include "attack/floods.h"
#include "attack/honest_stream.h"
#include "attack/hostile_clients.h"
#include "attack/memory_group.h"
#include "attack/options.h"
#include "attack/processor_share.h"
#include "support/temporary_folder.h"

namespace partiemc::attack {
namespace {

constexpr double kMostFloodMib = 32;
constexpr std::chrono::seconds kHostilePatience(90);

double Percentile99(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() * 99 / 100];
}

// Attackers during the lifetime of this object. They run only on idle processors, because real ones
// share none with the server.
class Attackers {
 public:
  Attackers(const std::string& address, const std::string& web, const std::string& only) {
    for (const Attack& attack : Attacks()) {
      if (!only.empty() && only != attack.name) continue;
      rounds_.emplace_back(attack.name, 0);
      threads_.emplace_back([this, &attack, &rounds = rounds_.back().second, address, web] {
        YieldProcessors();
        Hostility hostility{address, web,   kHostileToken, support::Random(GetOptions().seed),
                            stop_,   rounds};
        attack.run(hostility);
      });
    }
    EXPECT_FALSE(threads_.empty()) << "no attack " << only;
  }
  /// Waits until each attack has ended a round: on a busy machine, preparing the first one takes
  /// long.
  void WaitForFirstRounds(std::chrono::seconds patience) const {
    const auto end = std::chrono::steady_clock::now() + patience;
    const auto begun = [](const auto& attack) { return attack.second > 0; };
    while (!std::all_of(rounds_.begin(), rounds_.end(), begun) &&
           std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  ~Attackers() {
    stop_ = true;
    for (std::thread& thread : threads_) thread.join();
    for (const auto& [name, rounds] : rounds_) {
      std::printf("  %s: %lu rounds\n", name, static_cast<unsigned long>(rounds.load()));
      EXPECT_GT(rounds.load(), 0u) << name;
    }
  }

 private:
  std::atomic<bool> stop_ = false;
  std::deque<std::pair<const char*, std::atomic<std::uint64_t>>> rounds_;
  std::vector<std::thread> threads_;
};

class Hostile : public ::testing::Test {
 protected:
  double QuietP99(HonestStream& one, HonestStream& two, std::chrono::seconds time) {
    one.TakeLatencies();
    two.TakeLatencies();
    std::this_thread::sleep_for(time);
    auto all = one.TakeLatencies();
    const auto more = two.TakeLatencies();
    all.insert(all.end(), more.begin(), more.end());
    return Percentile99(all);
  }

  std::vector<std::string> Arguments(const std::string& web) const {
    return {"--memory-budget",
            "256MB",
            "--web",
            web,
            "--threads",
            "2",
            "--token-file",
            folder_.Write("tokens",
                          std::string(kHonestToken) + " honest\n" + kHostileToken + " hostile\n")};
  }

  const support::TemporaryFolder folder_;
  const std::string web_ = FreeAddress();
  const double planned_mib_ = PlannedMib(Arguments(web_));
  const MemoryGroup group_{static_cast<std::uint64_t>(planned_mib_) << 20};
  AttackedServer server_{Arguments(web_), group_.Around()};
};

TEST_F(Hostile, HonestStreamsAndMemoryBearIt) {
  const Options& options = GetOptions();
  const std::chrono::seconds all(options.seconds),
      quiet = std::max(all / 9, std::chrono::seconds(5));
  HonestStream one(server_.address(), kHonestToken, 1), two(server_.address(), kHonestToken, 2);
  std::this_thread::sleep_for(std::chrono::seconds(1));  // Warms up.
  const double undisturbed = QuietP99(one, two, quiet);
  MemoryWatch memory(server_.process().process());
  double disturbed = 0;
  {
    std::unique_ptr<AttackedServer> other;
    const std::string web = options.elsewhere ? FreeAddress() : web_;
    if (options.elsewhere) other = std::make_unique<AttackedServer>(Arguments(web));
    const Attackers attackers((other ? *other : server_).address(), web, options.attack);
    disturbed = QuietP99(one, two, all - quiet);
    attackers.WaitForFirstRounds(kHostilePatience);
  }
  const double peak = memory.PeakMib();
  one.Stop();
  two.Stop();
  std::printf(
      "%s%s: at most %.1f MiB of %.0f planned, in a group: %s (%.0f MiB); p99 %.2f -> %.2f ms "
      "(%.2f times); %lu honest frames\n",
      options.attack.empty() ? "all" : options.attack.c_str(),
      options.first ? ", honest threads first" : "", peak, planned_mib_,
      group_.available() ? "yes" : "no", group_.PeakMib(), undisturbed, disturbed,
      disturbed / undisturbed, static_cast<unsigned long>(one.frames() + two.frames()));
  ASSERT_TRUE(server_.Lives()) << server_.Output();
  EXPECT_LE(peak, planned_mib_);
  EXPECT_LE(disturbed, options.slowdown * undisturbed);
  EXPECT_EQ(server_.GaugesNotAtZero(kHostilePatience), "");
  EXPECT_EQ(server_.Terminate(), 0) << server_.Output();
}

TEST_F(Hostile, AFloodWithoutATokenTakesLittle) {
  const Options& options = GetOptions();
  {
    HonestStream honest(server_.address(), kHonestToken, 3);  // Warms the server up.
    std::this_thread::sleep_for(std::chrono::seconds(2));
  }
  const double idle = server_.ResidentMib();
  MemoryWatch memory(server_.process().process());
  std::atomic<bool> stop = false;
  std::atomic<std::uint64_t> calls = 0;
  std::vector<std::thread> threads;
  for (std::uint64_t k = 0; k < 4; ++k) {
    threads.emplace_back([&, k] {
      if (options.first) YieldProcessors();
      Hostility hostility{
          server_.address(), web_, "", support::Random(options.seed + k), stop, calls};
      FloodWithoutToken(hostility, 10'000, 25);
    });
  }
  std::this_thread::sleep_for(std::chrono::seconds(options.flood_seconds));
  stop = true;
  for (std::thread& thread : threads) thread.join();
  const double peak = memory.PeakMib();
  std::printf("flood without a token: %lu calls in %lu s, %.1f -> at most %.1f MiB\n",
              static_cast<unsigned long>(calls.load()),
              static_cast<unsigned long>(options.flood_seconds), idle, peak);
  ASSERT_TRUE(server_.Lives()) << server_.Output();
  EXPECT_LE(peak - idle, kMostFloodMib);
  EXPECT_EQ(server_.GaugesNotAtZero(kHostilePatience), "");
  EXPECT_EQ(server_.Terminate(), 0) << server_.Output();
}

}  // namespace
}  // namespace partiemc::attack
