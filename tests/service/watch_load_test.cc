// What watching costs who is watched, with a process for everybody: a server, a producer, readers,
// a watcher that is stopped by SIGSTOP, and one that never reads. Runs with and without watchers
// take turns. Processor times are printed and not judged: they are the machine's too. A short form
// by default; `--pairs 5 --seconds 6 --rate 25 --particles 200000 --large-rate 5` is what
// tests/PROMISES.md tells of.
#include <gtest/gtest.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/program.h"
#include "client/recording/recording.h"
#include "service/process_clocks.h"
#include "service/server_process.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using client::Program;

struct Load {
  unsigned pairs = 1, readers = 18;
  double seconds = 1;                 // Of each run that are measured.
  double rate = 75, large_rate = 25;  // Frames per second; the dam break has 75.
  std::uint64_t particles = 20'000;   // Of a large frame.
};
Load load;

constexpr double kMaxMibPerWatcher = 16;
// Processor time is looked at after about as many frames, and the median of these looks counts.
constexpr double kFramesPerLook = 5;
constexpr std::chrono::seconds kPatience(60);
// For watchers to come, while the producer goes on.
constexpr double kLeadSeconds = 20;
constexpr int kInterrupted = 130, kStreamEnded = 4;  // Exit codes of `partiemc`.

// The frames of the bundled dam break, over and over.
void RecordDamBreak(const std::string& path, std::uint64_t count) {
  const auto reader = client::RecordingReader::Open(client::kDamBreak, "");
  ASSERT_TRUE(reader.ok()) << reader.status();
  std::vector<client::RecordedFrame> frames(*(*reader)->FrameCount());
  for (client::RecordedFrame& frame : frames) ASSERT_TRUE((*reader)->Next(frame).value_or(false));
  const auto writer = client::RecordingWriter::Create(path, (*reader)->header(), {});
  ASSERT_TRUE(writer.ok()) << writer.status();
  for (std::uint64_t k = 0; k < count; ++k) {
    client::RecordedFrame& frame = frames[k % frames.size()];
    frame.time = 0.01 * static_cast<double>(k);
    ASSERT_TRUE((*writer)->Add(frame).ok());
  }
  ASSERT_TRUE((*writer)->Finish().ok());
}

// A square of fluid whose surface waves.
void RecordSquare(const std::string& path, std::uint64_t count) {
  const auto writer = client::RecordingWriter::Create(path, {.spacing = 1}, {});
  ASSERT_TRUE(writer.ok()) << writer.status();
  const auto side = static_cast<std::uint64_t>(std::sqrt(static_cast<double>(load.particles)));
  client::RecordedFrame frame;
  for (std::uint64_t k = 0; k < count; ++k) {
    frame.positions.clear();
    frame.time = 0.01 * static_cast<double>(k);
    for (std::uint64_t row = 0; row < side; ++row) {
      for (std::uint64_t column = 0; column < side; ++column) {
        const auto x = static_cast<double>(column), y = static_cast<double>(row);
        const double wave = std::sin(0.05 * x + 0.3 * static_cast<double>(k));
        frame.positions.insert(frame.positions.end(),
                               {x, std::round(64 * y * (1 + 0.02 * wave)) / 64});
      }
    }
    ASSERT_TRUE((*writer)->Add(frame).ok());
  }
  ASSERT_TRUE((*writer)->Finish().ok());
}

double Median(std::vector<double> values) {
  if (values.empty()) return NAN;
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

// Processor time of a frame.
struct Costs {
  std::vector<double> producer, computing, server;
};

struct Clocks {
  std::uint64_t frames = 0;
  double producer = 0, computing = 0, server = 0;

  void AddSince(const Clocks& before, Costs& costs) const {
    const auto count = static_cast<double>(frames - before.frames);
    costs.producer.push_back((producer - before.producer) / count);
    costs.computing.push_back((computing - before.computing) / count);
    costs.server.push_back((server - before.server) / count);
  }
};

// What each line that `pattern` matches has as its first group.
std::vector<std::uint64_t> NumbersIn(const std::string& text, const std::string& pattern) {
  std::vector<std::uint64_t> numbers;
  const std::regex regex(pattern);
  for (auto match = std::sregex_iterator(text.begin(), text.end(), regex);
       match != std::sregex_iterator(); ++match) {
    numbers.push_back(std::stoull((*match)[1]));
  }
  std::ranges::sort(numbers);
  return numbers;
}

class WatchLoad : public ::testing::Test {
 protected:
  struct Sequence {
    std::string path;
    double rate = 0;
    std::vector<std::string> flags;  // Of the replay.
  };

  void Compare(const Sequence& sequence);

 private:
  struct Run {
    Costs costs;
    double before_mib = 0, most_mib = 0;
  };

  Run RunOnce(const Sequence& sequence, const std::string& name, bool watched);
  void ExpectToldWhatWasCounted(std::vector<std::unique_ptr<Program>>& watchers,
                                const std::string& name);
  // The stream as ListStreams has it; without a name while it is not there.
  v1::StreamSummary Listed();
  Clocks Look(const Program& producer, std::uint64_t frames) const {
    return {.frames = frames,
            .producer = ProcessCpuMs(producer.id()),
            .computing = ThreadsCpuMs(server_.process().process(), "compute"),
            .server = ProcessCpuMs(server_.process().process())};
  }

  ServingProcess server_{{"--threads", "1"}};
  std::unique_ptr<v1::ReconstructionService::Stub> stub_ = v1::ReconstructionService::NewStub(
      grpc::CreateChannel(server_.address(), grpc::InsecureChannelCredentials()));
};

v1::StreamSummary WatchLoad::Listed() {
  grpc::ClientContext context;
  SetDeadline(context);
  v1::ListStreamsResponse streams;
  EXPECT_TRUE(stub_->ListStreams(&context, {}, &streams).ok());
  return streams.streams_size() == 1 ? streams.streams(0) : v1::StreamSummary();
}

WatchLoad::Run WatchLoad::RunOnce(const Sequence& sequence, const std::string& name, bool watched) {
  Run run{.before_mib = server_.process().ResidentMib()};
  std::vector<std::string> arguments = {
      "replay", sequence.path, "--server", server_.address(),
      "--name", name,          "--rate",   std::to_string(sequence.rate),
      "--quiet"};
  arguments.insert(arguments.end(), sequence.flags.begin(), sequence.flags.end());
  Program producer(PARTIEMC_PROGRAM, arguments);
  const auto wait_until = [&](auto ready, const char* what) {
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    while (!ready()) {
      ASSERT_TRUE(producer.Running())
          << "the producer has ended before " << what << ": " << producer.Error();
      ASSERT_LT(std::chrono::steady_clock::now(), give_up) << "no " << what;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  };
  wait_until([&] { return Listed().stream_name() == name; }, "stream");

  std::vector<std::unique_ptr<Program>> watchers;
  if (watched) {
    const std::vector<std::string> watch = {"watch",           name,       "--server",
                                            server_.address(), "--rejoin", "0"};
    for (unsigned k = 0; k < load.readers + 1; ++k) {
      watchers.push_back(std::make_unique<Program>(PARTIEMC_PROGRAM, watch));
    }
    watchers.push_back(std::make_unique<Program>(
        PARTIEMC_MUTE_WATCHER, std::vector<std::string>{server_.address(), name}));
    wait_until([&] { return Listed().watchers() == watchers.size(); }, "watchers");
    watchers.front()->Signal(SIGSTOP);
  }

  Clocks before = Look(producer, Listed().frames());
  const auto frames = static_cast<std::uint64_t>(load.seconds * sequence.rate);
  for (const std::uint64_t end = before.frames + frames; before.frames < end;) {
    std::this_thread::sleep_for(std::chrono::duration<double>(kFramesPerLook / sequence.rate));
    Clocks now;
    wait_until([&] { return (now = Look(producer, Listed().frames())).frames > before.frames; },
               "frames");
    if (HasFatalFailure()) return run;
    now.AddSince(before, run.costs);
    before = now;
    run.most_mib = std::max(run.most_mib, server_.process().ResidentMib());
  }
  producer.Signal(SIGINT);
  EXPECT_EQ(producer.Wait(), kInterrupted) << producer.Error();
  if (watched) ExpectToldWhatWasCounted(watchers, name);
  return run;
}

void WatchLoad::ExpectToldWhatWasCounted(std::vector<std::unique_ptr<Program>>& watchers,
                                         const std::string& name) {
  watchers.front()->Signal(SIGCONT);
  watchers.back()->Signal(SIGTERM);
  std::string told;
  for (const auto& watcher : watchers) {
    EXPECT_EQ(watcher->Wait(), watcher == watchers.back() ? 0 : kStreamEnded) << watcher->Error();
    told += watcher->Out();
  }
  const auto drops_told = NumbersIn(told, "dropped frames: ([0-9]+)");
  const std::string closed = "watch closed stream=[^ ]+ name=" + name + " ";
  std::vector<std::uint64_t> drops_counted;
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  do {  // The last line of the log may come a moment after its watcher has heard the end.
    drops_counted =
        NumbersIn(server_.process().Output(), closed + "frames=[0-9]+ dropped=([0-9]+)");
  } while (drops_counted.size() < watchers.size() && std::chrono::steady_clock::now() < give_up);
  EXPECT_EQ(drops_told, drops_counted);
  EXPECT_EQ(drops_told.size(), watchers.size());
  std::uint64_t sum = 0;
  for (const std::uint64_t drops : drops_told) sum += drops;
  std::printf("  %llu frames dropped, as told and as counted\n",
              static_cast<unsigned long long>(sum));
}

void WatchLoad::Compare(const Sequence& sequence) {
  const auto print = [](const char* what, const std::vector<double>& alone,
                        const std::vector<double>& watched) {
    const double a = Median(alone), w = Median(watched);
    std::printf("  processor time a frame, %s: alone %.3f ms, watched %.3f ms, ratio %.3f\n", what,
                a, w, w / a);
    return w / a;
  };
  std::vector<double> producer, computing, server;
  for (unsigned pair = 1; pair <= load.pairs; ++pair) {
    std::printf("pair %u\n", pair);
    const Run alone = RunOnce(sequence, "alone-" + std::to_string(pair), false);
    const Run watched = RunOnce(sequence, "watched-" + std::to_string(pair), true);
    if (HasFatalFailure()) return;
    producer.push_back(
        print("process of the producer", alone.costs.producer, watched.costs.producer));
    computing.push_back(
        print("computing thread of the server", alone.costs.computing, watched.costs.computing));
    server.push_back(print("process of the server", alone.costs.server, watched.costs.server));
    std::printf("  memory of the server: %.1f MiB, alone %.1f, watched %.1f MiB\n",
                alone.before_mib, alone.most_mib, watched.most_mib);
    std::fflush(stdout);
    EXPECT_LE(watched.most_mib - watched.before_mib, kMaxMibPerWatcher * (load.readers + 2));
  }
  std::printf("medians of the ratios: producer %.3f, computing thread %.3f, server %.3f\n",
              Median(producer), Median(computing), Median(server));
  const auto waits = NumbersIn(server_.process().Output(), "stream closed .* watch_waits=([0-9]+)");
  ASSERT_EQ(waits.size(), 2 * load.pairs);
  EXPECT_EQ(waits.back(), 0u) << "frames of a producer waited for watchers";
}

std::uint64_t Enough(double rate) {
  return static_cast<std::uint64_t>((kLeadSeconds + load.seconds) * rate);
}

TEST_F(WatchLoad, OfASmallDamBreakIsCountedAndBoundedAndDelaysNoFrame) {
  const client::TemporaryDirectory folder;
  ASSERT_NO_FATAL_FAILURE(RecordDamBreak(folder.Path("dam.pemc"), Enough(load.rate)));
  Compare({.path = folder.Path("dam.pemc"), .rate = load.rate});
}

TEST_F(WatchLoad, OfLargeResultsIsCountedAndBoundedAndDelaysNoFrame) {
  const client::TemporaryDirectory folder;
  ASSERT_NO_FATAL_FAILURE(RecordSquare(folder.Path("square.pemc"), Enough(load.large_rate)));
  // The fill with the largest results: 40 bytes a particle.
  Compare(
      {.path = folder.Path("square.pemc"), .rate = load.large_rate, .flags = {"--fill", "grid"}});
}

}  // namespace
}  // namespace partiemc::server

int main(int argc, char** argv) {
  using partiemc::server::load;
  ::testing::InitGoogleTest(&argc, argv);
  CLI::App app("What watching costs who is watched.");
  app.add_option("--pairs", load.pairs, "Runs alone, and as many watched")->capture_default_str();
  app.add_option("--readers", load.readers, "Watchers that read")->capture_default_str();
  app.add_option("--seconds", load.seconds, "Of each run, measured")->capture_default_str();
  app.add_option("--particles", load.particles, "Of a large frame")->capture_default_str();
  app.add_option("--rate", load.rate, "Small frames per second")->capture_default_str();
  app.add_option("--large-rate", load.large_rate, "Large frames per second")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return RUN_ALL_TESTS();
}
