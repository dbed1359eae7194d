// `partiemc replay --noise-filter` as a program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::HasSubstr;

// Frames of a disc of radius 6 whose particles shake.
void WriteFrames(const std::string& path, bool has_ids) {
  std::ofstream file(path);
  for (int frame = 0; frame < 4; ++frame) {
    std::string atoms;
    int count = 0;
    for (int i = -6; i <= 6; ++i) {
      for (int j = -6; j <= 6; ++j) {
        if (i * i + j * j > 36) continue;
        ++count;
        if (has_ids) atoms += std::to_string(count) + " ";
        atoms += std::to_string(i + .1 * ((count * 7 + frame * 3) % 5 - 2)) + " " +
                 std::to_string(j + .1 * ((count * 3 + frame * 2) % 5 - 2)) + "\n";
      }
    }
    file << "ITEM: TIMESTEP\n"
         << frame << "\nITEM: NUMBER OF ATOMS\n"
         << count << "\nITEM: BOX BOUNDS pp pp pp\n-10 10\n-10 10\n-1 1\nITEM: ATOMS "
         << (has_ids ? "id x y\n" : "x y\n") << atoms;
  }
}

std::vector<std::string> DigestsOf(const std::string& dump, std::vector<std::string> more) {
  const support::TemporaryFolder output;
  more.insert(more.begin(), {"replay", dump, "--spacing", "1", "--stats", output.Path("s.csv")});
  const Ran ran = RunPartiemc(more);
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  return Column(Content(output.Path("s.csv")), "rings_digest");
}

TEST(NoiseFilterReplay, ServersGiveTheBitsOfThisProcess) {
  const support::TemporaryFolder input;
  const std::string dump = input.Path("disc.lammpstrj");
  WriteFrames(dump, true);
  const auto plain = DigestsOf(dump, {"--local"});
  const auto filtered = DigestsOf(dump, {"--local", "--noise-filter", ".5", "--check"});
  ASSERT_EQ(filtered.size(), 4u);
  EXPECT_EQ(filtered[0], plain[0]);
  EXPECT_NE(filtered[1], plain[1]);
  EXPECT_EQ(DigestsOf(dump, {"--local", "--noise-filter", "1"}), plain);
  ServerProgram server;
  EXPECT_EQ(DigestsOf(dump, {"--server", server.address(), "--noise-filter", ".5"}), filtered);
}

TEST(NoiseFilterReplay, WrongWeightsAndMissingIdsAreRefused) {
  const support::TemporaryFolder input;
  const std::string dump = input.Path("disc.lammpstrj");
  WriteFrames(dump, false);
  const auto error_of = [&](const std::string& weight, int exit_code) {
    const Ran ran =
        RunPartiemc({"replay", dump, "--local", "--spacing", "1", "--noise-filter", weight});
    EXPECT_EQ(ran.exit_code, exit_code) << ran.error;
    return ran.error;
  };
  EXPECT_THAT(error_of("1.5", 2), HasSubstr("--noise-filter: 1.5; must be in (0, 1]"));
  EXPECT_THAT(error_of("0", 2), HasSubstr("--noise-filter"));
  EXPECT_THAT(error_of(".5", 3), HasSubstr("noise filter follows particles by their ids"));
}

}  // namespace
}  // namespace partiemc::client
