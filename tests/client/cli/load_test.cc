// `partiemc load`: figures checked by hand, and a short run against a real server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "client/cli/load/latencies.h"
#include "client/cli/load/server_figures.h"
#include "client/cli/program.h"

namespace partiemc::client {
namespace {

using ::testing::HasSubstr;

TEST(Load, PercentilesAreThoseOfTheNearestRank) {
  std::vector<double> hundred(100);
  std::iota(hundred.rbegin(), hundred.rend(), 1);
  const Percentiles of_hundred = PercentilesOf(hundred);
  EXPECT_EQ(of_hundred.count, 100u);
  EXPECT_EQ(of_hundred.p50, 50);
  EXPECT_EQ(of_hundred.p90, 90);
  EXPECT_EQ(of_hundred.p99, 99);
  EXPECT_EQ(of_hundred.max, 100);
  std::vector<double> one = {7}, none;
  EXPECT_EQ(PercentilesOf(one).p50, 7);
  EXPECT_EQ(PercentilesOf(one).p99, 7);
  EXPECT_EQ(PercentilesOf(none).count, 0u);
}

TEST(Load, WindowsSettleWhereMedianAndTailAreAlike) {
  const Percentiles usual{.count = 50, .p50 = 10, .p90 = 15, .p99 = 40, .max = 90};
  EXPECT_TRUE(HaveSettled(usual, usual));
  Percentiles other = usual;
  other.max = 1000;  // A single frame is not representative.
  other.p99 = 41.9;
  EXPECT_TRUE(HaveSettled(usual, other));
  other.p99 = 43;
  EXPECT_FALSE(HaveSettled(usual, other));
  other = usual;
  other.p50 = 9;
  EXPECT_FALSE(HaveSettled(usual, other));
  EXPECT_FALSE(HaveSettled({}, {})) << "nothing has come";
  EXPECT_TRUE(
      HaveSettled({.count = 9, .p50 = 0.2, .p99 = 0.3}, {.count = 9, .p50 = 0.3, .p99 = 0.4}))
      << "a tenth of a millisecond is noise";
}

TEST(Load, ReadsTheServersFigures) {
  const auto figures = FiguresIn(
      "# HELP process_cpu_seconds_total Time\n# TYPE process_cpu_seconds_total counter\n"
      "process_cpu_seconds_total 12.5\nprocess_resident_memory_bytes 1.5e+07\n");
  ASSERT_TRUE(figures.has_value());
  EXPECT_EQ(figures->cpu_seconds, 12.5);
  EXPECT_EQ(figures->memory_bytes, 15e6);
  EXPECT_FALSE(FiguresIn("").has_value());
  EXPECT_FALSE(FiguresIn("\nprocess_cpu_seconds_total 1\n").has_value());
  EXPECT_FALSE(FiguresIn("\nprocess_cpu_seconds_total x\nprocess_resident_memory_bytes 1\n"));
}

nlohmann::json LoadOf(const ServerProgram& server, std::vector<std::string> flags) {
  flags.insert(flags.begin(), {"load", "--server", server.address(), "--json", "--seconds", "4"});
  const Ran ran = RunPartiemc(flags);
  EXPECT_EQ(ran.exit_code, 0) << ran.error;
  return nlohmann::json::parse(ran.out);
}

TEST(Load, SendsBallsAndReceivesSurfaces) {
  const ServerProgram server;
  const auto load = LoadOf(server, {"--streams", "1", "--particles", "1000", "--rate", "20",
                                    "--surface", "--coordinates", "compact", "--watchers", "1"});
  EXPECT_EQ(load["surface"], true);
  EXPECT_EQ(load["coordinates"], "compact");
  EXPECT_EQ(load["refused"], 0);
  EXPECT_GT(load["frames"], 0);
  EXPECT_GT(load["watches"]["count"], 0);
}

TEST(Load, CountsWhatItMeasures) {
  const ServerProgram server;
  const auto load =
      LoadOf(server, {"--streams", "3", "--particles", "500", "--rate", "50", "--watchers", "4"});
  EXPECT_EQ(load["streams"], 3);
  EXPECT_EQ(load["ids"], true);
  EXPECT_EQ(load["refused"], 0);
  const int frames = load["frames"];
  EXPECT_GT(frames, 0);
  // Answers are counted while figures are taken.
  EXPECT_NEAR(load["answers"]["count"], frames, 20);
  EXPECT_GT(load["watches"]["count"], 0);
  for (const char* what : {"answers", "watches"}) {
    EXPECT_LE(load[what]["p50_ms"], load[what]["p99_ms"]);
    EXPECT_LE(load[what]["p99_ms"], load[what]["max_ms"]);
  }
  EXPECT_GT(load["client_cpu_ms"], 0);
  EXPECT_TRUE(load["server_cpu_ms"].is_null()) << "nobody was asked";
}

TEST(Load, GoesAsFastAsItCanAndWithoutIds) {
  const ServerProgram server;
  const auto load =
      LoadOf(server, {"--streams", "1", "--particles", "100", "--rate", "0", "--no-ids"});
  EXPECT_EQ(load["ids"], false);
  EXPECT_GT(load["frames"], 0);
  EXPECT_EQ(load["late"], 0) << "nothing is ever due";
  EXPECT_EQ(load["watches"]["count"], 0);
}

TEST(Load, WhatCannotBeMeasuredIsTold) {
  const Ran nobody = RunPartiemc({"load", "--server", "127.0.0.1:1"});
  EXPECT_EQ(nobody.exit_code, 4);
  EXPECT_THAT(nobody.error, HasSubstr("no server at 127.0.0.1:1"));
  const ServerProgram server;
  const Ran no_metrics =
      RunPartiemc({"load", "--server", server.address(), "--metrics", "127.0.0.1:1"});
  EXPECT_EQ(no_metrics.exit_code, 4);
  EXPECT_THAT(no_metrics.error, HasSubstr("no metrics at 127.0.0.1:1"));
  EXPECT_EQ(RunPartiemc({"load", "--server", server.address(), "--metrics", "x"}).exit_code, 2);
  EXPECT_EQ(RunPartiemc({"load", "--streams", "0"}).exit_code, 2);
}

}  // namespace
}  // namespace partiemc::client
