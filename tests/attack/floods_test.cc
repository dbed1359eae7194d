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
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "attack/attacked_server.h"
#include "attack/honest_stream.h"
#include "attack/requests.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "support/certificates.h"
#include "support/temporary_folder.h"

namespace partiemc::attack {
namespace {

using std::chrono::milliseconds;

// The server examines connections every 5 ms. If the machine pauses the examining thread for
// longer, gRPC begins about 50 calls in each further millisecond, of 20 kB each.
constexpr double kMostMib = 64, kPeriodMs = 5, kMibPerMsOfPause = 1;

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

// Growth of resident memory since the construction.
class Growth {
 public:
  explicit Growth(pid_t process) : watch_(process) {
    std::this_thread::sleep_for(milliseconds(100));
    idle_ = watch_.PeakMib();
  }
  double Mib() const { return watch_.PeakMib() - idle_; }

 private:
  MemoryWatch watch_;
  double idle_ = 0;
};

// Measures the longest pause: by how many milliseconds the machine was late to wake a thread.
class Pauses {
 public:
  Pauses() : thread_([this] { Run(); }) {}
  ~Pauses() { Stop(); }

  double LongestMs() {
    Stop();
    return std::chrono::duration<double, std::milli>(longest_).count();
  }

 private:
  void Run() {
    while (!stop_) {
      const auto due = std::chrono::steady_clock::now() + milliseconds(1);
      std::this_thread::sleep_until(due);
      longest_ = std::max(longest_, std::chrono::steady_clock::now() - due);
    }
  }
  void Stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }

  std::atomic<bool> stop_ = false;
  std::chrono::steady_clock::duration longest_{};  // Read after the thread has ended.
  std::thread thread_;
};

// Floods beside an honest stream, and checks memory, service and the end of the server.
void Try(const Case& tried, FloodSettings settings, AttackedServer& server, HonestStream& honest,
         const Proxy* proxy = nullptr) {
  settings.time = milliseconds(AllFloods() ? 4'000 : 1'500);
  settings.bytes_per_second = tried.bytes_per_second;
  settings.connections = tried.connections;
  std::this_thread::sleep_for(milliseconds(1'000));
  const Growth of_server(server.process().process());
  std::optional<Growth> of_proxy;
  if (proxy != nullptr) of_proxy.emplace(proxy->process());
  const std::uint64_t before = honest.frames();
  Pauses pauses;
  const FloodOutcome outcome = RunFlood(*tried.flood, settings);
  const double pause_ms = pauses.LongestMs();
  const std::uint64_t served = honest.frames() - before;
  const double beside = of_proxy ? of_proxy->Mib() : 0;
  std::printf(
      "%s%s: %.0f MiB sent in %lu connections; %.1f + %.1f MiB more; %lu honest frames; longest "
      "pause %.1f ms\n",
      tried.flood->name, tried.way, static_cast<double>(outcome.bytes) / (1 << 20),
      static_cast<unsigned long>(outcome.connections), of_server.Mib(), beside,
      static_cast<unsigned long>(served), pause_ms);
  EXPECT_LE(of_server.Mib() + beside,
            kMostMib + kMibPerMsOfPause * std::max(0.0, pause_ms - kPeriodMs));
  EXPECT_GT(served, 0u);
  honest.Stop();
  EXPECT_TRUE(server.Lives()) << server.Output();
  EXPECT_EQ(server.GaugesNotAtZero(std::chrono::seconds(30)), "");
  std::printf("  cut: %.0f for bytes, %.0f for streams, %.0f for headers\n",
              server.Gauge("partiemc_connections_cut_unaccounted_total"),
              server.Gauge("partiemc_connections_cut_streams_total"),
              server.Gauge("partiemc_connections_cut_headers_total"));
  EXPECT_EQ(server.Terminate(), 0) << server.Output();
}

class FloodTest : public testing::TestWithParam<Case> {};

TEST_P(FloodTest, TakesLittleMemoryAndOthersAreServed) {
  AttackedServer server({"--memory-budget", "256MB"});
  HonestStream honest(server.address(), "", 1);
  Try(GetParam(), {.address = server.address()}, server, honest);
}

INSTANTIATE_TEST_SUITE_P(All, FloodTest, testing::ValuesIn(Cases()), NameOf);

// Files for TLS and two tokens.
struct Files {
  const CertificateAuthority authority{"floods"};
  const IssuedCertificate issued = authority.Issue("server");
  const support::TemporaryFolder folder;
  const std::string certificate = folder.Write("server.crt", issued.certificate);
  const std::string key = folder.Write("server.key", issued.key);
  const std::string tokens = folder.Write(
      "tokens", std::string(kHonestToken) + " honest\n" + kHostileToken + " hostile\n");
};

class FloodOverTls : public testing::TestWithParam<Case> {};

TEST_P(FloodOverTls, TakesLittleMemoryAndOthersAreServed) {
  const Files files;
  AttackedServer server(
      {"--memory-budget", "256MB", "--tls-cert", files.certificate, "--tls-key", files.key});
  HonestStream honest(server.address(), "", 1, files.authority.certificate());
  Try(GetParam(), {.address = server.address(), .tls = true}, server, honest);
}

std::vector<Case> CasesOverTls() {
  std::vector<Case> cases;
  for (const Flood& flood : Floods()) {
    const std::string_view name = flood.name;
    if (AllFloods() || name == "continuation-tiny" || name == "rapid-reset-indexed" ||
        name == "open-calls" || name == "ping" || name == "data-empty") {
      cases.push_back({&flood, "", 0, 1});
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(All, FloodOverTls, testing::ValuesIn(CasesOverTls()), NameOf);

// haproxy with docker/haproxy.cfg in front of a server without limits per address. The attacker has
// a token, so its calls reach the server. Its sixteen connections run on idle processors only.
class FloodBehindProxy : public testing::TestWithParam<Case> {
 protected:
  const Files files_{};
  AttackedServer server_{{"--memory-budget", "256MB", "--connections-per-address", "0",
                          "--new-connections-per-address", "0", "--token-file", files_.tokens}};
};

TEST_P(FloodBehindProxy, TakesLittleMemoryAndOthersAreServed) {
  const Proxy proxy(server_.address());
  HonestStream honest(proxy.address(), kHonestToken, 1);
  Try(GetParam(), {.address = proxy.address(), .token = kHostileToken, .yield_processors = true},
      server_, honest, &proxy);
}

TEST_P(FloodBehindProxy, OverTls) {
  const Proxy proxy(server_.address(), files_.certificate);
  HonestStream honest(proxy.address(), kHonestToken, 1, files_.authority.certificate());
  Try(GetParam(),
      {.address = proxy.address(), .token = kHostileToken, .tls = true, .yield_processors = true},
      server_, honest, &proxy);
}

std::vector<Case> CasesOfMany() {
  std::vector<Case> cases;
  for (const Flood& flood : Floods()) cases.push_back({&flood, "", 0, 16});
  return cases;
}

INSTANTIATE_TEST_SUITE_P(All, FloodBehindProxy, testing::ValuesIn(CasesOfMany()), NameOf);

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
