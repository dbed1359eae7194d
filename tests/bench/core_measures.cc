#include "bench/core_measures.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"
#include "bench/allocations.h"
#include "bench/progress.h"
#include "support/random.h"

namespace partiemc::bench {
namespace {

// A repetition shall take some ten milliseconds at least, and play a scene once.
// A quick run plays half of it.
int IterationsOf(const Scene& scene, bool quick) {
  const auto particles = static_cast<int>(scene.ParticleCount());
  const auto frames = static_cast<int>(scene.frames.size());
  return std::max((quick ? 500'000 : 2'000'000) / particles, quick ? frames / 2 : frames);
}

// Work that shares nothing and touches no memory: what two threads gain on it is what this machine
// has to give at the moment.
void SpinInPieces(tbb::task_arena& arena) {
  constexpr int kPieces = 64;
  constexpr std::uint64_t kSteps = 1'000'000;
  arena.execute([&] {
    tbb::parallel_for(0, kPieces, [&](int piece) {
      support::Random random(piece);
      for (std::uint64_t k = 0; k < kSteps; ++k) benchmark::DoNotOptimize(random.Bits());
    });
  });
}

std::string WallCounter(Stage stage) { return std::string(Name(stage)) + "_wall_ms"; }
std::string CpuCounter(Stage stage) { return std::string(Name(stage)) + "_cpu_ms"; }

std::string WallAndCpu(Cost cost) {
  return absl::StrCat(Figure(cost.wall_ms), " / ", Figure(cost.cpu_ms));
}

}  // namespace

CoreMeasures::CoreMeasures(const ReferenceScenes& scenes, bool quick, Harness& harness)
    : harness_(harness) {
  AddCase(scenes.blob_10k, 3, true, true);
  AddCase(scenes.blob_100k, 3, true, true);
  AddCase(scenes.blob_1m, 3, true, true);
  if (!quick) {
    AddCase(scenes.blob_4m, 3, true, true);
    AddCase(scenes.blob_10k, 2, false, true);
    AddCase(scenes.blob_100k, 2, false, true);
    AddCase(scenes.blob_1m, 2, true, true);
  }
  AddCase(scenes.islands_1m, 3, false, false);
  AddCase(scenes.dam_break, 3, false, false);
  for (auto& measured : cases_) {
    Progress("warming up: " + measured->name);
    measured->stream->WarmUp();
    measured->stream_with_ids->WarmUp();
    const int iterations = IterationsOf(*measured->scene, quick);
    Register(*measured, iterations);
  }
  for (std::size_t k = 0; k < arenas_.size(); ++k) {
    harness_.Add(absl::StrCat("spin/", k + 1), 2, [this, k](benchmark::State& state) {
      for (auto _ : state) SpinInPieces(arenas_[k]);
    });
  }
}

void CoreMeasures::AddCase(const Scene& scene, int kernel_radius, bool two_threads,
                           bool with_floor) {
  auto measured = std::make_unique<Case>();
  measured->scene = &scene;
  measured->kernel_radius = kernel_radius;
  measured->name = kernel_radius == 3 ? scene.name : absl::StrCat(scene.name, "_r", kernel_radius);
  measured->two_threads = two_threads;
  measured->with_floor = with_floor;
  measured->stream = std::make_unique<CoreStream>(scene, ReferenceParameters(scene, kernel_radius));
  measured->ids = ShuffledIds(scene);
  measured->stream_with_ids =
      std::make_unique<CoreStream>(scene, ReferenceParameters(scene, kernel_radius), measured->ids);
  cases_.push_back(std::move(measured));
}

void CoreMeasures::Register(Case& measured, int iterations) {
  CoreStream& stream = *measured.stream;
  harness_.Add("frame/" + measured.name, iterations, [&stream](benchmark::State& state) {
    stream.stages().Clear();
    for (auto _ : state) stream.Next();
    for (std::size_t k = 0; k < kStageCount; ++k) {
      const auto stage = static_cast<Stage>(k);
      const Cost cost = stream.stages()[stage];
      state.counters[WallCounter(stage)] = {cost.wall_ms, benchmark::Counter::kAvgIterations};
      state.counters[CpuCounter(stage)] = {cost.cpu_ms, benchmark::Counter::kAvgIterations};
    }
  });
  harness_.Add("frame_with_ids/" + measured.name, iterations,
               [&with_ids = *measured.stream_with_ids](benchmark::State& state) {
                 for (auto _ : state) with_ids.Next();
               });
  if (measured.two_threads) {
    harness_.Add("frame_two_threads/" + measured.name, iterations,
                 [&stream](benchmark::State& state) {
                   for (auto _ : state) stream.Next(2);
                 });
  }
  if (measured.with_floor) {
    const auto xy = FloatPositions(*measured.scene);
    const LatticeBox box = LatticeBox::Around(xy, measured.kernel_radius + 1);
    harness_.Add("floor/" + measured.name, iterations,
                 [&measured, xy, box](benchmark::State& state) {
                   for (auto _ : state)
                     ScatterDensity(xy, box, measured.kernel_radius, measured.floor);
                 });
  }
}

Cost CoreMeasures::StageCost(const Case& measured, Stage stage) const {
  const std::string name = "frame/" + measured.name;
  return {harness_.MedianCounter(name, WallCounter(stage)),
          harness_.MedianCounter(name, CpuCounter(stage))};
}

void CoreMeasures::AddTo(Report& report) const {
  const Cost spin = harness_.Median("spin/1");
  const double available = spin.wall_ms / harness_.Median("spin/2").wall_ms;
  report.AddMetric("processor_share", spin.cpu_ms / spin.wall_ms, "ratio");
  report.AddMetric("two_threads_available", available, "ratio");
  for (const auto& measured : cases_) {
    const std::string& name = measured->name;
    const Cost frame = harness_.Median("frame/" + name);
    report.AddMetric("compute_ms_" + name, frame.wall_ms, "ms");
    report.AddMetric("compute_cpu_ms_" + name, frame.cpu_ms, "ms");
    report.AddMetric("particle_cpu_ns_" + name,
                     1e6 * frame.cpu_ms / static_cast<double>(measured->scene->ParticleCount()),
                     "ns");
    for (std::size_t k = 0; k < kStageCount; ++k) {
      const std::string stage(kStageNames[k]);
      const Cost cost = StageCost(*measured, static_cast<Stage>(k));
      report.AddMetric(stage + "_ms_" + name, cost.wall_ms, "ms");
      report.AddMetric(stage + "_cpu_ms_" + name, cost.cpu_ms, "ms");
    }
    // From positions to the field; the stage alone has the particles sorted already.
    const double stage_alone = StageCost(*measured, Stage::kField).cpu_ms;
    const double field = StageCost(*measured, Stage::kBins).cpu_ms + stage_alone;
    report.AddMetric("frame_over_field_" + name, frame.cpu_ms / field, "ratio");
    report.AddMetric("frame_over_field_stage_" + name, frame.cpu_ms / stage_alone, "ratio");
    report.AddMetric("ids_over_plain_" + name,
                     harness_.Median("frame_with_ids/" + name).cpu_ms / frame.cpu_ms, "ratio");
    report.AddMetric("ids_over_plain_state_" + name,
                     static_cast<double>(SerializedBytes(measured->stream_with_ids->state())) /
                         static_cast<double>(SerializedBytes(measured->stream->state())),
                     "ratio");
    if (measured->two_threads) {
      const Cost two = harness_.Median("frame_two_threads/" + name);
      report.AddMetric("compute_two_threads_ms_" + name, two.wall_ms, "ms");
      report.AddMetric("compute_two_threads_cpu_ms_" + name, two.cpu_ms, "ms");
      report.AddMetric("two_threads_cpu_overhead_" + name, two.cpu_ms / frame.cpu_ms, "ratio");
      const double speedup = frame.wall_ms / two.wall_ms;
      report.AddMetric("two_threads_speedup_" + name, speedup, "ratio");
      report.AddMetric("two_threads_efficiency_" + name, speedup / available, "ratio");
    }
    if (measured->with_floor) {
      const Cost floor = harness_.Median("floor/" + name);
      report.AddMetric("scatter_ms_" + name, floor.wall_ms, "ms");
      report.AddMetric("scatter_cpu_ms_" + name, floor.cpu_ms, "ms");
      report.AddMetric("field_over_scatter_" + name, field / floor.cpu_ms, "ratio");
      report.AddMetric("field_stage_over_scatter_" + name, stage_alone / floor.cpu_ms, "ratio");
    }
  }
  report.AddMetric("sparse_over_compact_1m",
                   report.Metric("compute_cpu_ms_islands_1m") / report.Metric("compute_cpu_ms_1m"),
                   "ratio");
  const auto field_cpu_ms = [&](const std::string& name) {
    return report.Metric("bins_cpu_ms_" + name) + report.Metric("field_cpu_ms_" + name);
  };
  report.AddMetric("sparse_field_over_compact_1m", field_cpu_ms("islands_1m") / field_cpu_ms("1m"),
                   "ratio");
  if (report.HasMetric("particle_cpu_ns_4m")) {
    report.AddMetric("particle_cpu_4m_over_100k",
                     report.Metric("particle_cpu_ns_4m") / report.Metric("particle_cpu_ns_100k"),
                     "ratio");
  }
  AddStageTable(report);
  AddFloorTable(report);
  AddIdTable(report);
  AddThreadTable(report);
}

void CoreMeasures::AddStageTable(Report& report) const {
  report.AddHeading("Stages");
  report.AddParagraph(
      "One frame in process, one thread, all outputs, milliseconds of wall clock / processor. A "
      "name without _r has a kernel radius of three spacings. islands_1m is a million particles in "
      "a thousand discs over ten thousand times their area; dam_break is the mean over its "
      "frames. The field of the last ratio but one is bins and field, from positions to values.");
  Report::Row head = {"scene", "particles"};
  head.insert(head.end(), kStageNames.begin(), kStageNames.end());
  head.insert(head.end(), {"frame", "frame / (bins + field)", "ns a particle"});
  std::vector<Report::Row> rows = {head};
  for (const auto& measured : cases_) {
    const auto particles = measured->scene->ParticleCount();
    const Cost frame = harness_.Median("frame/" + measured->name);
    Report::Row row = {measured->name, absl::StrCat(particles)};
    for (std::size_t k = 0; k < kStageCount; ++k) {
      row.push_back(WallAndCpu(StageCost(*measured, static_cast<Stage>(k))));
    }
    row.push_back(WallAndCpu(frame));
    row.push_back(Figure(report.Metric("frame_over_field_" + measured->name)));
    row.push_back(Figure(report.Metric("particle_cpu_ns_" + measured->name)));
    rows.push_back(row);
  }
  report.AddTable(rows);
}

void CoreMeasures::AddFloorTable(Report& report) const {
  report.AddHeading("Field against its floor");
  report.AddParagraph(absl::StrCat(
      "Floor: a counting sort by 32 x 32 tiles and a bare scatter of the density along the rows of "
      "one dense lattice, written for speed alone, with ",
      ScatterInstructionSet(),
      ". The ratio is that of processor time, from positions to the field on both sides: stages "
      "bins and field over the floor's sort and scatter. The bound is 1; the level set also needs "
      "checks, a list of tiles, and moments near the isoline. The last column is the stage field "
      "alone over the same floor: its particles are sorted, the floor's are not."));
  std::vector<Report::Row> rows = {{"scene", "floor, wall / processor ms",
                                    "bins + field, processor ms", "ratio", "field stage alone"}};
  for (const auto& measured : cases_) {
    if (!measured->with_floor) continue;
    rows.push_back({measured->name, WallAndCpu(harness_.Median("floor/" + measured->name)),
                    Figure(StageCost(*measured, Stage::kBins).cpu_ms +
                           StageCost(*measured, Stage::kField).cpu_ms),
                    Figure(report.Metric("field_over_scatter_" + measured->name)),
                    Figure(report.Metric("field_stage_over_scatter_" + measured->name))});
  }
  report.AddTable(rows);
}

void CoreMeasures::AddIdTable(Report& report) const {
  report.AddHeading("With ids");
  report.AddParagraph(
      "The same frames with ids: dense, in an order that is not that of the particles' places. "
      "Milliseconds of wall clock / processor; ratios are of processor time, and of the bytes of "
      "a checkpoint's state.");
  std::vector<Report::Row> rows = {{"scene", "without", "with", "ratio", "state"}};
  for (const auto& measured : cases_) {
    rows.push_back({measured->name, WallAndCpu(harness_.Median("frame/" + measured->name)),
                    WallAndCpu(harness_.Median("frame_with_ids/" + measured->name)),
                    Figure(report.Metric("ids_over_plain_" + measured->name)),
                    Figure(report.Metric("ids_over_plain_state_" + measured->name))});
  }
  report.AddTable(rows);
}

void CoreMeasures::AddThreadTable(Report& report) const {
  report.AddHeading("One thread against two");
  report.AddParagraph(
      "A whole frame in an arena of one and of two threads, milliseconds of wall clock / "
      "processor. "
      "The bound is 2, where two processors are free.");
  std::vector<Report::Row> rows = {
      {"scene", "one thread", "two threads", "speed-up", "efficiency"}};
  for (const auto& measured : cases_) {
    if (!measured->two_threads) continue;
    rows.push_back({measured->name, WallAndCpu(harness_.Median("frame/" + measured->name)),
                    WallAndCpu(harness_.Median("frame_two_threads/" + measured->name)),
                    Figure(report.Metric("two_threads_speedup_" + measured->name)),
                    Figure(report.Metric("two_threads_efficiency_" + measured->name))});
  }
  report.AddTable(rows);
}

void MeasureAllocations(const Scene& scene, Report& report) {
  Progress("allocations of warm frames");
  constexpr int kFrames = 40;
  CoreStream stream(scene, ReferenceParameters(scene));
  for (int k = 0; k < kFrames; ++k) stream.Next(2);
  StartCountingAllocations();
  for (int k = 0; k < kFrames; ++k) stream.Next(2);
  const Allocations counted = StopCountingAllocations();
  const auto per_frame = [](std::uint64_t count) { return static_cast<double>(count) / kFrames; };
  report.AddMetric("allocations_per_warm_frame", per_frame(counted.calls), "count");
  report.AddMetric("allocated_bytes_per_warm_frame", per_frame(counted.bytes), "bytes");
  report.AddMetric("tbb_allocations_per_warm_frame", per_frame(counted.tbb_calls), "count");
}

}  // namespace partiemc::bench
