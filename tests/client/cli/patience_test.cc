// `partiemc replay` while its server is stopped: it waits and reports it, or gives up after
// --give-up-after.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class StoppedServer : public testing::Test {
 protected:
  // A replay of 75 frames whose server is stopped after the second.
  std::unique_ptr<Program> ReplayAndStop(const std::string& give_up_after) {
    auto replay = std::make_unique<Program>(
        PARTIEMC_PROGRAM,
        std::vector<std::string>{"replay", kDamBreak, "--rate", "25", "--server", server_.address(),
                                 "--output-dir", directory_.Path("frames"), "--stats",
                                 directory_.Path("stats.csv"), "--give-up-after", give_up_after});
    WaitWhile(*replay, [&] {
      return !std::filesystem::exists(directory_.Path("frames/frame_000001.geojson"));
    });
    server_.Signal(SIGSTOP);
    return replay;
  }

  template <typename Condition>
  static void WaitWhile(Program& replay, Condition condition) {
    while (replay.Running() && condition()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

  const ServerProgram server_;
  const support::TemporaryFolder directory_;
};

TEST_F(StoppedServer, IsWaitedForWithALineOfProgress) {
  const auto replay = ReplayAndStop("100");
  WaitWhile(*replay, [&] { return replay->Error().find("trying again") == std::string::npos; });
  std::this_thread::sleep_for(std::chrono::seconds(3));  // Long enough for some attempts.
  EXPECT_TRUE(replay->Running());
  server_.Signal(SIGCONT);
  EXPECT_EQ(replay->Wait(), 0) << replay->Error();
  EXPECT_THAT(replay->Error(), HasSubstr("lost " + server_.address()));
  EXPECT_THAT(replay->Error(), HasSubstr("trying again: 0 of 100 s"));
  const std::string local = directory_.Path("local.csv");
  EXPECT_EQ(RunPartiemc({"replay", kDamBreak, "--local", "--stats", local}).exit_code, 0);
  EXPECT_EQ(Column(Content(directory_.Path("stats.csv")), "rings_digest"),
            Column(Content(local), "rings_digest"));
}

TEST_F(StoppedServer, IsGivenUpWithAnErrorInTheLastLine) {
  const auto replay = ReplayAndStop("1");
  EXPECT_EQ(replay->Wait(), 4);
  EXPECT_THAT(LastLine(replay->Error()), StartsWith("partiemc: the stream could not continue"));
  EXPECT_THAT(LastLine(replay->Error()), HasSubstr("1 s"));
}

}  // namespace
}  // namespace partiemc::client
