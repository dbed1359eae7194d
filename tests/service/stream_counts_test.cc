// Resources that streams leave in a server process: after many streams, after many cancelled ones,
// and with many idle ones. A few by default; `--opened 100000 --cancelled 10000 --idle 1000` are
// the numbers of tests/PROMISES.md.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/reconstructor.h"
#include "service/server_process.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

struct Counts {
  std::uint64_t opened = 4000, cancelled = 1000, idle = 100;
  std::uint64_t particles = 100'000;  // In a large frame.
};
Counts counts;

constexpr int kClients = 4;
constexpr double kMaxGrowthMib = 5;
constexpr double kMaxIdleBytes = 100'000;
// Slightly longer than a worker keeps its buffers; then the server frees memory.
constexpr std::chrono::milliseconds kQuiet{11'500};

std::shared_ptr<grpc::Channel> NewChannel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetMaxReceiveMessageSize(-1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

// A square lattice of particles, float32, with a wavy outline.
std::vector<float> LargeFrame() {
  std::vector<float> positions;
  const auto side = static_cast<std::uint64_t>(std::sqrt(static_cast<double>(counts.particles)));
  for (std::uint64_t row = 0; row < side; ++row) {
    for (std::uint64_t column = 0; column < side; ++column) {
      positions.push_back(static_cast<float>(column + (row / 16) % 2 * 8));
      positions.push_back(static_cast<float>(row));
    }
  }
  return positions;
}

v1::ReconstructRequest LargeRequest(const std::vector<float>& positions) {
  v1::ReconstructRequest request;
  v1::ParticleFrame& frame = *request.mutable_frame();
  frame.set_sequence(1);
  frame.set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  frame.set_positions(positions.data(), positions.size() * sizeof(float));
  return request;
}

v1::ReconstructRequest OpenUnitRequest(const std::string& name = "") {
  auto request = OpenRequest(name);
  request.mutable_open()->mutable_parameters()->set_spacing(1);
  return request;
}

// Size of the stream's state after it.
double StateBytes(const std::vector<float>& positions) {
  ReconstructionParameters parameters;
  parameters.spacing = 1;
  const auto reconstructor = Reconstructor::Create(parameters);
  State state;
  Workspace workspace;
  Result result;
  Frame frame;
  frame.positions = std::span<const float>(positions);
  EXPECT_TRUE(reconstructor->Reconstruct(frame, state, workspace, result).ok());
  return static_cast<double>(Serialize(state).size());
}

class StreamCosts : public ::testing::Test {
 protected:
  const std::string& address() const { return server_.address(); }

  // Memory when workers are cold and only a test's own streams are open.
  double SettledMib() {
    SmallStream();  // Leaves a worker that becomes cold.
    std::this_thread::sleep_for(kQuiet);
    return server_.process().ResidentMib();
  }

  void SmallStream() {
    StreamClient client(channel_);
    ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
    ASSERT_TRUE(client.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
    client.HalfClose();
    EXPECT_TRUE(client.Finish().ok());
  }

  // Runs `job` `count` times on several connections at once, with a channel and a source of random
  // numbers.
  void Repeat(
      std::uint64_t times,
      const std::function<void(const std::shared_ptr<grpc::Channel>&, std::mt19937&)>& job) {
    std::atomic<std::uint64_t> next = 0;
    std::vector<std::thread> clients;
    for (unsigned i = 0; i < kClients; ++i) {
      clients.emplace_back([&, i] {
        const auto channel = NewChannel(address());
        std::mt19937 random(i);
        while (next++ < times) job(channel, random);
      });
    }
    for (std::thread& client : clients) client.join();
  }

  // True if the newest result of the stream "first" was kept, seen by a late watcher. The watch
  // ends with the stream, by the producer's half-close.
  bool LateWatcherGetsOne(StreamClient& producer) {
    WatchClient watcher(channel_, "first", v1::WATCH_MODE_LATEST, 1);
    EXPECT_TRUE(watcher.Receive().has_opened());
    producer.HalfClose();
    EXPECT_TRUE(producer.Finish().ok());
    const auto next = watcher.Receive();
    EXPECT_TRUE(next.has_frame() || next.has_ended());
    return next.has_frame();
  }

  v1::GetServerInfoResponse Info() { return InfoOf(channel_); }
  // A client may see the end of its stream before the server has released it.
  void ExpectNoneIsOpen() {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (Info().open_streams() > 0) ASSERT_LT(std::chrono::steady_clock::now(), give_up);
  }

  static std::uint32_t MaxStreams() { return static_cast<std::uint32_t>(counts.idle + 10); }

  ServingProcess server_{{"--log-level", "off", "--threads", "2", "--max-streams",
                          std::to_string(MaxStreams()), "--history-bytes",
                          "0"}};  // Histories have their own limit.
  std::shared_ptr<grpc::Channel> channel_ = NewChannel(address());
};

void OpenAndClose(const std::shared_ptr<grpc::Channel>& channel, std::mt19937& random) {
  StreamClient client(channel);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  if (random() % 16 == 0) {
    ASSERT_TRUE(client.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
  }
  client.HalfClose();
  EXPECT_TRUE(client.Finish().ok());
}

// Cancels after a random number of steps, at a random moment of the next step.
void OpenAndCancel(const std::shared_ptr<grpc::Channel>& channel, std::mt19937& random) {
  StreamClient client(channel);
  const auto steps = static_cast<unsigned>(random() % 7);
  if (steps > 0) client.Send(OpenRequest());
  if (steps > 1) {
    ASSERT_TRUE(client.Receive().has_opened());
  }
  for (unsigned i = 2; i < steps; ++i) client.Send(BlobRequest(i - 1, 1, i));
  if (steps > 1 && random() % 4 == 0) client.HalfClose();
  if (steps > 2 && random() % 2 == 0) client.Receive();
  std::this_thread::sleep_for(std::chrono::microseconds(random() % 1500));
  client.Cancel();
  client.Finish();
}

TEST_F(StreamCosts, InfoExplainsEveryDoubt) {
  const v1::GetServerInfoResponse info = Info();
  ASSERT_EQ(info.doubts_size(), v1::Doubt_MAX);
  for (const v1::DoubtText& doubt : info.doubts()) {
    EXPECT_NE(doubt.doubt(), v1::DOUBT_UNSPECIFIED);
    EXPECT_FALSE(doubt.name().empty());
    EXPECT_FALSE(doubt.explanation().empty());
  }
}

TEST_F(StreamCosts, OpenedAndClosedStreamsLeaveNothing) {
  Repeat(1000, OpenAndClose);
  const double before = SettledMib();
  Repeat(counts.opened, OpenAndClose);
  ExpectNoneIsOpen();
  const double after = SettledMib();
  std::printf("%lu streams opened and closed: %.2f -> %.2f MiB\n",
              static_cast<unsigned long>(counts.opened), before, after);
  EXPECT_LE(after - before, kMaxGrowthMib);
}

TEST_F(StreamCosts, CancelledStreamsLeaveNothing) {
  Repeat(500, OpenAndCancel);
  const double before = SettledMib();
  Repeat(counts.cancelled, OpenAndCancel);
  ExpectNoneIsOpen();
  const double after = SettledMib();
  std::printf("%lu streams cancelled: %.2f -> %.2f MiB\n",
              static_cast<unsigned long>(counts.cancelled), before, after);
  EXPECT_LE(after - before, kMaxGrowthMib);
}

TEST_F(StreamCosts, IdleStreamsCostLittleAlsoAfterALargeFrame) {
  const std::vector<float> positions = LargeFrame();
  const auto large = LargeRequest(positions);
  {
    StreamClient client(channel_);  // Warms the server up.
    ASSERT_TRUE(client.SendAndReceive(OpenUnitRequest()).has_opened());
    ASSERT_TRUE(client.SendAndReceive(large).has_frame());
  }
  const double before = SettledMib();
  const std::size_t threads = server_.process().ThreadCount();
  const auto bytes_each = [&](double mib) {
    return (mib - before) * 1024 * 1024 / static_cast<double>(counts.idle);
  };

  // One connection each, like different simulations.
  std::vector<std::unique_ptr<StreamClient>> clients;
  for (std::uint64_t i = 0; i < counts.idle; ++i) {
    clients.push_back(std::make_unique<StreamClient>(NewChannel(address())));
    ASSERT_TRUE(
        clients.back()->SendAndReceive(OpenUnitRequest(i == 0 ? "first" : "")).has_opened());
  }
  const double fresh = bytes_each(SettledMib());
  std::size_t result = 0;
  for (const auto& client : clients) {
    const auto answer = client->SendAndReceive(large);
    ASSERT_TRUE(answer.has_frame());
    result = answer.ByteSizeLong();
  }
  EXPECT_EQ(Info().open_streams(), counts.idle);
  const double used = bytes_each(SettledMib()), state = StateBytes(positions);
  // A result is kept for later watchers only if it fits into a stream's share.
  const bool is_kept = result <= ServerLimits{.max_streams = MaxStreams()}.KeptResultBytes();
  const double kept = is_kept ? static_cast<double>(result) : 0;
  const std::size_t more_threads = server_.process().ThreadCount() - threads;
  EXPECT_EQ(LateWatcherGetsOne(*clients.front()), is_kept);
  std::printf(
      "%lu idle streams: %.0f bytes each, %.0f after a frame of %lu particles, of which %.0f are "
      "state and %.0f the newest result (of %zu); %zu threads more\n",
      static_cast<unsigned long>(counts.idle), fresh, used,
      static_cast<unsigned long>(positions.size() / 2), state, kept, result, more_threads);
  EXPECT_LE(fresh, kMaxIdleBytes);
  EXPECT_LE(used - state - kept, kMaxIdleBytes);
  EXPECT_LE(more_threads, 4u);  // gRPC's own threads, for any number of streams.
}

}  // namespace
}  // namespace partiemc::server

int main(int argc, char** argv) {
  using partiemc::server::counts;
  ::testing::InitGoogleTest(&argc, argv);
  CLI::App app("What streams leave behind in a server.");
  app.add_option("--opened", counts.opened, "Streams to open and close")->capture_default_str();
  app.add_option("--cancelled", counts.cancelled, "Streams to cancel")->capture_default_str();
  app.add_option("--idle", counts.idle, "Streams to leave idle")->capture_default_str();
  app.add_option("--particles", counts.particles, "Of the large frame")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return RUN_ALL_TESTS();
}
