// The core in this process: its stages, one thread against two, the floor under its field, and how
// often it allocates.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bench/core_stream.h"
#include "bench/harness.h"
#include "bench/report.h"
#include "bench/scatter_floor.h"
#include "bench/scenes.h"

namespace partiemc::bench {

class CoreMeasures {
 public:
  /// Both must outlive the measures.
  CoreMeasures(const ReferenceScenes& scenes, bool quick, Harness& harness);

  /// After the harness has run.
  void AddTo(Report& report) const;

 private:
  struct Case {
    const Scene* scene;
    int kernel_radius;
    std::string name;  // Of metrics: "1m", "1m_r2".
    bool two_threads;
    bool with_floor;
    std::unique_ptr<CoreStream> stream;
    std::vector<std::uint64_t> ids;
    std::unique_ptr<CoreStream> stream_with_ids;  // The same frames.
    ScatterBuffers floor;
  };

  void AddCase(const Scene& scene, int kernel_radius, bool two_threads, bool with_floor);
  void Register(Case& measured, int iterations);
  Cost StageCost(const Case& measured, Stage stage) const;
  void AddStageTable(Report& report) const;
  void AddFloorTable(Report& report) const;
  void AddIdTable(Report& report) const;
  void AddThreadTable(Report& report) const;

  Harness& harness_;
  std::vector<std::unique_ptr<Case>> cases_;
  std::array<oneapi::tbb::task_arena, 2> arenas_{oneapi::tbb::task_arena(1),
                                                 oneapi::tbb::task_arena(2)};
};

/// Counts allocations of warm frames on two threads. To be called while nothing else runs.
void MeasureAllocations(const Scene& scene, Report& report);

}  // namespace partiemc::bench
