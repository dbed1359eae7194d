// A simulator of several processes, started by hand and by Open MPI; ranks and server are killed.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/program.h"
#include "service/server_process.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using client::Program;

std::vector<std::string> ExpectedLines(std::uint64_t frames) {
  std::vector<std::string> lines;
  for (const Digests& digests : LocalDigests(1, frames)) {
    lines.push_back(
        absl::StrFormat("%d %016x %016x", lines.size() + 1, digests.rings, digests.mesh));
  }
  return lines;
}

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::unique_ptr<Program> StartRank(const std::string& address, std::uint64_t frames, int pause_ms,
                                   std::uint32_t rank, std::uint32_t ranks) {
  return std::make_unique<Program>(
      PARTIEMC_RANK, std::vector<std::string>{address, absl::StrCat(frames), absl::StrCat(pause_ms),
                                              absl::StrCat(rank), absl::StrCat(ranks)});
}

// Starts all ranks, the last one first, so that part 0 comes last.
std::vector<std::unique_ptr<Program>> StartRanks(const std::string& address, std::uint64_t frames,
                                                 int pause_ms, std::uint32_t ranks) {
  std::vector<std::unique_ptr<Program>> programs(ranks);
  for (std::uint32_t rank = ranks; rank-- > 0;) {
    programs[rank] = StartRank(address, frames, pause_ms, rank, ranks);
  }
  return programs;
}

void WaitForLines(const Program& program, std::size_t lines) {
  EXPECT_TRUE(Eventually([&] { return LinesOf(program.Out()).size() >= lines; }));
}

TEST(Ranks, OfOneFourAndSixteenProcessesGetTheDigestsOfWholeFrames) {
  const ServingProcess server;
  for (const std::uint32_t ranks : {1u, 4u, 16u}) {
    const auto programs = StartRanks(server.address(), 12, 0, ranks);
    for (const auto& program : programs) EXPECT_EQ(program->Wait(), 0) << program->Error();
    EXPECT_EQ(LinesOf(programs[0]->Out()), ExpectedLines(12)) << ranks << " ranks";
    for (std::uint32_t rank = 1; rank < ranks; ++rank) EXPECT_EQ(programs[rank]->Out(), "");
  }
}

TEST(Ranks, OfOpenMpiGetTheDigestsOfWholeFrames) {
  const std::string mpirun = "/usr/bin/mpirun";
  if (!std::filesystem::exists(mpirun)) GTEST_SKIP() << "needs openmpi-bin";
  const ServingProcess server;
  for (const std::uint32_t ranks : {1u, 4u, 16u}) {
    Program job(mpirun, {"--allow-run-as-root", "--oversubscribe", "-n", absl::StrCat(ranks),
                         PARTIEMC_RANK, server.address(), "12", "0"});
    EXPECT_EQ(job.Wait(), 0) << job.Error();
    EXPECT_EQ(LinesOf(job.Out()), ExpectedLines(12)) << ranks << " ranks";
  }
}

TEST(Ranks, OneThatIsKilledCostsTheFramesThatLackItAndTheOthersGoOn) {
  const ServingProcess server;
  auto programs = StartRanks(server.address(), 8, 30, 4);
  WaitForLines(*programs[0], 3);
  programs[2]->Signal(SIGKILL);
  for (const std::uint32_t rank : {0u, 1u, 3u}) {
    EXPECT_EQ(programs[rank]->Wait(), 0) << programs[rank]->Error();
  }
  const auto lines = LinesOf(programs[0]->Out());
  ASSERT_EQ(lines.size(), 8u);
  const auto expected = ExpectedLines(8);
  std::size_t whole = 0;
  while (whole < 8 && lines[whole] == expected[whole]) ++whole;
  EXPECT_GE(whole, 3u);
  for (std::size_t k = whole; k < 8; ++k) {
    EXPECT_EQ(lines[k], absl::StrCat(k + 1, " PARTS_MISSING"));
  }
  for (const std::uint32_t rank : {1u, 3u}) EXPECT_EQ(programs[rank]->Out(), "");
}

TEST(Ranks, ComeBackAfterTheirServerWasKilledAndMissNothing) {
  auto server = std::make_unique<ServingProcess>();
  const std::string address = server->address();
  auto programs = StartRanks(address, 40, 20, 4);
  WaitForLines(*programs[0], 10);
  server->process().Signal(SIGKILL);
  server.reset();
  const ServerProcess second({"--address", address});
  for (const auto& program : programs) EXPECT_EQ(program->Wait(), 0) << program->Error();
  EXPECT_EQ(LinesOf(programs[0]->Out()), ExpectedLines(40));
  for (const std::uint32_t rank : {1u, 2u, 3u}) EXPECT_EQ(programs[rank]->Out(), "");
}

TEST(Ranks, OthersEndWithinTheirTimeWhenPartZeroIsKilled) {
  const ServingProcess server;
  auto programs = StartRanks(server.address(), 1000, 5, 2);
  WaitForLines(*programs[0], 3);
  programs[0]->Signal(SIGKILL);
  EXPECT_EQ(programs[1]->Wait(), 1);  // After ReconnectPolicy::give_up_after.
  EXPECT_NE(programs[1]->Error().find("could not continue"), std::string::npos)
      << programs[1]->Error();
}

}  // namespace
}  // namespace partiemc::server
