// `partiemc watch --record`: records a live stream that replays to the same bits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <regex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/program.h"
#include "client/recording/recording.h"

namespace partiemc::client {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

constexpr int kFrames = 40;

// A turning block of particles with all quantities of a recording.
RecordedFrame BlockFrame(int index, bool has_box = false) {
  RecordedFrame frame;
  frame.time = 0.1 * index;
  if (has_box) {  // The block crosses its corner. The length cannot be computed from its bounds.
    const double length = 40 + 0.1 * index;
    frame.box = RecordedBox{.low = {-5, -7 / 3., 0},
                            .length = {length, length / 3 + 20, 0},
                            .is_periodic = {true, true}};
  }
  const double angle = 0.02 * index;
  for (int k = 0; k < 400; ++k) {
    const double x = k % 20 - 9.5, y = static_cast<double>(k / 20) - 9.5;
    frame.positions.push_back(x * (1 - angle * angle / 2) - y * angle + 1e-9 * k);
    frame.positions.push_back(x * angle + y * (1 - angle * angle / 2));
    frame.ids.push_back(static_cast<std::uint64_t>(1000 - k));
    frame.volumes.push_back(1 + 0.001f * static_cast<float>(k % 7));
    frame.velocities.push_back(static_cast<float>(-y));
    frame.velocities.push_back(static_cast<float>(x));
  }
  ParticleAttribute& type = frame.attributes.emplace_back();
  type.name = "type";
  for (int k = 0; k < 400; ++k) type.values.push_back(k % 20 < 8 ? 1.0f : 2.0f);
  return frame;
}

void WriteRecording(const std::string& path, bool has_boxes = false) {
  auto writer = RecordingWriter::Create(path, {.spacing = 1}, {.float64 = true});
  ASSERT_TRUE(writer.ok()) << writer.status();
  for (int k = 0; k < kFrames; ++k) ASSERT_TRUE((*writer)->Add(BlockFrame(k, has_boxes)).ok());
  ASSERT_TRUE((*writer)->Finish().ok());
}

// "rings digest, mesh digest, time" of every frame: the last columns.
std::vector<std::string> Digests(const std::string& statistics) {
  static const std::regex kLine(R"(.*,([0-9a-f]{16},[0-9a-f]{16}),.*)");
  std::istringstream lines(statistics);
  std::vector<std::string> digests;
  std::smatch match;
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_match(line, match, kLine)) digests.push_back(match[1]);
  }
  return digests;
}

// The words of the command `partiemc replay ...` in the last line of a watch's output, and `more`.
std::vector<std::string> ToldCommand(const std::string& out, const std::vector<std::string>& more) {
  std::istringstream line(out.substr(out.rfind("partiemc ") + 9));
  std::vector<std::string> words;
  for (std::string word; line >> word;) words.push_back(word);
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

class Record : public ::testing::Test {
 protected:
  void SetUp() override { WriteRecording(Path("made.pemc")); }

  std::string Path(const std::string& name) const { return folder_.Path(name); }

  // The running stream "block".
  std::vector<std::string> Producer(std::vector<std::string> flags) const {
    std::vector<std::string> command = {"replay", Path("made.pemc"), "--server", server_.address(),
                                        "--name", "block",           "--stats",  Path("made.csv")};
    command.insert(command.end(), flags.begin(), flags.end());
    return command;
  }

  // Watches as soon as the stream exists.
  Ran Watch(std::vector<std::string> flags) const {
    flags.insert(flags.begin(), {"watch", "block", "--server", server_.address()});
    Ran ran{.exit_code = 4};
    for (int k = 0; k < 100 && ran.exit_code == 4 && ran.out.empty(); ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      ran = RunPartiemc(flags);
    }
    return ran;
  }

  support::TemporaryFolder folder_;
  ServerProgram server_;
};

TEST_F(Record, ReplaysToTheSameBitsByTheFlagsThatItTells) {
  Program producer(PARTIEMC_PROGRAM,
                   Producer({"--rate", "20", "--echo-particles", "--fill", "conforming",
                             "--cell-size", "0.75", "--placement", "qef", "--clean", "off"}));
  const Ran ran = Watch({"--record", Path("seen.pemc")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_EQ(producer.Wait(), 0) << producer.Error();
  EXPECT_THAT(ran.out, Not(HasSubstr("lacks")));
  EXPECT_THAT(ran.out, HasSubstr("recorded: 40 frames; partiemc replay "));

  const Ran again = RunPartiemc(ToldCommand(ran.out, {"--stats", Path("again.csv")}));
  EXPECT_EQ(again.exit_code, 0) << again.error;
  const auto digests = Digests(Content(Path("made.csv")));
  EXPECT_THAT(digests, SizeIs(kFrames));
  EXPECT_EQ(Digests(Content(Path("again.csv"))), digests);
}

TEST_F(Record, TellsTheAttributesThatShapeTheMesh) {
  Program producer(PARTIEMC_PROGRAM, Producer({"--rate", "20", "--echo-particles", "--attributes",
                                               "type,velocity", "--attribute-tolerance", "0.001"}));
  const Ran ran = Watch({"--record", Path("seen file.pemc")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_EQ(producer.Wait(), 0) << producer.Error();
  EXPECT_THAT(ran.out, HasSubstr("seen file.pemc' --local"));
  EXPECT_THAT(ran.out, HasSubstr(" --attributes type,velocity\n"));
  std::filesystem::rename(Path("seen file.pemc"), Path("seen.pemc"));
  const Ran again =
      RunPartiemc({"replay", Path("seen.pemc"), "--local", "--stats", Path("again.csv"),
                   "--attributes", "type,velocity", "--attribute-tolerance", "0.001"});
  EXPECT_EQ(again.exit_code, 0) << again.error;
  EXPECT_EQ(Digests(Content(Path("again.csv"))), Digests(Content(Path("made.csv"))));
}

TEST_F(Record, TellsTheWallsOfTheStream) {
  const std::string tank = "-30,-40,30.5,-40,30.5,40,-30,40";
  Program producer(PARTIEMC_PROGRAM, Producer({"--rate", "20", "--echo-particles", "--wall", tank,
                                               "--wall", "-1,-60,1,-60"}));
  const Ran ran = Watch({"--record", Path("seen.pemc"), "--stats", Path("seen.csv")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_EQ(producer.Wait(), 0) << producer.Error();
  EXPECT_THAT(ran.out, HasSubstr(" --wall " + tank + " --wall -1,-60,1,-60\n"));
  EXPECT_THAT(Content(Path("seen.csv")), HasSubstr("wetted_length"));
  const Ran again = RunPartiemc(ToldCommand(ran.out, {"--stats", Path("again.csv")}));
  EXPECT_EQ(again.exit_code, 0) << again.error;
  EXPECT_EQ(Column(Content(Path("again.csv")), "rings_digest"),
            Column(Content(Path("made.csv")), "rings_digest"));
}

TEST_F(Record, HoldsTheBoxOfEachFrame) {
  WriteRecording(Path("made.pemc"), /*has_boxes=*/true);
  Program producer(PARTIEMC_PROGRAM,
                   Producer({"--rate", "20", "--echo-particles", "--periodic", "x,y"}));
  const Ran ran = Watch({"--record", Path("seen.pemc")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_EQ(producer.Wait(), 0) << producer.Error();
  const std::string made = Content(Path("made.csv"));
  EXPECT_THAT(Column(made, "polylines"), Each("1")) << "the block is whole";
  const Ran again = RunPartiemc(ToldCommand(ran.out, {"--stats", Path("again.csv")}));
  EXPECT_EQ(again.exit_code, 0) << again.error;
  EXPECT_EQ(Column(Content(Path("again.csv")), "rings_digest"), Column(made, "rings_digest"));
  const auto reader = RecordingReader::Open(Path("seen.pemc"), "");
  ASSERT_TRUE(reader.ok()) << reader.status();
  RecordedFrame seen;
  for (int k = 0; k < kFrames; ++k) {
    ASSERT_TRUE((*reader)->Next(seen).value());
    EXPECT_TRUE(seen.box == BlockFrame(k, true).box) << "frame " << k;
  }
}

TEST_F(Record, HoldsThePhasesOfTheStream) {
  Program producer(PARTIEMC_PROGRAM, Producer({"--rate", "20", "--echo-particles", "--phases",
                                               "type=1,2", "--fill", "none"}));
  const Ran ran = Watch({"--record", Path("seen.pemc")});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_EQ(producer.Wait(), 0) << producer.Error();
  EXPECT_THAT(ran.out, HasSubstr(" --phases type=1,2"));
  const Ran again = RunPartiemc(ToldCommand(ran.out, {"--stats", Path("again.csv")}));
  EXPECT_EQ(again.exit_code, 0) << again.error;
  const auto digests = Column(Content(Path("made.csv")), "rings_digest");
  EXPECT_THAT(digests, SizeIs(3 * kFrames));  // The outline and two phases.
  EXPECT_EQ(Column(Content(Path("again.csv")), "rings_digest"), digests);
}

TEST_F(Record, HoldsEverythingThatWasSent) {
  Program producer(PARTIEMC_PROGRAM,
                   Producer({"--rate", "20", "--echo-particles", "--attributes", "type"}));
  EXPECT_EQ(Watch({"--record", Path("seen.pemc"), "--quiet"}).exit_code, 0);
  EXPECT_EQ(producer.Wait(), 0);
  const auto reader = RecordingReader::Open(Path("seen.pemc"), "");
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_EQ((*reader)->header().spacing, 1);
  EXPECT_EQ((*reader)->header().title, "block");
  RecordedFrame seen;
  for (int k = 0; k < kFrames; ++k) {
    ASSERT_TRUE((*reader)->Next(seen).value());
    const RecordedFrame made = BlockFrame(k);
    EXPECT_EQ(seen.time, made.time);
    EXPECT_EQ(seen.positions, made.positions);
    EXPECT_EQ(seen.ids, made.ids);
    EXPECT_EQ(seen.volumes, made.volumes);
    EXPECT_EQ(seen.velocities, made.velocities);
    EXPECT_EQ(seen.attributes, made.attributes);
  }
  EXPECT_FALSE((*reader)->Next(seen).value());
}

TEST_F(Record, BegunInTheMiddleSaysThatAReplayDiffers) {
  Program producer(PARTIEMC_PROGRAM, Producer({"--rate", "20", "--echo-particles"}));
  EXPECT_EQ(Watch({"--from", "oldest", "--mode", "every", "--frames", "6"}).exit_code, 0);
  const Ran ran = Watch({"--record", Path("seen.pemc"), "--from", "5", "--frames", "3"});
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  EXPECT_THAT(ran.out, HasSubstr("recorded: 3 frames;"));
  EXPECT_THAT(ran.out, HasSubstr("begins with frame 5: a replay lacks"));
}

TEST_F(Record, WaitsForTheStreamToStart) {
  Program watch(PARTIEMC_PROGRAM, {"watch", "block", "--server", server_.address(), "--wait",
                                   "--record", Path("seen.pemc")});
  for (int k = 0; k < 1000 && watch.Running() && watch.Error().empty(); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_THAT(watch.Error(), HasSubstr("waiting for the stream to start: "));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // Long enough for two attempts.
  EXPECT_TRUE(watch.Running());
  Program producer(PARTIEMC_PROGRAM, Producer({"--rate", "20", "--echo-particles"}));
  EXPECT_EQ(watch.Wait(), 0) << watch.Error();
  EXPECT_EQ(producer.Wait(), 0) << producer.Error();
  EXPECT_THAT(watch.Out(), HasSubstr("recorded: 40 frames;"));
}

TEST_F(Record, WaitForEveryFrameBeginsWithTheFirst) {
  Program watch(PARTIEMC_PROGRAM, {"watch", "block", "--server", server_.address(), "--wait",
                                   "--mode", "every", "--stats", Path("seen.csv")});
  // After some searches the pause before the next one is long enough for several frames.
  std::this_thread::sleep_for(std::chrono::seconds(2));
  Program producer(PARTIEMC_PROGRAM, Producer({"--rate", "40"}));
  EXPECT_EQ(watch.Wait(), 0) << watch.Error();
  EXPECT_EQ(producer.Wait(), 0) << producer.Error();
  EXPECT_EQ(Digests(Content(Path("seen.csv"))), Digests(Content(Path("made.csv"))));
}

TEST_F(Record, WaitEndsByCtrlC) {
  Program watch(PARTIEMC_PROGRAM, {"watch", "block", "--server", server_.address(), "--wait"});
  for (int k = 0; k < 1000 && watch.Running() && watch.Error().empty(); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  watch.Signal(SIGINT);
  EXPECT_EQ(watch.Wait(), 130);
  EXPECT_EQ(LastLine(watch.Error()), "partiemc: interrupted");
}

TEST_F(Record, WaitSearchesLessAndLessOften) {
  Program watch(PARTIEMC_PROGRAM, {"watch", "block", "--server", server_.address(), "--wait"});
  std::this_thread::sleep_for(std::chrono::seconds(4));
  watch.Signal(SIGINT);
  EXPECT_EQ(watch.Wait(), 130);
  const std::string log = server_.Log();
  std::size_t searches = 0;
  for (auto at = log.find("watch refused"); at != log.npos;
       at = log.find("watch refused", at + 1)) {
    ++searches;
  }
  EXPECT_GE(searches, 3u);
  EXPECT_LE(searches, 11u);  // Twenty with a constant pause of 200 ms.
}

TEST_F(Record, WaitNeedsAServer) {
  EXPECT_EQ(RunPartiemc({"watch", "block", "--server", "unix:/nowhere.sock", "--wait"}).exit_code,
            4);
  EXPECT_EQ(RunPartiemc({"watch", "block", "--server", server_.address()}).exit_code, 4);
}

TEST_F(Record, OfAStreamThatDoesNotShowItsParticlesIsRefused) {
  Program producer(PARTIEMC_PROGRAM, Producer({"--rate", "20"}));
  const Ran ran = Watch({"--record", Path("seen.pemc")});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.error, HasSubstr("set this at the producer, not here"));
  for (const char* way :
       {"partiemc replay --echo-particles", "partiemc.connect(..., echo_particles=True)",
        "options.echo_particles = 1", "outputs.echo_particles"}) {
    EXPECT_THAT(ran.error, HasSubstr(way));
  }
  EXPECT_FALSE(std::filesystem::exists(Path("seen.pemc")));
}

}  // namespace
}  // namespace partiemc::client
