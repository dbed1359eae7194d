// `partiemc replay` and `partiemc info` as programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <memory>
#include <regex>
#include <thread>
#include <tuple>

#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// Three small frames; the second is invalid.
void WriteFrames(const support::TemporaryFolder& directory) {
  for (int k = 0; k < 3; ++k) {
    std::ofstream file(directory.Path("frame_" + std::to_string(k) + ".csv"));
    file << "x,y\n";
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 6; ++column) file << column << "," << row << "\n";
    }
    if (k == 1) file << "nan,1\n";
  }
}

TEST(Replay, InProcessWritesEveryOutputAndATable) {
  const support::TemporaryFolder directory;
  const Ran ran =
      RunPartiemc({"replay", kDamBreak, "--local", "--frames", "10:13", "--check", "--output-dir",
                   directory.Path("frames"), "--format", "geojson,svg,obj,csv", "--stats",
                   directory.Path("stats.csv"), "--report", directory.Path("report.html")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(ran.out, AllOf(HasSubstr("3 frames"), HasSubstr("whole frame")));
  std::vector<std::string> expected;
  for (const char* frame : {"000010", "000011", "000012"}) {
    for (const char* extension : {"csv", "geojson", "obj", "svg"}) {
      expected.push_back(std::string("frames/frame_") + frame + "." + extension);
    }
  }
  expected.insert(expected.end(), {"report.html", "stats.csv"});
  EXPECT_EQ(FilesIn(directory.path()), expected);
  EXPECT_THAT(Column(Content(directory.Path("stats.csv")), "frame"), ElementsAre("10", "11", "12"));
}

// Each frame is either replayed under its own index or counted as skipped; the last one is always
// replayed.
TEST(Replay, ByTheLatestPolicyEveryFrameIsReplayedOrSkippedAndCounted) {
  for (const char* rate : {"max", "150"}) {
    const support::TemporaryFolder directory;
    const Ran ran =
        RunPartiemc({"replay", kDamBreak, "--local", "--threads", "1", "--policy", "latest",
                     "--rate", rate, "--check", "--stats", directory.Path("stats.csv")});
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
    std::vector<int> frames;
    for (const std::string& frame : Column(Content(directory.Path("stats.csv")), "frame")) {
      frames.push_back(std::stoi(frame));
    }
    EXPECT_TRUE(std::ranges::is_sorted(frames, std::ranges::less_equal()));
    ASSERT_FALSE(frames.empty());
    EXPECT_EQ(frames.back(), 74);
    const auto skipped = 75 - frames.size();
    if (skipped > 0) {
      EXPECT_THAT(ran.error, HasSubstr(std::to_string(skipped) + " frame"));
      EXPECT_THAT(ran.error, HasSubstr("skipped because newer ones arrived"));
    } else {
      EXPECT_EQ(ran.error.find("skipped"), std::string::npos);
    }
  }
}

// A body and a block that leaps over it, with the columns of `header`.
void WriteLeap(const support::TemporaryFolder& directory, const std::string& header,
               bool with_times) {
  for (int frame = 0; frame < 4; ++frame) {
    std::ofstream file(directory.Path("frame_" + std::to_string(frame) + ".csv"));
    file << header << "\n";
    for (int k = 0; k < 36; ++k) {
      file << k << "," << k % 6 << "," << k / 6 << ",0,0\n";
      file << 100 + k << "," << k % 6 << "," << k / 6 + 30 * (frame + 1) << ",0,60\n";
    }
  }
  if (!with_times) return;
  std::ofstream times(directory.Path("times.csv"));
  times << "frame,t\n0,0\n1,0.5\n2,1\n3,1.5\n";
}

// The frames of a replay at spacing 1 as GeoJSON, which contains identities.
std::vector<std::string> Outlines(const std::string& input, std::vector<std::string> where) {
  const support::TemporaryFolder output;
  where.insert(where.begin(), {"replay", input, "--quiet", "--spacing", "1", "--output-dir",
                               output.Path("frames"), "--format", "geojson"});
  const Ran ran = RunPartiemc(where);
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  std::vector<std::string> frames;
  for (const std::string& file : FilesIn(output.path())) {
    frames.push_back(Content(output.Path(file)));
  }
  EXPECT_THAT(frames, SizeIs(4));
  return frames;
}

TEST(Replay, RingsThatLeapKeepTheirIdentityByIdsOrByVelocitiesWithTimes) {
  const std::string kWithIds = "id,x,y,a,b", kWithVelocities = "a,x,y,vx,vy",
                    kWithNeither = "a,x,y,b,c";
  ServerProgram server;
  for (const auto& [header, with_times, is_kept] : {std::tuple(kWithIds, false, true),
                                                    {kWithVelocities, true, true},
                                                    {kWithVelocities, false, false},
                                                    {kWithNeither, true, false}}) {
    SCOPED_TRACE(header + (with_times ? " with times" : " without times"));
    const support::TemporaryFolder directory;
    WriteLeap(directory, header, with_times);
    const std::vector<std::string> local = Outlines(directory.path().string(), {"--local"});
    EXPECT_THAT(local.at(3), HasSubstr(is_kept ? "\"identity\":2" : "\"identity\":5"));
    EXPECT_EQ(Outlines(directory.path().string(), {"--server", server.address()}), local);
    // A recording of it has the same outlines, and times.
    const support::TemporaryFolder recordings;
    ASSERT_EQ(
        RunPartiemc({"convert", directory.path().string(), recordings.Path("a.pemc")}).exit_code,
        0);
    EXPECT_EQ(Outlines(recordings.Path("a.pemc"), {"--local"}), local);
  }
}

TEST(Replay, UsesTheSpacingThatTheRecordingKnowsUnlessToldOtherwise) {
  const support::TemporaryFolder directory;
  const auto area = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {
        "replay",   kDamBreak, "--local", "--quiet",
        "--frames", "0",       "--stats", directory.Path("stats.csv")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(RunPartiemc(arguments).exit_code, 0);
    return Column(Content(directory.Path("stats.csv")), "area").at(0);
  };
  const std::string recorded = area({});
  EXPECT_EQ(recorded, area({"--spacing", "0.0303"}));
  EXPECT_NE(recorded, area({"--spacing", "0.06"}));
  EXPECT_NEAR(std::stod(recorded), 2278 * 0.0303 * 0.0303, 0.003 * 2.0914);
}

TEST(Replay, ThroughAServerGivesTheBitsOfInProcess) {
  const ServerProgram server;
  ASSERT_THAT(server.address(), Not(IsEmpty()));
  const support::TemporaryFolder directory;
  for (const char* placement : {"marching-squares", "farthest-particle", "virtual-plane"}) {
    const Ran remote =
        RunPartiemc({"replay", kDamBreak, "--server", server.address(), "--quiet", "--placement",
                     placement, "--stats", directory.Path("remote.csv")});
    EXPECT_EQ(remote.exit_code, 0) << remote.error;
    for (const char* threads : {"1", "3"}) {
      const Ran local =
          RunPartiemc({"replay", kDamBreak, "--local", "--threads", threads, "--quiet",
                       "--placement", placement, "--stats", directory.Path("local.csv")});
      EXPECT_EQ(local.exit_code, 0) << local.error;
      for (const char* column : {"area", "rings_digest", "mesh_digest"}) {
        const auto values = Column(Content(directory.Path("remote.csv")), column);
        EXPECT_THAT(values, SizeIs(75));
        EXPECT_EQ(values, Column(Content(directory.Path("local.csv")), column));
      }
    }
  }
}

TEST(Replay, AFrameThatIsRefusedIsToldAndTheOthersGoOn) {
  const support::TemporaryFolder input, output;
  WriteFrames(input);
  const ServerProgram server;
  for (const std::vector<std::string>& where :
       {std::vector<std::string>{"--local"}, {"--server", server.address()}}) {
    std::vector<std::string> arguments = {"replay",  input.path().string(),   "--spacing", "1",
                                          "--stats", output.Path("stats.csv")};
    arguments.insert(arguments.end(), where.begin(), where.end());
    const Ran ran = RunPartiemc(arguments);
    EXPECT_EQ(ran.exit_code, 3);
    EXPECT_THAT(ran.error, AllOf(HasSubstr("frame_1.csv"), HasSubstr("refused"), HasSubstr("nan")));
    EXPECT_THAT(Column(Content(output.Path("stats.csv")), "frame"), ElementsAre("0", "2"));
    arguments.push_back("--keep-going");
    EXPECT_EQ(RunPartiemc(arguments).exit_code, 0);
  }
}

TEST(Replay, WarnsOfDoubtsAndTellsWhatHelps) {
  const support::TemporaryFolder directory;
  for (const char* frame : {"frame_0.csv", "frame_1.csv"}) {
    std::ofstream(directory.Path(frame)) << "x,y\n0,0\n300,400\n";
  }
  const std::string input = directory.path().string();
  const Ran guessed = RunPartiemc({"replay", input, "--local"});
  EXPECT_EQ(guessed.exit_code, 0) << guessed.error;
  EXPECT_THAT(guessed.error, HasSubstr("doubt in 2 of 2 frames: spacing-provisional: "));
  EXPECT_THAT(guessed.error, HasSubstr("give the spacing"));
  const Ran given = RunPartiemc({"replay", input, "--local", "--spacing", "1"});
  EXPECT_EQ(given.error.find("doubt"), std::string::npos) << given.error;
}

TEST(Replay, QuietSaysNothing) {
  const Ran ran = RunPartiemc({"replay", kDamBreak, "--local", "--quiet", "--frames", "0:5"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_THAT(ran.out, IsEmpty());
  EXPECT_THAT(ran.error, IsEmpty());
}

TEST(Replay, ARecordingThatWasCutOffIsReplayedAsFarAsItGoes) {
  const support::TemporaryFolder directory;
  const std::string whole = Content(kDamBreak);
  std::ofstream(directory.Path("cut.pemc"), std::ios::binary) << whole.substr(0, whole.size() / 2);
  const Ran ran = RunPartiemc({"replay", directory.Path("cut.pemc"), "--local"});
  EXPECT_EQ(ran.exit_code, 0);
  EXPECT_THAT(ran.error, HasSubstr("truncated after"));
}

// Expects the frames before the end, whose reason is `why`: a row of statistics and a frame of the
// report for each written file.
void ExpectKept(const support::TemporaryFolder& directory, const std::string& why) {
  const std::string report = Content(directory.Path("report.html"));
  EXPECT_THAT(report, AllOf(HasSubstr("ended early: " + why), HasSubstr("</html>")));
  std::size_t frames_in_report = 0;
  const std::string mark = "class=\"frame-numbers\">";
  for (auto at = report.find(mark); at != report.npos; at = report.find(mark, at + 1)) {
    ++frames_in_report;
  }
  std::vector<std::string> expected;
  const auto frames = Column(Content(directory.Path("stats.csv")), "frame");
  EXPECT_GE(frames.size(), 1u);
  EXPECT_EQ(frames_in_report, frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) EXPECT_EQ(frames[k], std::to_string(k));
  for (const std::string& file : FilesIn(directory.path())) {
    EXPECT_EQ(file.find(".part"), file.npos) << file;  // No partial file.
  }
}

TEST(Replay, ADamagedRecordingIsExitCodeThreeAndKeepsWhatCameBefore) {
  const support::TemporaryFolder input, directory;
  std::string bytes = Content(kDamBreak);
  bytes[bytes.size() / 2] = static_cast<char>(~bytes[bytes.size() / 2]);
  std::ofstream(input.Path("damaged.pemc"), std::ios::binary) << bytes;
  const Ran ran =
      RunPartiemc({"replay", input.Path("damaged.pemc"), "--local", "--quiet", "--stats",
                   directory.Path("stats.csv"), "--report", directory.Path("report.html")});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_THAT(ran.error, HasSubstr("damaged after"));
  EXPECT_EQ(std::ranges::count(ran.error, '\n'), 1) << ran.error;
  EXPECT_THAT(FilesIn(directory.path()), ElementsAre("report.html", "stats.csv"));
  ExpectKept(directory, "the input could not be read further");
}

TEST(Replay, ARangeWithoutFramesIsExitCodeThree) {
  const Ran ran = RunPartiemc({"replay", kDamBreak, "--local", "--frames", "200:300"});
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_THAT(ran.error, HasSubstr("no frame"));
}

TEST(Replay, APlaceThatCannotBeWrittenIsKnownBeforeTheWork) {
  const Ran ran = RunPartiemc(
      {"replay", kDamBreak, "--local", "--report", "/nonexistent/directory/report.html"});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.error, HasSubstr("/nonexistent/directory/report.html"));
}

// A running replay into `directory` with two finished frames.
std::unique_ptr<Program> BeginReplay(const support::TemporaryFolder& directory,
                                     std::vector<std::string> where) {
  where.insert(where.begin(),
               {"replay", kDamBreak, "--rate", "50", "--output-dir", directory.Path("frames"),
                "--stats", directory.Path("stats.csv"), "--report", directory.Path("report.html")});
  auto replay = std::make_unique<Program>(PARTIEMC_PROGRAM, where);
  const std::string second = directory.Path("frames/frame_000001.geojson");
  while (replay->Running() && !std::filesystem::exists(second)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return replay;
}

TEST(Replay, CtrlCEndsItWithWholeFramesTheirStatisticsAndTheirReport) {
  const ServerProgram server;
  for (const std::vector<std::string>& where :
       {std::vector<std::string>{"--local"}, {"--server", server.address()}}) {
    const support::TemporaryFolder directory;
    const auto replay = BeginReplay(directory, where);
    replay->Signal(SIGINT);
    EXPECT_EQ(replay->Wait(), 130);
    EXPECT_THAT(replay->Error(), HasSubstr("interrupted after"));
    EXPECT_THAT(replay->Out(), HasSubstr("ended early: interrupted"));
    ExpectKept(directory, "interrupted");
    for (const std::string& file : FilesIn(directory.path())) {
      if (file == "report.html" || file == "stats.csv") continue;
      EXPECT_THAT(file, ::testing::MatchesRegex("frames/frame_0000[0-9][0-9]\\.geojson"));
      EXPECT_TRUE(Content(directory.Path(file)).ends_with("}\n")) << file;
    }
  }
}

TEST(Replay, ALoopBeginsAnewUntilCtrlC) {
  const ServerProgram server;
  Program replay(PARTIEMC_PROGRAM, {"replay", kDamBreak, "--frames", "0:3", "--loop", "--name",
                                    "loop", "--server", server.address()});
  // Waits for the tenth frame.
  const std::regex ten(R"("frames": *\d\d)");
  while (replay.Running() &&
         !std::regex_search(RunPartiemc({"streams", "--json", "--server", server.address()}).out,
                            ten)) {
  }
  EXPECT_TRUE(replay.Running());
  replay.Signal(SIGINT);
  EXPECT_EQ(replay.Wait(), 130);
  EXPECT_THAT(replay.Error(), HasSubstr("interrupted after"));
  EXPECT_THAT(replay.Out(), IsEmpty());  // An endless replay prints no table.
}

// Checkpoints do not help without another server, which it looks for in vain.
TEST(Replay, AServerThatDiesIsExitCodeFourInOneLineAndKeepsWhatCameBefore) {
  for (const char* interval : {"0", "1"}) {
    const ServerProgram server;
    const support::TemporaryFolder directory;
    const auto replay =
        BeginReplay(directory, {"--server", server.address(), "--quiet", "--checkpoint-interval",
                                interval, "--deadline", "2", "--give-up-after", "2"});
    server.Signal(SIGKILL);
    EXPECT_EQ(replay->Wait(), 4);
    const std::string error = replay->Error();
    EXPECT_EQ(std::ranges::count(error, '\n'), 1) << error;
    EXPECT_THAT(error, HasSubstr(server.address()));
    ExpectKept(directory, "the server was lost");
  }
}

TEST(Replay, AFileOfAnyNameIsReplayedThroughAServer) {
  const ServerProgram server;
  const support::TemporaryFolder input;
  for (const std::string& name : {std::string("two\nlines\x1b[31m.csv"), std::string("\xff.csv"),
                                  std::string(60, 'x') + "\xc3\xa4.csv"}) {
    std::ofstream file(input.Path(name));
    file << "x,y\n";
    for (int k = 0; k < 36; ++k) file << k % 6 << "," << k / 6 << "\n";
    file.close();
    const Ran ran = RunPartiemc(
        {"replay", input.Path(name), "--server", server.address(), "--spacing", "1", "--quiet"});
    EXPECT_EQ(ran.exit_code, 0) << ran.error;
  }
}

TEST(Info, TellsVersionAndLimitsForPeopleAndPrograms) {
  const ServerProgram server;
  const Ran text = RunPartiemc({"info", "--server", server.address()});
  EXPECT_EQ(text.exit_code, 0) << text.error;
  EXPECT_THAT(text.out, AllOf(HasSubstr("version"), HasSubstr("virtual-plane")));
  const Ran json = RunPartiemc({"info", "--server", server.address(), "--json"});
  EXPECT_EQ(json.exit_code, 0) << json.error;
  EXPECT_THAT(json.out,
              AllOf(HasSubstr("\"max_particles_per_frame\":"), HasSubstr("\"placements\":[")));
  EXPECT_EQ(std::ranges::count(json.out, '\n'), 1);
}

}  // namespace
}  // namespace partiemc::client
