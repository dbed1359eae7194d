// partiemc-bench: the core and its peers under Google Benchmark. Its flags are Google Benchmark's
// own, and --quick, which leaves out the scene of four million particles and the surfaces.
#include <benchmark/benchmark.h>

#include <string_view>

#include "bench/measures.h"
#include "bench/require.h"

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const bool quick = argc == 2 && std::string_view(argv[1]) == "--quick";
  if (!quick && benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  const auto scenes = partiemc::bench::Require(partiemc::bench::MakeScenes(quick));
  partiemc::bench::RegisterCore(scenes);
  partiemc::bench::RegisterMatter();
  partiemc::bench::RegisterPeers(scenes);
  if (!quick) partiemc::bench::RegisterSurfaces();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
