// Frames of the maximum size, in more streams than the server has memory for: whole, in parts, and
// from idle connections. The server stays within the memory that it prints.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "attack/attacked_server.h"
#include "attack/memory_group.h"
#include "attack/sender.h"
#include "support/temporary_folder.h"

namespace partiemc::attack {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kLargeFramesPatience(120);
// Codes that clients treat as a lost connection.
constexpr int kCancelled = 1, kUnavailable = 14;
constexpr char kToken[] = "large-frames-0123456789", kOther[] = "another-0123456789abcde";

// A server with 256 MB for frames, in a cgroup of the printed size, if cgroups can be created.
class LargeFrames : public ::testing::Test {
 protected:
  void Serve(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"--memory-budget", "256MB", "--threads", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    planned_ = PlannedMib(arguments);
    // The plan covers resident memory; the kernel's own memory for the process is small.
    group_ = std::make_unique<MemoryGroup>(static_cast<std::uint64_t>(planned_) << 20);
    server_ = std::make_unique<AttackedServer>(arguments, group_->Around());
  }
  void TearDown() override {
    if (server_ == nullptr) return;
    ASSERT_TRUE(server_->Lives()) << "the kernel has ended it: " << server_->Output();
    const double peak = server_->PeakMib();
    std::printf("at most %.0f MiB of %.0f planned, in a group: %s (%.0f MiB)\n", peak, planned_,
                group_->available() ? "yes" : "no", group_->PeakMib());
    EXPECT_LE(peak, planned_);
    EXPECT_EQ(server_->GaugesNotAtZero(kLargeFramesPatience), "");
    EXPECT_EQ(server_->Terminate(), 0) << server_->Output();
  }

  const std::string& address() const { return server_->address(); }

  // Opens streams, waits for `pause`, and lets each send these frames at the same time, each after
  // the previous answer. A lost stream restarts, as in clients. Returns the number of streams that
  // ended well.
  int SendFromAll(int streams, const std::vector<std::string>& frames,
                  milliseconds pause = milliseconds(0)) {
    std::vector<std::unique_ptr<Sender>> senders;
    for (int k = 0; k < streams; ++k) {
      senders.push_back(std::make_unique<Sender>(address()));
      EXPECT_TRUE(senders.back()->Open()) << "stream " << k;
    }
    std::this_thread::sleep_for(pause);
    std::atomic<int> ended_well = 0, lost = 0;
    std::vector<std::thread> threads;
    for (auto& sender : senders) {
      threads.emplace_back([&] {
        constexpr int kMostAttempts = 50;
        for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
          if (attempt > 0) {
            ++lost;
            std::this_thread::sleep_for(milliseconds(20 * std::min(attempt, 10)));
            sender = std::make_unique<Sender>(address());
            if (!sender->Open()) continue;
          }
          const int status = Run(*sender, frames);
          if (status == 0) ++ended_well;
          if (status != kUnavailable && status != kCancelled) return;
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    std::printf("%d streams, %d lost and begun again\n", streams, lost.load());
    return ended_well;
  }

  static int Run(Sender& sender, const std::vector<std::string>& frames) {
    for (std::size_t k = 0; k < frames.size(); ++k) {
      if (!sender.Send(frames[k], k + 1 == frames.size()) || !sender.IsAnswered()) break;
    }
    return sender.End();
  }

  double planned_ = 0;
  std::unique_ptr<MemoryGroup> group_;
  std::unique_ptr<AttackedServer> server_;
};

TEST_F(LargeFrames, OneOfEachStreamIsAnsweredWithinThePlan) {
  Serve();
  EXPECT_EQ(SendFromAll(31, {SquareFrame(1, 400, kLarge)}), 31);
}

TEST_F(LargeFrames, AreComputedWithinThePlan) {
  Serve();
  EXPECT_EQ(SendFromAll(8, {SquareFrame(1, 2'000, kLarge)}), 8);
}

TEST_F(LargeFrames, WithOneSlotStreamsAreReadFromInTurn) {
  Serve({"--streams-beyond-budget", "1"});
  EXPECT_EQ(SendFromAll(16, {SquareFrame(1, 400, kLarge), SquareFrame(2, 400, kLarge)}), 16);
}

TEST_F(LargeFrames, OfEverySizeAreAnsweredWithinThePlan) {
  Serve();
  std::vector<std::string> frames;
  for (const std::size_t bytes : {1'000u, 20'000'000u, 70'000u, 32'900'000u, 900'000u}) {
    frames.push_back(SquareFrame(frames.size() + 1, bytes < 100'000 ? 10 : 200, bytes));
  }
  EXPECT_EQ(SendFromAll(20, frames), 20);
}

// Nothing is reserved for streams that were idle while others waited. If all send at once, some end
// and reconnect; the server survives.
TEST_F(LargeFrames, OfIdleStreamsStayWithinThePlan) {
  Serve();
  EXPECT_EQ(SendFromAll(31, {SquareFrame(1, 400, kLarge)}, seconds(4)), 31);
}

TEST_F(LargeFrames, AfterSmallOnesStayWithinThePlan) {
  Serve();
  EXPECT_EQ(SendFromAll(31, {SquareFrame(1, 10, 1'000), SquareFrame(2, 400, kLarge)}), 31);
}

TEST_F(LargeFrames, IdleStreamsKeepNobodyFromBeingReadFrom) {
  Serve();
  std::vector<std::unique_ptr<Sender>> idle;
  for (int k = 0; k < 24; ++k) {
    idle.push_back(std::make_unique<Sender>(address()));
    ASSERT_TRUE(idle.back()->Open());
  }
  EXPECT_EQ(SendFromAll(7, {SquareFrame(1, 10, 1'000), SquareFrame(2, 400, kLarge)}), 7);
  const std::string frame = SquareFrame(1, 10, 1'000);
  for (auto& sender : idle) {
    EXPECT_TRUE(sender->Send(frame, true));
    EXPECT_EQ(sender->End(), 0);
  }
}

// Full bodies, particles without neighbours, and coordinates that are no places, as surfaces from
// several streams at once. Every frame is answered: with a surface or a refusal.
TEST_F(LargeFrames, OfSurfacesAreAnsweredWithinThePlan) {
  Serve();
  std::string nowhere = CubeFrame(3, 20, 1);
  for (std::size_t k = 100; k + 4 < nowhere.size(); k += 1'000) {
    nowhere.replace(k, 4, "\x7f\x7f\x7f\x7f");  // Numbers of 1e38.
  }
  const std::vector<std::string> frames = {CubeFrame(1, 60, 1), CubeFrame(2, 100, 50), nowhere,
                                           CubeFrame(4, 100, 1), CubeFrame(5, 16, 9)};
  std::atomic<int> ended_well = 0;
  std::vector<std::thread> threads;
  for (int stream = 0; stream < 3; ++stream) {
    threads.emplace_back([&] {
      Sender sender(address());
      if (sender.OpenSurfaces() && Run(sender, frames) == 0) ++ended_well;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(ended_well, 3);
}

// Part 0 of twelve streams sends nothing, and four other parts send full frames.
TEST_F(LargeFrames, PartsWithoutPart0StayWithinPlanAndQuotaUntilTheTimeout) {
  const support::TemporaryFolder folder;
  Serve({"--token-file", folder.Write("tokens", std::string(kToken) + " large bytes=64MB\n" +
                                                    kOther + " other\n")});
  std::vector<std::unique_ptr<Sender>> leaders, parts;
  for (int stream = 0; stream < 12; ++stream) {
    PartOf part{"ranks-" + std::to_string(stream), 0, 8, 2'000};
    leaders.push_back(std::make_unique<Sender>(address(), kToken));
    ASSERT_TRUE(leaders.back()->Open(part));
    for (part.part = 1; part.part <= 4; ++part.part) {
      parts.push_back(std::make_unique<Sender>(address(), kToken));
      ASSERT_TRUE(parts.back()->Open(part));
    }
  }
  const std::string frame = SquareFrame(1, 400, kLarge);
  std::atomic<bool> done = false;
  double most_held = 0;
  std::thread watch([&] {
    while (!done) {
      most_held = std::max(most_held, server_->Gauge("partiemc_memory_held_bytes"));
      std::this_thread::sleep_for(milliseconds(20));
    }
  });
  std::vector<std::thread> threads;
  for (auto& part : parts) {
    threads.emplace_back([&] { part->Send(frame, false, seconds(8)); });
  }
  std::this_thread::sleep_for(seconds(1));
  // Another caller is served at the same time.
  Sender other(address(), kOther);
  EXPECT_TRUE(other.Open());
  EXPECT_TRUE(other.Send(SquareFrame(1, 100, 1'000'000), true));
  EXPECT_EQ(other.End(), 0);
  for (std::thread& thread : threads) thread.join();
  done = true;
  watch.join();
  std::printf("parts: at most %.0f MB held\n", most_held / 1e6);
  // 64 MB, and a frame beyond it in each of two slots, and the other caller's frame.
  EXPECT_LE(most_held, 64e6 + 4 * 41.95e6 + 2e6);
  // All held parts are refused after two seconds.
  EXPECT_TRUE(parts.front()->IsAnswered());
  const auto give_up = std::chrono::steady_clock::now() + seconds(20);
  while (server_->Gauge("partiemc_memory_held_bytes") > 0) {
    ASSERT_LT(std::chrono::steady_clock::now(), give_up) << "held without an end";
    std::this_thread::sleep_for(milliseconds(50));
  }
}

}  // namespace
}  // namespace partiemc::attack
