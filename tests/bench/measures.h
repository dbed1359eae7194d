// The measures of the benchmark. Each function registers some of them with Google Benchmark; run.py
// computes the ratios from the least times of the repetitions.
#pragma once

#include <benchmark/benchmark.h>

#include <string>
#include <utility>

#include "bench/scenes.h"

namespace partiemc::bench {

/// Registers `body` for repetitions of `iterations` each. Its times are wall-clock time and the
/// processor time of all threads.
template <typename Body>
void Register(const std::string& name, int iterations, Body body) {
  benchmark::RegisterBenchmark(name.c_str(), std::move(body))
      ->Iterations(iterations)
      ->Unit(benchmark::kMillisecond)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

/// Registers measures of the core:
///   "frame/SCENE", "frame_with_ids/SCENE", "frame_two_threads/SCENE": whole frames; the stages are
///       counters
///   "floor/SCENE": the floor below the field
///   "allocations/100k": allocations of a warm frame
///   "spin/1", "spin/2": work that shares nothing, on one and two threads, as a measure of the
///   machine
void RegisterCore(const Scenes& scenes);

/// Registers "matter/CASE" for sizes, grains, phases, walls, periodic boxes and the noise filter: a
/// warm frame on one thread. Counter: particles. All cases are made from the blob of 100,000
/// particles, of which "frame/100k" is a frame without them.
void RegisterMatter();

/// Registers "surface/SCENE/PLACEMENT/THREADS": a warm frame in space. Counter: triangles.
void RegisterSurfaces();

/// Registers VTK and our stages that do the same work: "vtk_sph/1m"; "contours/1024",
/// "linear_contours/1024", "vtk_contours/1024"; "fill/1024", "vtk_fill/1024".
void RegisterPeers(const Scenes& scenes);

}  // namespace partiemc::bench
