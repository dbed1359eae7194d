// A long-running server beside simulations: streams end and restart, watchers join and leave, read
// and do not read. Memory, files and threads must not grow. A minute by default; `--minutes 30`
// also checks the slope of the memory.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "service/server_process.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

struct Load {
  double minutes = 1;
  unsigned streams = 4, watchers = 4;
  double frames_per_second = 8;  // Rate of each stream.
};
Load load;

constexpr int kRows = 200, kColumns = 250;  // 50,000 particles.
constexpr std::size_t kFrames = 8;          // Distinct frames, repeated.
constexpr Seconds kWarmUp(15);
// Below this duration the slope is noise, and memory may vary by this amount instead.
constexpr double kMinutesForSlope = 10;
// Pools by the names of their threads, which start on demand.
// - gRPC: the two callback pools grow up to two threads per processor
//   (src/core/lib/iomgr/executor.cc), timers to one more than are busy at once (timer_manager.cc),
//   events to the number of waiting ones. Only the last shrinks, to one per processor.
// - The server: `compute`, with the threads that oneTBB starts, and `hand-over`.
struct Pool {
  std::string_view name;
  std::size_t per_processor, more;  // Its most threads.
};
constexpr std::array<Pool, 6> kPools = {{{"default-executo", 2, 1},
                                         {"resolver-execut", 2, 1},
                                         {"grpc_global_tim", 2, 1},
                                         {"event_engine", 2, 1},
                                         {"compute", 2, 1},
                                         {"hand-over", 0, 8}}};
constexpr double kMaxSlopeMibPerHour = 1, kMaxGrowthMib = 8;

std::shared_ptr<grpc::Channel> NewChannel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetMaxReceiveMessageSize(-1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

// A block of fluid with a wavy surface.
std::vector<v1::ReconstructRequest> Frames() {
  std::vector<v1::ReconstructRequest> frames(kFrames);
  for (std::size_t k = 0; k < kFrames; ++k) {
    std::vector<float> positions;
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        const float wave =
            static_cast<float>(std::sin(0.05 * column + 0.7 * static_cast<double>(k)));
        positions.push_back(static_cast<float>(column));
        positions.push_back(static_cast<float>(row) * (1.0f + 0.02f * wave));
      }
    }
    v1::ParticleFrame& frame = *frames[k].mutable_frame();
    frame.set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
    frame.set_positions(positions.data(), positions.size() * sizeof(float));
  }
  return frames;
}

std::string StreamName(unsigned stream) { return "soak-" + std::to_string(stream); }

// One stream of random length, with two frames in flight.
std::uint64_t Produce(const std::string& address, unsigned stream, std::mt19937& random,
                      std::vector<v1::ReconstructRequest>& frames, const std::atomic<bool>& stop) {
  StreamClient client(NewChannel(address));
  auto open = OpenRequest(StreamName(stream));
  open.mutable_open()->mutable_parameters()->set_spacing(1);
  EXPECT_TRUE(client.SendAndReceive(open).has_opened());
  const std::uint64_t length = 50 + random() % 400;
  const auto start = Clock::now();
  std::uint64_t received = 0;
  for (std::uint64_t i = 1; i <= length && !stop; ++i) {
    std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(Seconds(
                                              static_cast<double>(i) / load.frames_per_second)));
    v1::ReconstructRequest& request = frames[i % kFrames];
    request.mutable_frame()->set_sequence(i);
    if (!client.Send(request)) break;
    if (i > 1) received += client.Receive().has_frame() ? 1 : 0;
  }
  client.HalfClose();
  received += client.Receive().has_frame() ? 1 : 0;
  EXPECT_TRUE(client.Finish().ok());
  return received;
}

// One watch of a random stream: reads some frames, or spends some time without reading.
std::uint64_t Watch(const std::string& address, std::mt19937& random) {
  const auto stub = v1::ReconstructionService::NewStub(NewChannel(address));
  TimedContext context;
  const auto call = stub->WatchStream(&context);
  v1::WatchStreamRequest request;
  request.mutable_open()->set_stream_name(
      StreamName(static_cast<unsigned>(random() % load.streams)));
  request.mutable_open()->set_mode(random() % 2 == 0 ? v1::WATCH_MODE_LATEST
                                                     : v1::WATCH_MODE_EVERY);
  request.mutable_open()->set_credits(1 + static_cast<unsigned>(random() % 20));
  call->Write(request);
  std::uint64_t frames = 0;
  if (random() % 4 == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 1500));
  } else {
    v1::WatchStreamResponse response;
    const std::uint64_t wanted = 1 + random() % 40;
    while (frames < wanted && call->Read(&response)) {
      if (!response.has_frame()) continue;
      ++frames;
      request.mutable_credit()->set_frames(1);
      call->Write(request);
    }
  }
  context.TryCancel();
  call->Finish();
  return frames;
}

// The threads of all clients, during the lifetime of this object.
class Clients {
 public:
  explicit Clients(const std::string& address) {
    for (unsigned i = 0; i < load.streams; ++i) {
      threads_.emplace_back([this, address, i] {
        auto frames = Frames();
        std::mt19937 random(i);
        while (!stop_) frames_ += Produce(address, i, random, frames, stop_);
      });
    }
    for (unsigned i = 0; i < load.watchers; ++i) {
      threads_.emplace_back([this, address, i] {
        std::mt19937 random(100 + i);
        while (!stop_) {
          watched_ += Watch(address, random);
          ++watches_;
          std::this_thread::sleep_for(std::chrono::milliseconds(random() % 200));
        }
      });
    }
  }
  ~Clients() {
    stop_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  std::uint64_t frames() const { return frames_; }
  std::uint64_t watches() const { return watches_; }
  std::uint64_t watched() const { return watched_; }

 private:
  std::atomic<bool> stop_ = false;
  std::atomic<std::uint64_t> frames_ = 0, watches_ = 0, watched_ = 0;
  std::vector<std::thread> threads_;
};

struct Sample {
  double hours = 0, mib = 0;
};

// By least squares.
double SlopePerHour(const std::vector<Sample>& samples) {
  double hours = 0, mib = 0;
  for (const Sample& sample : samples) {
    hours += sample.hours / static_cast<double>(samples.size());
    mib += sample.mib / static_cast<double>(samples.size());
  }
  double product = 0, square = 0;
  for (const Sample& sample : samples) {
    product += (sample.hours - hours) * (sample.mib - mib);
    square += (sample.hours - hours) * (sample.hours - hours);
  }
  return product / square;
}

double Median(std::vector<Sample>::const_iterator begin, std::vector<Sample>::const_iterator end) {
  std::vector<double> values;
  for (auto i = begin; i != end; ++i) values.push_back(i->mib);
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

class Soak : public ::testing::Test {
 protected:
  struct Holds {
    std::size_t files = 0, other_threads = 0;
    std::array<std::size_t, kPools.size()> pool_threads = {};
  };

  Holds HoldsNow() const {
    const ServerProcess& process = server_.process();
    Holds holds{.files = process.OpenFileCount()};
    for (const std::string& name : process.ThreadNames()) {
      const auto pool = std::ranges::find(kPools, name, &Pool::name);
      ++(pool == kPools.end() ? holds.other_threads : holds.pool_threads[pool - kPools.begin()]);
    }
    return holds;
  }
  // Figures after all clients have disconnected, which the server may notice a moment later. A new
  // thread first has the name of the thread that started it.
  Holds WhenQuiet(std::size_t expected_files, std::size_t expected_threads) const {
    const auto give_up = Clock::now() + std::chrono::seconds(20);
    while (true) {
      const Holds holds = HoldsNow();
      const bool is_quiet =
          holds.files <= expected_files && holds.other_threads <= expected_threads;
      if (is_quiet || Clock::now() > give_up) return holds;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  void Spend(Seconds time) {
    std::this_thread::sleep_for(std::chrono::duration_cast<Clock::duration>(time));
  }

  // Small histories, which are full when the server is warm.
  ServingProcess server_{{"--log-level", "off", "--threads", "2", "--history-bytes", "1MB"}};
};

TEST_F(Soak, NothingGrows) {
  const Holds at_first = HoldsNow();
  {
    const Clients clients(server_.address());
    Spend(kWarmUp);
  }
  const Holds before = WhenQuiet(at_first.files, at_first.other_threads);

  const Seconds length(60 * load.minutes), settle = std::max(kWarmUp, length / 5);
  std::vector<Sample> samples;
  {
    const Clients clients(server_.address());
    const auto start = Clock::now();
    double next_line = 60;
    for (Seconds now(0); now < length; now = Clock::now() - start) {
      Spend(Seconds(1));
      const double mib = server_.process().ResidentMib();
      if (now >= settle) samples.push_back({now.count() / 3600, mib});
      if (now.count() < next_line) continue;
      std::printf("%4.0f min: %.1f MiB, %zu files, %zu threads, %lu frames, %lu watches\n",
                  next_line / 60, mib, server_.process().OpenFileCount(),
                  server_.process().ThreadCount(), static_cast<unsigned long>(clients.frames()),
                  static_cast<unsigned long>(clients.watches()));
      std::fflush(stdout);
      next_line += 60;
    }
    std::printf("%lu frames of %u streams, %lu watches with %lu frames\n",
                static_cast<unsigned long>(clients.frames()), load.streams,
                static_cast<unsigned long>(clients.watches()),
                static_cast<unsigned long>(clients.watched()));
    EXPECT_GT(clients.frames(), 0u);
  }
  const Holds after = WhenQuiet(before.files, before.other_threads);
  ASSERT_GE(samples.size(), 8u);
  const auto quarter = static_cast<std::ptrdiff_t>(samples.size() / 4);
  const double growth = Median(samples.end() - quarter, samples.end()) -
                        Median(samples.begin(), samples.begin() + quarter);
  std::printf("memory: slope %.2f MiB/h, growth %.2f MiB; files %zu -> %zu\n",
              SlopePerHour(samples), growth, before.files, after.files);
  std::printf("threads: %zu -> %zu;", before.other_threads, after.other_threads);
  for (std::size_t k = 0; k < kPools.size(); ++k) {
    std::printf(" %s %zu -> %zu", kPools[k].name.data(), before.pool_threads[k],
                after.pool_threads[k]);
  }
  std::printf("\n");
  EXPECT_LE(growth, kMaxGrowthMib);
  if (load.minutes >= kMinutesForSlope) {
    EXPECT_LE(SlopePerHour(samples), kMaxSlopeMibPerHour);
  }
  EXPECT_LE(after.files, before.files);
  EXPECT_LE(after.other_threads, before.other_threads);
  const std::size_t processors = std::max(1u, std::thread::hardware_concurrency());
  for (std::size_t k = 0; k < kPools.size(); ++k) {
    EXPECT_LE(after.pool_threads[k], kPools[k].per_processor * processors + kPools[k].more)
        << kPools[k].name;
  }
}

}  // namespace
}  // namespace partiemc::server

int main(int argc, char** argv) {
  using partiemc::server::load;
  ::testing::InitGoogleTest(&argc, argv);
  CLI::App app("Runs a server for long and looks whether it grows.");
  app.add_option("--minutes", load.minutes, "For how long")->capture_default_str();
  app.add_option("--streams", load.streams, "At once, of 50,000 particles")->capture_default_str();
  app.add_option("--watchers", load.watchers, "At once")->capture_default_str();
  app.add_option("--rate", load.frames_per_second, "Frames per second and stream")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return RUN_ALL_TESTS();
}
