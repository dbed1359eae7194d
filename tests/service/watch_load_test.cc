// The cost of watching for the producer, with separate processes: a server, a producer, readers, a
// watcher stopped by SIGSTOP, and one that never reads. Runs with and without watchers take turns.
// With `--beside` a third run measures two servers with a producer each at the same time; one of
// them is watched. Both see the same load of the machine, so their difference is the cost of being
// watched.
// Processor times are printed, not judged, because they depend on the machine. A short form by
// default; tests/PROMISES.md has the options of the long ones.
#include <gtest/gtest.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/program.h"
#include "service/load_recordings.h"
#include "service/process_clocks.h"
#include "service/server_process.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using client::Program;

struct Load {
  unsigned pairs = 1, readers = 18;
  bool beside = false;
  double seconds = 1;                 // Measured time of each run.
  double rate = 75, large_rate = 25;  // Frames per second; the dam break has 75.
  std::uint64_t particles = 20'000;   // In a large frame.
};
Load load;

// Limit of one watcher: the server's default --max-watcher-bytes.
constexpr std::uint64_t kMaxWatcherBytes = std::uint64_t{16} << 20;
// Growth of the server's memory besides the watchers' memory: connections of twenty processes, and
// fragmentation.
constexpr double kMaxOtherMib = 32;
// The default size of a stream's history.
constexpr double kHistoryMib = 64;
// Processor time is read after this number of frames; the median counts.
constexpr double kFramesPerLook = 5;
constexpr std::chrono::seconds kPatience(60);
// Time for watchers to join while the producer runs.
constexpr double kLeadSeconds = 20;
constexpr int kInterrupted = 130, kStreamEnded = 4;  // Exit codes of `partiemc`.

double Median(std::vector<double> values) {
  if (values.empty()) return NAN;
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

// Processor time per frame.
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

// The first group of each line that `pattern` matches.
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

struct Sequence {
  std::string path;
  double rate = 0;
  std::vector<std::string> flags;  // Flags of the replay.
};

// A server, and the producer of its only stream.
class Served {
 public:
  void StartProducer(const Sequence& sequence, const std::string& name);
  // The stream in ListStreams; without a name if it is not listed.
  v1::StreamSummary Listed();
  // Waits for `ready`; fails the test on a timeout.
  template <typename Ready>
  void WaitUntil(Ready ready, const char* what);
  Clocks Look();
  Clocks LookAfterMoreThan(std::uint64_t frames);
  void Interrupt();

  const std::string& address() const { return server_.address(); }
  const ServerProcess& process() const { return server_.process(); }

 private:
  ServingProcess server_{{"--threads", "1"}};
  std::unique_ptr<v1::ReconstructionService::Stub> stub_ = v1::ReconstructionService::NewStub(
      grpc::CreateChannel(server_.address(), grpc::InsecureChannelCredentials()));
  std::unique_ptr<Program> producer_;
};

void Served::StartProducer(const Sequence& sequence, const std::string& name) {
  std::vector<std::string> arguments = {
      "replay", sequence.path, "--server", address(),
      "--name", name,          "--rate",   std::to_string(sequence.rate),
      "--quiet"};
  arguments.insert(arguments.end(), sequence.flags.begin(), sequence.flags.end());
  producer_ = std::make_unique<Program>(PARTIEMC_PROGRAM, arguments);
  WaitUntil([&] { return Listed().stream_name() == name; }, "stream");
}

v1::StreamSummary Served::Listed() {
  TimedContext context;
  v1::ListStreamsResponse streams;
  EXPECT_TRUE(stub_->ListStreams(&context, {}, &streams).ok());
  return streams.streams_size() == 1 ? streams.streams(0) : v1::StreamSummary();
}

template <typename Ready>
void Served::WaitUntil(Ready ready, const char* what) {
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (!ready()) {
    ASSERT_TRUE(producer_->Running())
        << "the producer has ended before " << what << ": " << producer_->Error();
    ASSERT_LT(std::chrono::steady_clock::now(), give_up) << "no " << what;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

Clocks Served::Look() {
  const std::uint64_t frames = Listed().frames();
  return {.frames = frames,
          .producer = ProcessCpuMs(producer_->id()),
          .computing = ThreadsCpuMs(process().process(), "compute"),
          .server = ProcessCpuMs(process().process())};
}

Clocks Served::LookAfterMoreThan(std::uint64_t frames) {
  Clocks now;
  WaitUntil([&] { return (now = Look()).frames > frames; }, "frames");
  return now;
}

void Served::Interrupt() {
  producer_->Signal(SIGINT);
  EXPECT_EQ(producer_->Wait(), kInterrupted) << producer_->Error();
}

// The readers, the first of them stopped, and one watcher that never reads.
class Audience {
 public:
  Audience(Served& served, const std::string& name);
  // Requires that the stream has ended.
  void ExpectToldWhatWasCounted();
  // Requires that the stream has ended. Expects that each has held something, and at most its
  // limit. Returns the sum.
  std::uint64_t ExpectEachHeldWithinItsLimit() const;

 private:
  Served& served_;
  const std::string name_;
  std::vector<std::unique_ptr<Program>> watchers_;
};

Audience::Audience(Served& served, const std::string& name) : served_(served), name_(name) {
  const std::vector<std::string> watch = {"watch",          name,       "--server",
                                          served.address(), "--rejoin", "0"};
  for (unsigned k = 0; k < load.readers + 1; ++k) {
    watchers_.push_back(std::make_unique<Program>(PARTIEMC_PROGRAM, watch));
  }
  watchers_.push_back(std::make_unique<Program>(PARTIEMC_MUTE_WATCHER,
                                                std::vector<std::string>{served.address(), name}));
  served.WaitUntil([&] { return served.Listed().watchers() == watchers_.size(); }, "watchers");
  watchers_.front()->Signal(SIGSTOP);
}

void Audience::ExpectToldWhatWasCounted() {
  watchers_.front()->Signal(SIGCONT);
  watchers_.back()->Signal(SIGTERM);
  std::string told;
  for (const auto& watcher : watchers_) {
    EXPECT_EQ(watcher->Wait(), watcher == watchers_.back() ? 0 : kStreamEnded) << watcher->Error();
    told += watcher->Out();
  }
  const auto drops_told = NumbersIn(told, "dropped frames: ([0-9]+)");
  const std::string closed = "watch closed stream=[^ ]+ name=" + name_ + " ";
  std::vector<std::uint64_t> drops_counted;
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  do {  // The last line of the log may follow the end of its watch.
    drops_counted =
        NumbersIn(served_.process().Output(), closed + "frames=[0-9]+ dropped=([0-9]+)");
  } while (drops_counted.size() < watchers_.size() && std::chrono::steady_clock::now() < give_up);
  EXPECT_EQ(drops_told, drops_counted);
  EXPECT_EQ(drops_told.size(), watchers_.size());
  std::uint64_t sum = 0;
  for (const std::uint64_t drops : drops_told) sum += drops;
  std::printf("  %llu frames dropped, as told and as counted\n",
              static_cast<unsigned long long>(sum));
}

std::uint64_t Audience::ExpectEachHeldWithinItsLimit() const {
  const auto held =
      NumbersIn(served_.process().Output(),
                "watch closed stream=[^ ]+ name=" + name_ + " .*most_held_bytes=([0-9]+)");
  EXPECT_EQ(held.size(), watchers_.size());
  std::uint64_t sum = 0;
  for (const std::uint64_t bytes : held) {
    EXPECT_GT(bytes, 0u);
    EXPECT_LE(bytes, kMaxWatcherBytes);
    sum += bytes;
  }
  std::printf("  a watcher held at most %.3f MiB\n",
              held.empty() ? 0 : static_cast<double>(held.back()) / 1024 / 1024);
  return sum;
}

struct Run {
  Costs costs, beside;
  double before_mib = 0, most_mib = 0;
  double held_mib = 0;  // Sum of all watchers' maxima.
};

// Measures `served`, and at the same time `beside` if given, which has no watchers.
Run RunOnce(Served& served, Served* beside, const Sequence& sequence, const std::string& name,
            bool watched) {
  Run run{.before_mib = served.process().ResidentMib()};
  served.StartProducer(sequence, name);
  if (beside != nullptr) beside->StartProducer(sequence, name);
  std::optional<Audience> audience;
  if (watched && !::testing::Test::HasFatalFailure()) audience.emplace(served, name);
  if (::testing::Test::HasFatalFailure()) return run;

  Clocks before = served.Look();
  Clocks beside_before = beside != nullptr ? beside->Look() : Clocks();
  const auto frames = static_cast<std::uint64_t>(load.seconds * sequence.rate);
  for (const std::uint64_t end = before.frames + frames; before.frames < end;) {
    std::this_thread::sleep_for(std::chrono::duration<double>(kFramesPerLook / sequence.rate));
    const auto look = [](Served& at, Clocks& last, Costs& costs) {
      const Clocks now = at.LookAfterMoreThan(last.frames);
      now.AddSince(last, costs);
      last = now;
    };
    look(served, before, run.costs);
    if (beside != nullptr) look(*beside, beside_before, run.beside);
    if (::testing::Test::HasFatalFailure()) return run;
    run.most_mib = std::max(run.most_mib, served.process().ResidentMib());
  }
  served.Interrupt();
  if (beside != nullptr) beside->Interrupt();
  if (!audience) return run;
  audience->ExpectToldWhatWasCounted();
  run.held_mib = static_cast<double>(audience->ExpectEachHeldWithinItsLimit()) / 1024 / 1024;
  return run;
}

// The ratios of all pairs.
struct Ratios {
  std::vector<double> producer, computing, server;

  void Add(const char* otherwise, const Costs& other, const Costs& watched) {
    const auto add = [&](const char* what, std::vector<double>& ratios,
                         const std::vector<double>& others, const std::vector<double>& values) {
      const double o = Median(others), w = Median(values);
      ratios.push_back(w / o);
      std::printf("  processor time a frame, %s: %s %.3f ms, watched %.3f ms, ratio %.3f\n", what,
                  otherwise, o, w, w / o);
    };
    add("process of the producer", producer, other.producer, watched.producer);
    add("computing thread of the server", computing, other.computing, watched.computing);
    add("process of the server", server, other.server, watched.server);
  }
  void PrintMedians(const char* of) const {
    std::printf("medians of the ratios%s: producer %.3f, computing thread %.3f, server %.3f\n", of,
                Median(producer), Median(computing), Median(server));
  }
};

void ExpectNoWaits(const Served& served, std::size_t streams) {
  const auto waits = NumbersIn(served.process().Output(), "stream closed .* watch_waits=([0-9]+)");
  ASSERT_EQ(waits.size(), streams);
  EXPECT_EQ(waits.back(), 0u) << "frames of a producer waited for watchers";
}

void Compare(const Sequence& sequence) {
  Served served;
  std::optional<Served> other;
  if (load.beside) other.emplace();
  Ratios in_turns, beside;
  for (unsigned pair = 1; pair <= load.pairs; ++pair) {
    std::printf("pair %u\n", pair);
    const std::string number = std::to_string(pair);
    const Run alone = RunOnce(served, nullptr, sequence, "alone-" + number, false);
    const Run watched = RunOnce(served, nullptr, sequence, "watched-" + number, true);
    if (::testing::Test::HasFatalFailure()) return;
    in_turns.Add("alone", alone.costs, watched.costs);
    std::printf("  memory of the server: %.1f MiB, alone %.1f, watched %.1f MiB\n",
                alone.before_mib, alone.most_mib, watched.most_mib);
    EXPECT_LE(watched.most_mib - watched.before_mib, watched.held_mib + kHistoryMib + kMaxOtherMib);
    if (other) {  // In turns, because the memory layout of processes differs.
      Served* const two[] = {&served, &*other};
      const Run both =
          RunOnce(*two[pair % 2], two[1 - pair % 2], sequence, "beside-" + number, true);
      if (::testing::Test::HasFatalFailure()) return;
      beside.Add("beside", both.beside, both.costs);
    }
    std::fflush(stdout);
  }
  in_turns.PrintMedians("");
  if (other) beside.PrintMedians(" to a stream beside");
  ExpectNoWaits(served, (load.beside ? 3 : 2) * load.pairs);
  if (other) ExpectNoWaits(*other, load.pairs);
}

std::uint64_t Enough(double rate) {
  return static_cast<std::uint64_t>((kLeadSeconds + load.seconds) * rate);
}

TEST(WatchLoad, OfASmallDamBreakIsCountedAndBoundedAndDelaysNoFrame) {
  const support::TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(RecordDamBreak(folder.Path("dam.pemc"), Enough(load.rate)));
  Compare({.path = folder.Path("dam.pemc"), .rate = load.rate});
}

TEST(WatchLoad, OfLargeResultsIsCountedAndBoundedAndDelaysNoFrame) {
  const support::TemporaryFolder folder;
  ASSERT_NO_FATAL_FAILURE(
      RecordSquare(folder.Path("square.pemc"), load.particles, Enough(load.large_rate)));
  // The fill with the largest results: 40 bytes per particle.
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
  app.add_flag("--beside", load.beside, "Also compares with a stream that nobody watches, at once");
  app.add_option("--seconds", load.seconds, "Of each run, measured")->capture_default_str();
  app.add_option("--particles", load.particles, "Of a large frame")->capture_default_str();
  app.add_option("--rate", load.rate, "Small frames per second")->capture_default_str();
  app.add_option("--large-rate", load.large_rate, "Large frames per second")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return RUN_ALL_TESTS();
}
