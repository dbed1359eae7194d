#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "absl/strings/str_cat.h"
#include "bench/core_measures.h"
#include "bench/expectations.h"
#include "bench/harness.h"
#include "bench/peer_measures.h"
#include "bench/progress.h"
#include "bench/report.h"
#include "bench/scenes.h"
#include "bench/service_measures.h"
#include "bench/summary.h"

namespace partiemc::bench {
namespace {

struct Options {
  std::string output, check, refresh;
  bool quick = false;
};

Report Measure(bool quick, int repetitions) {
  Progress("making scenes");
  const ReferenceScenes scenes = Require(MakeReferenceScenes(quick));
  Report report;
  {
    Harness harness(repetitions);
    const CoreMeasures core(scenes, quick, harness);
    const PeerMeasures peers(scenes, quick, harness);
    harness.Run();
    core.AddTo(report);
    peers.AddTo(report);
  }
  MeasureAllocations(scenes.blob_100k, report);
  MeasureEndToEnd(scenes, quick, report);
  MeasureServerMemory(scenes, quick, report);
  return report;
}

int Run(const Options& options) {
  const int repetitions = options.quick ? 3 : 5;
  const double begin = WallMs();
  const Report report = Measure(options.quick, repetitions);
  Require(report.Write(options.output, Summarise(report, options.quick, repetitions)));
  Progress(absl::StrCat("done in ", static_cast<int>((WallMs() - begin) / 1000), " s, see ",
                        options.output, "/bench.md"));
  std::fputc('\n', stderr);
  if (!options.refresh.empty()) Require(RefreshExpectations(options.refresh, report));
  if (options.check.empty()) return 0;
  const auto failures = Failures(Require(ReadExpectations(options.check)), report);
  for (const std::string& failure : failures) std::printf("bench: %s\n", failure.c_str());
  return failures.empty() ? 0 : 3;
}

}  // namespace
}  // namespace partiemc::bench

int main(int argc, char** argv) {
  partiemc::bench::Options options;
  CLI::App app("Measures PartiEMC; tests/bench/run.sh builds and calls it.", "partiemc-bench");
  app.add_option("--output", options.output, "Folder for bench.md and bench.csv")->required();
  app.add_flag("--quick", options.quick, "Fewer repetitions and cases");
  app.add_option("--check", options.check,
                 "File of recorded ratios; exit code 3 where one is worse")
      ->check(CLI::ExistingFile);
  app.add_option("--refresh", options.refresh, "Write this run's ratios into this file")
      ->check(CLI::ExistingFile);
  CLI11_PARSE(app, argc, argv);
  try {
    return partiemc::bench::Run(options);
  } catch (const partiemc::bench::Failure& failure) {
    std::fprintf(stderr, "\nbench: %s\n", failure.what());
    return 1;
  }
}
