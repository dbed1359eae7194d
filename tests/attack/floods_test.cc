// Each flood of tests/attack/floods.h against its own server, beside an honest stream and health
// checks from the honest address. On demand
//   attack_test --gtest_filter='*Flood*' --server PATH   attacks another build.
#include "attack/floods.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "attack/attacked_server.h"
#include "attack/honest_stream.h"
#include "attack/requests.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"

namespace partiemc::attack {
namespace {

using std::chrono::milliseconds;

constexpr double kMostMib = 64;

struct Case {
  const Flood* flood;
  const char* way;
  double bytes_per_second;
  std::size_t connections;
};

void PrintTo(const Case& tried, std::ostream* out) { *out << tried.flood->name << tried.way; }

std::string NameOf(const testing::TestParamInfo<Case>& info) {
  std::string name = std::string(info.param.flood->name) + info.param.way;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// Sixteen attacking threads starve the server of processors. PARTIEMC_ALL_FLOODS=1 runs these
// cases, longer, for a quiet machine.
bool AllFloods() { return std::getenv("PARTIEMC_ALL_FLOODS") != nullptr; }

std::vector<Case> Cases() {
  std::vector<Case> cases;
  for (const Flood& flood : Floods()) {
    cases.push_back({&flood, "", 0, 1});
    cases.push_back({&flood, "-slow", 20e6, 1});
    if (AllFloods()) cases.push_back({&flood, "-of-many", 0, 16});
  }
  return cases;
}

class FloodTest : public testing::TestWithParam<Case> {};

TEST_P(FloodTest, TakesLittleMemoryAndOthersAreServed) {
  const Case& tried = GetParam();
  AttackedServer server({"--memory-budget", "256MB"});
  HonestStream honest(server.address(), "", 1);
  std::this_thread::sleep_for(milliseconds(1'000));
  const double idle = server.ResidentMib();
  MemoryWatch memory(server.process().process());
  const std::uint64_t before = honest.frames();
  const FloodOutcome outcome =
      RunFlood(*tried.flood, {.address = server.address(),
                              .time = milliseconds(AllFloods() ? 4'000 : 1'500),
                              .bytes_per_second = tried.bytes_per_second,
                              .connections = tried.connections});
  const std::uint64_t served = honest.frames() - before;
  const double growth = memory.PeakMib() - idle;
  std::printf("%s%s: %.0f MiB sent in %lu connections; %.1f MiB and %.1f more; %lu honest frames\n",
              tried.flood->name, tried.way, static_cast<double>(outcome.bytes) / (1 << 20),
              static_cast<unsigned long>(outcome.connections), idle, growth,
              static_cast<unsigned long>(served));
  EXPECT_LE(growth, kMostMib);
  EXPECT_GT(served, 0u);
  honest.Stop();
  EXPECT_TRUE(server.Lives()) << server.Output();
  EXPECT_EQ(server.GaugesNotAtZero(std::chrono::seconds(30)), "");
  EXPECT_EQ(server.Terminate(), 0) << server.Output();
}

INSTANTIATE_TEST_SUITE_P(All, FloodTest, testing::ValuesIn(Cases()), NameOf);

// Forty streams share one connection; each has large frames on the way, and none is cut.
TEST(LegalUpload, FortyStreamsOfLargeFramesAreNotCut) {
  constexpr int kStreams = 40, kFrames = 2;
  constexpr std::size_t kParticles = 1'000'000;
  AttackedServer server({"--memory-budget", "2GB", "--max-streams", "40"});
  const auto channel = grpc::CreateChannel(server.address(), grpc::InsecureChannelCredentials());
  const auto stub = v1::ReconstructionService::NewStub(channel);
  // Lone particles in rows, so that the response is large.
  v1::ReconstructRequest frame;
  frame.mutable_frame()->set_positions(std::string(kParticles * 16, '\0'));
  std::atomic<int> answers = 0;
  std::vector<std::thread> clients;
  for (int k = 0; k < kStreams; ++k) {
    clients.emplace_back([&, k] {
      grpc::ClientContext context;
      const auto stream = stub->Reconstruct(&context);
      if (!stream->Write(Open("large-" + std::to_string(k)))) return;
      v1::ReconstructResponse response;
      if (!stream->Read(&response)) return;
      v1::ReconstructRequest mine = frame;
      for (int sequence = 1; sequence <= kFrames; ++sequence) {
        mine.mutable_frame()->set_sequence(static_cast<std::uint64_t>(sequence));
        if (!stream->Write(mine) || !stream->Read(&response)) return;
        ++answers;
      }
      stream->WritesDone();
      while (stream->Read(&response)) {
      }
      stream->Finish();
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(answers, kStreams * kFrames);
  for (const char* cut : {"unaccounted", "streams", "headers"}) {
    EXPECT_EQ(server.Gauge("partiemc_connections_cut_" + std::string(cut) + "_total"), 0) << cut;
  }
  EXPECT_EQ(server.Terminate(), 0) << server.Output();
}

}  // namespace
}  // namespace partiemc::attack
