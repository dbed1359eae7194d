// Command line, environment and config file of the server; addresses.
#include "server/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "server/base/machine_limits.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

std::variant<CommandLine, EarlyExit> Parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "partiemc-server");
  return ParseCommandLine(static_cast<int>(arguments.size()), arguments.data());
}

CommandLine Parsed(std::vector<const char*> arguments) {
  const auto parsed = Parse(std::move(arguments));
  const auto* early = std::get_if<EarlyExit>(&parsed);
  EXPECT_EQ(early, nullptr) << early->text;
  return early == nullptr ? std::get<CommandLine>(parsed) : CommandLine{};
}

// The error line for these arguments.
std::string Refused(std::vector<const char*> arguments) {
  const auto parsed = Parse(std::move(arguments));
  const auto* early = std::get_if<EarlyExit>(&parsed);
  if (early == nullptr) return "accepted";
  EXPECT_EQ(early->code, 2);
  EXPECT_EQ(early->text.find('\n'), early->text.size() - 1) << early->text;
  return early->text;
}

// Sets a variable during a test.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) { setenv(name, value, 1); }
  ~Environment() { unsetenv(name_); }

 private:
  const char* name_;
};

TEST(CommandLineOptions, TheMemoryPlanAddsUpWhatTheOptionsMayTake) {
  const auto parsed = Parse({"--print-memory-plan", "--memory-budget", "1GiB", "--threads", "3",
                             "--max-streams", "8", "--history-bytes", "1MiB"});
  const auto* const early = std::get_if<EarlyExit>(&parsed);
  ASSERT_NE(early, nullptr);
  EXPECT_EQ(early->code, 0);
  EXPECT_THAT(early->text, HasSubstr("      48 MiB  3 compute threads"));
  EXPECT_THAT(early->text, HasSubstr("       8 MiB  results for watchers that go back"));
  EXPECT_THAT(early->text, HasSubstr("    1016 MiB  requests and answers"));
  EXPECT_THAT(early->text, HasSubstr("     640 MiB  frames of 2 streams beyond the budget"));
  EXPECT_THAT(early->text, HasSubstr("     305 MiB  computing one frame beyond the budget"));
  EXPECT_THAT(early->text, HasSubstr("     256 MiB  states of streams"));
  // 64 MiB of newest results, of which the histories cover 8.
  EXPECT_THAT(early->text, HasSubstr("      56 MiB  newest results"));
  // 24 + 48 + 8 + 56 + 1016 + 640 + 305 + 256 + 63.5 + 64 + 66
  EXPECT_THAT(early->text, HasSubstr("    2547 MiB  in total"));
}

TEST(CommandLineOptions, WhatIsAdvertisedIsAnAddressThatOthersReach) {
  EXPECT_EQ(
      Parsed({"--nats", "nats://n", "--advertise", "a.example:50051"}).server.advertised_address,
      "a.example:50051");
  EXPECT_THAT(Refused({"--advertise", "a.example:50051"}), HasSubstr("needs --nats"));
  for (const char* address : {"unix:/run/p.sock", "a.example:0", "a.example"}) {
    EXPECT_THAT(Refused({"--nats", "nats://n", "--advertise", address}), HasSubstr("--advertise"));
  }
}

TEST(CommandLineOptions, ByDefaultListenOnLoopbackWithAffordableLimits) {
  const CommandLine line = Parsed({});
  EXPECT_EQ(line.server.address.ToString(), "127.0.0.1:50051");
  EXPECT_FALSE(line.server.insecure);
  EXPECT_EQ(line.server.limits.frames_in_flight, 4u);
  EXPECT_EQ(line.server.limits.max_frame_bytes,
            ServerLimits::DefaultFrameBytes(line.server.limits.frame.max_particles));
  EXPECT_GE(line.server.threads, 1u);
  EXPECT_FALSE(line.health_check.has_value());
}

TEST(CommandLineOptions, FlagsCountMoreThanTheFileAndTheFileMoreThanTheEnvironment) {
  const support::TemporaryFolder folder;
  const std::string path = folder.Write("options.toml", "max-streams = 8\nframes-in-flight = 2\n");
  const Environment streams("PARTIEMC_MAX_STREAMS", "5");
  const Environment tiles("PARTIEMC_MAX_TILES", "77");
  const CommandLine line = Parsed({"--config", path.c_str(), "--frames-in-flight", "3"});
  EXPECT_EQ(line.server.limits.max_streams, 8u);
  EXPECT_EQ(line.server.limits.frames_in_flight, 3u);
  EXPECT_EQ(line.server.limits.frame.max_tiles, 77u);
}

TEST(CommandLineOptions, TheConfigFileCanBeNamedByTheEnvironment) {
  const support::TemporaryFolder folder;
  const std::string path = folder.Write("options.toml", "max-streams = 9\n");
  const Environment config("PARTIEMC_CONFIG", path.c_str());
  EXPECT_EQ(Parsed({}).server.limits.max_streams, 9u);
}

TEST(CommandLineOptions, FewerParticlesMakeSmallerFramesUnlessToldOtherwise) {
  EXPECT_EQ(Parsed({"--max-particles", "1000"}).server.limits.max_frame_bytes,
            ServerLimits::DefaultFrameBytes(1000));
  EXPECT_EQ(Parsed({"--memory-budget", "64MB"}).server.limits.max_frame_bytes, 8u << 20);
  EXPECT_EQ(Parsed({"--memory-budget", "1"}).server.limits.max_frame_bytes, 4u << 20);
  EXPECT_EQ(Parsed({"--max-frame-bytes", "2MB"}).server.limits.max_frame_bytes, 2u << 20);
}

TEST(CommandLineOptions, MemoryIsThatOfTheMachineUnlessToldOtherwise) {
  EXPECT_EQ(Parsed({}).server.limits.memory_budget, AvailableMemory() / 2);
  EXPECT_EQ(Parsed({"--memory-budget", "3MB"}).server.limits.memory_budget, 3u << 20);
  EXPECT_THAT(Refused({"--memory-budget", "0"}), HasSubstr("--memory-budget"));
}

TEST(CommandLineOptions, HistoriesAreAnEighthOfTheBudgetAtMost) {
  const auto limits = [](std::initializer_list<const char*> flags) {
    return Parsed(flags).server.limits;
  };
  EXPECT_EQ(limits({}).history_bytes, 64u << 20);
  EXPECT_EQ(limits({"--history-bytes", "3MB", "--max-streams", "5", "--memory-budget", "1GB"})
                .AllHistoryBytes(),
            15u << 20);
  const auto small = limits({"--memory-budget", "80MB"});
  EXPECT_EQ(small.AllHistoryBytes(), 10u << 20);
  EXPECT_EQ(small.FrameBudget(), 70u << 20);
  EXPECT_EQ(limits({"--history-bytes", "0"}).AllHistoryBytes(), 0u);
  EXPECT_EQ(limits({"--history-bytes", "0", "--memory-budget", "1"}).FrameBudget(), 1u);
  EXPECT_THAT(Refused({"--history-bytes", "-1"}), HasSubstr("--history-bytes"));
}

TEST(CommandLineOptions, AStreamMayBeIdleForAnHourUnlessToldOtherwise) {
  using std::chrono::milliseconds;
  EXPECT_EQ(Parsed({}).server.limits.idle.streaming, std::chrono::hours(1));
  EXPECT_EQ(Parsed({"--idle-timeout", "0"}).server.limits.idle.streaming, milliseconds(0));
  EXPECT_EQ(Parsed({"--idle-timeout", "0.0001"}).server.limits.idle.streaming, milliseconds(1));
  EXPECT_THAT(Refused({"--idle-timeout", "-1"}), HasSubstr("--idle-timeout"));
}

TEST(CommandLineOptions, LimitsOfCallersAreThoseOfATokenFile) {
  EXPECT_EQ(Parsed({}).server.caller_limits, CallerQuota());
  EXPECT_EQ(Parsed({"--caller-limits", "streams=4 bytes=1KB"}).server.caller_limits,
            (CallerQuota{.streams = 4, .bytes = 1024}));
  EXPECT_THAT(Refused({"--caller-limits", "streams=4,bytes=1KB"}),
              HasSubstr("--caller-limits: streams=4,bytes=1KB: calls=, streams= and watchers="));
  const Environment limits("PARTIEMC_CALLER_LIMITS", "watchers=3");
  EXPECT_EQ(Parsed({}).server.caller_limits, (CallerQuota{.watchers = 3}));
}

TEST(CommandLineOptions, TheHealthCheckAsksTheAddressOfTheServerUnlessGivenAnother) {
  EXPECT_EQ(Parsed({"--health-check"}).health_check->ToString(), "127.0.0.1:50051");
  EXPECT_EQ(Parsed({"--health-check", "--address", "localhost:7"}).health_check->ToString(),
            "localhost:7");
  EXPECT_EQ(Parsed({"--health-check", "unix:/tmp/a"}).health_check->ToString(), "unix:/tmp/a");
}

TEST(CommandLineOptions, TlsIsACertificateAndItsKeyAndWhatClientsAreAskedFor) {
  EXPECT_FALSE(Parsed({}).server.tls.has_value());
  EXPECT_FALSE(Parsed({}).health_check_security.tls);
  const Environment tokens("PARTIEMC_TOKEN_FILE", "tokens");
  CommandLine line = Parsed({"--tls-cert", "a.pem", "--tls-key", "a.key"});
  EXPECT_EQ(line.server.tls->certificate, "a.pem");
  EXPECT_EQ(line.server.tls->key, "a.key");
  EXPECT_EQ(line.server.tls->client_ca, "");
  EXPECT_EQ(line.server.token_file, "tokens");
  EXPECT_TRUE(line.health_check_security.tls);
  EXPECT_EQ(line.health_check_security.certificate_file, "");
  line = Parsed({"--tls-cert", "a.pem", "--tls-key", "a.key", "--tls-client-ca", "ca.pem"});
  EXPECT_EQ(line.server.tls->client_ca, "ca.pem");
  EXPECT_EQ(line.health_check_security.certificate_file, "a.pem");
  EXPECT_EQ(line.health_check_security.key_file, "a.key");
  EXPECT_THAT(Refused({"--tls-cert", "a.pem"}), HasSubstr("--tls-key"));
  EXPECT_THAT(Refused({"--tls-key", "a.key"}), HasSubstr("--tls-cert"));
  EXPECT_THAT(Refused({"--tls-client-ca", "ca.pem"}), HasSubstr("--tls-cert"));
}

TEST(CommandLineOptions, CheckpointsAreSignedWhereAKeyFileIsNamedInAnyOfTheWays) {
  EXPECT_FALSE(Parsed({}).server.checkpoint_key_file.has_value());
  EXPECT_EQ(Parsed({"--checkpoint-key-file", "keys"}).server.checkpoint_key_file, "keys");
  const support::TemporaryFolder folder;
  const std::string path = folder.Write("options.toml", "checkpoint-key-file = \"from-file\"\n");
  const Environment keys("PARTIEMC_CHECKPOINT_KEY_FILE", "from-environment");
  EXPECT_EQ(Parsed({}).server.checkpoint_key_file, "from-environment");
  EXPECT_EQ(Parsed({"--config", path.c_str()}).server.checkpoint_key_file, "from-file");
  EXPECT_EQ(Parsed({"--health-check"}).health_check->ToString(), "127.0.0.1:50051");
}

TEST(CommandLineOptions, WhatIsWrongIsToldInOneLine) {
  EXPECT_THAT(Refused({"--bogus"}), HasSubstr("--bogus"));
  EXPECT_THAT(Refused({"--max-streams", "0"}), HasSubstr("--max-streams"));
  EXPECT_THAT(Refused({"--max-frame-bytes", "2000000000"}), HasSubstr("--max-frame-bytes"));
  EXPECT_THAT(Refused({"--log-format", "xml"}), HasSubstr("--log-format"));
  EXPECT_THAT(Refused({"--address", "nowhere"}), HasSubstr("nowhere"));
  EXPECT_THAT(Refused({"--health-check", "nowhere"}), HasSubstr("nowhere"));
  EXPECT_THAT(Refused({"--config", "/no/such/file"}), HasSubstr("/no/such/file"));
}

// The error for a config file with this text, after "partiemc-server: FILE".
std::string RefusedFile(const std::string& text, std::vector<const char*> flags = {}) {
  const support::TemporaryFolder folder;
  const std::string path = folder.Write("options.toml", text);
  flags.insert(flags.end(), {"--config", path.c_str()});
  const std::string error = Refused(flags);
  const std::string begin = "partiemc-server: " + path;
  EXPECT_THAT(error, StartsWith(begin));
  return error.substr(std::min(begin.size(), error.size()));
}

TEST(ConfigFile, NamesLineAndNearestOptionOfAnUnknownOne) {
  const std::string error = RefusedFile("threads = 1\n\nmax-stream = 8\n");
  EXPECT_THAT(error, StartsWith(":3: "));
  EXPECT_THAT(error, HasSubstr("`max-stream`"));
  EXPECT_THAT(error, HasSubstr("`max-streams`"));
  EXPECT_THAT(RefusedFile("max-streams 8\n"), StartsWith(":1: "));
  EXPECT_THAT(RefusedFile("\n\"quoted\",\n"),
              StartsWith(":2: there is no option `\"quoted\",`; see"));
  EXPECT_THAT(RefusedFile("threads = 1\n[server]\nmax-streams = 8\n"), StartsWith(":2: [server]"));
  EXPECT_THAT(RefusedFile("'max-streams' = 0\n"), StartsWith(":1: "));
  EXPECT_THAT(RefusedFile("\na.b = 1\n"), StartsWith(":2: [a]"));
  EXPECT_THAT(RefusedFile("threads = 1\nhealth-check = \"a:1\"\n"), StartsWith(":2: "));
}

TEST(ConfigFile, NamesLineOfAWrongValue) {
  EXPECT_THAT(RefusedFile("# threads\nmax-streams = 0\nthreads = 1\n"),
              StartsWith(":2: --max-streams"));
  EXPECT_THAT(RefusedFile("web-host = \"a\"\nweb = \"b:1\"\nmax-streams = \"x\"\n"),
              StartsWith(":3: "));
  EXPECT_THAT(RefusedFile("log-level = \"info\"\ninsecure = maybe\n"), StartsWith(":2: "));
  EXPECT_THAT(RefusedFile("threads = 1\naddress = \"nowhere\"\n"), StartsWith(":2: --address: "));
  EXPECT_THAT(RefusedFile("\nadvertise = \"a.example:1\"\n"), StartsWith(":2: --advertise"));
  EXPECT_THAT(RefusedFile("caller-limits = \"streams=x\"\n"), StartsWith(":1: --caller-limits"));
  EXPECT_THAT(RefusedFile("threads = 1\ntls-cert = \"a.pem\"\n"), StartsWith(":2: --tls-cert"));
}

TEST(ConfigFile, IsNotBlamedForAValueOfTheCommandLine) {
  const support::TemporaryFolder folder;
  const std::string path = folder.Write("options.toml", "max-streams = 8\nthreads = 1\n");
  EXPECT_THAT(Refused({"--config", path.c_str(), "--max-streams", "0"}),
              StartsWith("partiemc-server: --max-streams"));
}

TEST(ConfigFile, IsNamedByTheEnvironmentInErrors) {
  const support::TemporaryFolder folder;
  const std::string path = folder.Write("options.toml", "max-streams = 0\n");
  const Environment config("PARTIEMC_CONFIG", path.c_str());
  EXPECT_THAT(Refused({}), StartsWith("partiemc-server: " + path + ":1: --max-streams"));
}

TEST(EnvironmentVariables, AMisspeltOneIsRefusedWithTheNearestOption) {
  for (const auto& [misspelt, nearest] :
       {std::pair("PARTIEMC_MEMORY_BUGDET", "PARTIEMC_MEMORY_BUDGET (--memory-budget)"),
        std::pair("PARTIEMC_TOKEN_FIEL", "PARTIEMC_TOKEN_FILE (--token-file)"),
        std::pair("PARTIEMC_TOKENS_FILE", "PARTIEMC_TOKEN_FILE (--token-file)"),
        std::pair("PARTIEMC_CONFIGS", "PARTIEMC_CONFIG (--config)"),
        std::pair("PARTIEMC_MAXSTREAMS", "PARTIEMC_MAX_STREAMS (--max-streams)")}) {
    const Environment variable(misspelt, "secret");
    const std::string error = Refused({});
    EXPECT_THAT(error, HasSubstr(misspelt));
    EXPECT_THAT(error, HasSubstr(nearest));
    EXPECT_THAT(error, Not(HasSubstr("secret")));
    EXPECT_EQ(std::get<EarlyExit>(Parse({"--help"})).code, 0);
  }
  const Environment empty("PARTIEMC_TOKEN_FIEL", "");
  EXPECT_THAT(Parsed({}).ignored_variables, IsEmpty());
}

TEST(EnvironmentVariables, OthersAreReported) {
  EXPECT_THAT(Parsed({}).ignored_variables, IsEmpty());
  // Variables of the client, of the proxy, of an image.
  const std::vector<const char*> names = {"PARTIEMC_SERVER", "PARTIEMC_TOKEN",  "PARTIEMC_TLS",
                                          "PARTIEMC_TLS_CA", "PARTIEMC_PROXY",  "PARTIEMC_PORT",
                                          "PARTIEMC_BIN",    "PARTIEMC_VERSION"};
  for (const char* name : names) {
    const Environment variable(name, "1");
    EXPECT_THAT(Parsed({}).ignored_variables, ElementsAre(name));
  }
}

TEST(EnvironmentVariables, ServiceLinksOfKubernetesAreNoErrors) {
  for (const std::string service : {"PARTIEMC", "PARTIEMC_WEB", "PARTIEMC_MAX_STREAMS"}) {
    for (const auto& [name, value] :
         {std::pair("_SERVICE_HOST", "10.0.0.11"), std::pair("_SERVICE_PORT", "50051"),
          std::pair("_SERVICE_PORT_GRPC", "50051"), std::pair("_PORT", "tcp://10.0.0.11:50051"),
          std::pair("_PORT_50051_TCP", "tcp://10.0.0.11:50051"),
          std::pair("_PORT_50051_TCP_PROTO", "tcp"), std::pair("_PORT_50051_TCP_PORT", "50051"),
          std::pair("_PORT_50051_TCP_ADDR", "10.0.0.11")}) {
      const std::string variable = service + name;
      const Environment link(variable.c_str(), value);
      EXPECT_THAT(Parsed({}).ignored_variables, IsEmpty()) << variable;
    }
  }
}

TEST(CommandLineOptions, HelpAndVersionArePrintedAndAreNoError) {
  for (const char* flag : {"--help", "--version"}) {
    const auto parsed = Parse({flag});
    ASSERT_TRUE(std::holds_alternative<EarlyExit>(parsed));
    EXPECT_EQ(std::get<EarlyExit>(parsed).code, 0);
    EXPECT_THAT(std::get<EarlyExit>(parsed).text, HasSubstr("partiemc-server"));
  }
}

TEST(AddressText, ComesBackAsItWas) {
  for (const char* text : {"127.0.0.1:0", "localhost:50051", "[::1]:1", "unix:/run/x.sock"}) {
    const auto address = ParseAddress(text);
    ASSERT_TRUE(address.ok()) << address.status();
    EXPECT_EQ(address->ToString(), text);
    EXPECT_TRUE(address->IsLocal()) << text;
  }
}

TEST(AddressText, OtherMachinesReachWhatIsNotLoopback) {
  for (const char* text :
       {"0.0.0.0:1", "[::]:1", "192.168.0.1:1", "example.org:1", "128.0.0.1:1"}) {
    EXPECT_FALSE(ParseAddress(text)->IsLocal()) << text;
  }
}

TEST(AddressText, IsRefusedWhereItIsNone) {
  for (const char* text : {"", ":", ":1", "host", "host:", "host:-1", "host:65536", "host:1x",
                           "::1:5", "[]:1", "unix:"}) {
    EXPECT_FALSE(ParseAddress(text).ok()) << text;
  }
  EXPECT_FALSE(ParseAddress("unix:" + std::string(200, 'a')).ok());
}

}  // namespace
}  // namespace partiemc::server
