#include "bench/summary.h"

#include <sched.h>

#include "absl/strings/str_cat.h"

namespace partiemc::bench {
namespace {

struct Line {
  const char* metric;
  const char* bound;
  const char* meaning;
};

// What is wanted of the method on two processors.
constexpr Line kLines[] = {
    {"end_to_end_ms_1m", "at most 25", "a frame of a million particles through a server, TCP"},
    {"end_to_end_ms_100k", "at most 5", "of a hundred thousand"},
    {"end_to_end_ms_10k", "at most 1.5", "of ten thousand"},
    {"compute_two_threads_ms_1m", "at most 16", "a million in process, two threads"},
    {"compute_ms_1m", "", "one thread"},
    {"compute_cpu_ms_1m", "", "processor time of that"},
    {"field_over_scatter_1m", "at most 1.5", "positions to field: bins and field over the floor"},
    {"frame_over_field_1m", "at most 2", "whole frame over its bins and field"},
    {"field_vs_vtk_sph_1m", "at least 60", "bins and field, times faster than vtkSPHInterpolator"},
    {"contours_vs_vtk_1024", "at least 4", "crossings and rings, times faster than VTK's isolines"},
    {"two_threads_speedup_1m", "at least 1.6", "one thread over two"},
    {"particle_cpu_4m_over_100k", "at most 1.5", "processor time of a particle, 4M over 100k"},
    {"sparse_field_over_compact_1m", "at most 3",
     "a thousand islands over one blob, bins and field"},
    {"sparse_over_compact_1m", "at most 5", "the same, whole frame"},
    {"ids_over_plain_1m", "at most 1.15", "a million with ids over without, whole frame"},
    {"ids_over_plain_islands_1m", "at most 1.15", "the same, a thousand islands"},
    {"allocations_per_warm_frame", "0", "calls of malloc by the core"},
    {"server_peak_mb_1m", "at most 200", "peak memory of the server"},
    {"server_growth_mb_1m", "0",
     "what it grows by from the first tenth of a thousand frames to the last"},
};

std::string InstructionSet() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return "x86-64 with AVX-512";
  if (__builtin_cpu_supports("avx2")) return "x86-64 with AVX2";
  return "x86-64";
#elif defined(__aarch64__)
  return "AArch64";
#else
  return "another instruction set";
#endif
}

}  // namespace

std::string DescribeMachine() {
  cpu_set_t processors;
  CPU_ZERO(&processors);
  sched_getaffinity(0, sizeof(processors), &processors);
  return absl::StrCat(CPU_COUNT(&processors), " processors, ", InstructionSet(), ", compiled by ",
#ifdef __clang__
                      "Clang ", __clang_major__
#else
                      "GCC ", __GNUC__
#endif
  );
}

Report Summarise(const Report& report, bool quick, int repetitions) {
  Report opening;
  opening.AddParagraph("# Benchmark");
  opening.AddParagraph(absl::StrCat(
      DescribeMachine(), ". ", quick ? "A quick run: medians of " : "Medians of ", repetitions,
      " repetitions, those in one process taken in random order. Milliseconds are a machine's own; "
      "ratios are between things measured in this run. Other programs left a single thread ",
      Figure(100 * report.Metric("processor_share")),
      " % of a processor: below 95 %, wall-clock times are too long by as much, and so is "
      "everything "
      "end to end. tests/bench/README.md tells how to read the rest."));
  std::vector<Report::Row> rows = {{"metric", "value", "wanted", "what it is"}};
  for (const Line& line : kLines) {
    if (!report.HasMetric(line.metric)) continue;  // A quick run leaves some out.
    rows.push_back({line.metric, Figure(report.Metric(line.metric)), line.bound, line.meaning});
  }
  opening.AddTable(rows);
  return opening;
}

}  // namespace partiemc::bench
