// Many random calls over real connections: `--calls 1000000` on demand; `--seed N` repeats a run,
// except for timing.
#include "attack/random_calls.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "attack/attacked_server.h"
#include "attack/honest_stream.h"
#include "attack/options.h"
#include "service/service_testing.h"
#include "support/certificates.h"
#include "support/temporary_folder.h"

namespace partiemc::attack {
namespace {

constexpr std::chrono::seconds kRandomCallsPatience(60);

std::shared_ptr<grpc::Channel> Channel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

void Tell(const char* what, const Storm& storm, std::uint64_t seed,
          std::chrono::steady_clock::time_point began) {
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  const CallCounts& counts = storm.counts();
  std::printf(
      "%s: %lu raw calls over %lu connections, %lu of gRPC's client, %.1f s, seed %lu\n", what,
      static_cast<unsigned long>(counts.raw), static_cast<unsigned long>(counts.connections),
      static_cast<unsigned long>(counts.client), took.count(), static_cast<unsigned long>(seed));
}

// A server without limits per address, because all callers have the same one.
std::vector<std::string> Arguments(std::vector<std::string> more) {
  more.insert(more.end(), {"--connections-per-address", "0", "--new-connections-per-address", "0"});
  return more;
}

// Runs the calls on a server with these arguments and one honest stream.
void ExpectBorne(const char* what, std::vector<std::string> arguments, double share) {
  const Options& options = GetOptions();
  const auto calls = static_cast<std::int64_t>(share * static_cast<double>(options.calls));
  AttackedServer server(Arguments(std::move(arguments)));
  {
    HonestStream honest(server.address(), "", 1);  // Runs all the time.
    const auto began = std::chrono::steady_clock::now();
    Storm storm(server.address(), calls, options.seed);
    storm.Wait();
    Tell(what, storm, options.seed, began);
    EXPECT_LE(storm.counts().left, 0) << "callers found nobody to call";
  }
  ASSERT_TRUE(server.Lives()) << server.Output();
  EXPECT_EQ(server.GaugesNotAtZero(kRandomCallsPatience), "");
  EXPECT_EQ(server::StreamedDigests(Channel(server.address()), 6, 20), server::LocalDigests(6, 20));
  std::printf("%s: %.1f MiB, at most %.1f\n", what, server.ResidentMib(), server.PeakMib());
  EXPECT_EQ(server.Terminate(), 0) << server.Output();
}

TEST(RandomCalls, ABusyServerBearsThem) {
  ExpectBorne("busy", {"--max-streams", "24", "--max-watchers", "8"}, 0.6);
}

TEST(RandomCalls, AFullServerBearsThem) {
  ExpectBorne("full", {"--max-streams", "2", "--max-watchers", "1"}, 0.3);
}

TEST(RandomCalls, AFullServerBearsThemOverTlsWithAToken) {
  const Options& options = GetOptions();
  const support::TemporaryFolder folder;
  const CertificateAuthority authority("authority");
  const IssuedCertificate identity = authority.Issue("server");
  const std::string token = "alice-secret-0123456789";
  AttackedServer server(Arguments({"--max-streams", "2", "--max-watchers", "1", "--tls-cert",
                                   folder.Write("server.pem", identity.certificate), "--tls-key",
                                   folder.Write("server.key", identity.key), "--token-file",
                                   folder.Write("tokens", token + " alice\n")}));
  const CallMessages messages;
  CallCounts counts;
  counts.left = static_cast<std::int64_t>(options.calls / 10);
  std::vector<std::thread> callers;
  for (std::uint64_t k = 0; k < 3; ++k) {
    callers.emplace_back([&, k] {
      CallByClient({server.address(), authority.certificate(), token}, messages, options.seed + k,
                   counts);
    });
  }
  for (std::thread& caller : callers) caller.join();
  ASSERT_TRUE(server.Lives()) << server.Output();
  EXPECT_EQ(server.GaugesNotAtZero(kRandomCallsPatience), "");
  EXPECT_EQ(server.Terminate(), 0) << server.Output();
}

TEST(RandomCalls, DrainingServersLeaveInOrder) {
  const Options& options = GetOptions();
  const auto servers = std::max<std::uint64_t>(4, options.calls / 25'000);
  const auto calls_each = static_cast<std::int64_t>(options.calls / 10 / servers);
  support::Random random(options.seed);
  std::uint64_t begun = 0;
  for (std::uint64_t k = 0; k < servers; ++k) {
    AttackedServer server(
        Arguments({"--max-streams", "4", "--max-watchers", "4", "--grace-seconds", "1"}));
    Storm storm(server.address(), 1'000'000'000, options.seed * 1'000 + k);
    const auto now = [&] {
      return static_cast<std::int64_t>(storm.counts().raw + storm.counts().client);
    };
    const auto share =
        static_cast<std::int64_t>(random.Below(static_cast<std::size_t>(calls_each)));
    while (now() < share && server.Lives()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    EXPECT_EQ(server.Terminate(), 0) << server.Output();  // While further calls arrive.
    storm.Stop();
    begun += static_cast<std::uint64_t>(now());
  }
  std::printf("draining: %lu servers, %lu calls\n", static_cast<unsigned long>(servers),
              static_cast<unsigned long>(begun));
}

}  // namespace
}  // namespace partiemc::attack
