// Weighted sums over windows of loops, in vectors. Every instruction set gives the same bits,
// because the order of each sum is fixed. Symbols are as in loop_filters.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/vec3.h"
#include "space_vertices/loop_windows.h"

namespace partiemc::space {

/// The centres of the loops near a chunk of LoopWindows, relative to one of them.
struct NearPlaces {
  static constexpr std::size_t kMost = LoopWindows::kMostNear;

  alignas(64) std::array<float, kMost> x, y, z;
};

/// The loops near a chunk of LoopWindows. About 64 kB.
struct NearLoops : NearPlaces {
  std::array<float, kMost> area;
  std::array<float, kMost> normal_x, normal_y, normal_z;
  std::array<float, kMost> base;  ///< For SumPlanes only.
};

/// The squared reaches of the loops of a chunk, which are the first `count` near loops; then 0.
struct WindowEnds {
  std::size_t count = 0;
  alignas(64) std::array<float, LoopWindows::kMostLoopsOfChunk> square;
};

/// Sets bit w of within[k] if the squared distance between the near loops k and w is below
/// ends.square[w]. `count`: the number of near loops. Cost: `count` times `ends.count`.
void FindWithin(const NearPlaces& places, std::size_t count, const WindowEnds& ends,
                std::uint64_t* within);

/// A loop and its window: one bit for each near loop.
struct Window {
  std::span<const std::uint32_t> bits;
  std::size_t self;      ///< The index of the loop among the near loops.
  float inverse_square;  ///< 1 / reach^2.
};

/// sum w n_j. The weight w is as for kAtEdges if `stops_at_edges`.
Vec3 SumNormals(const NearLoops& loops, const Window& window, bool stops_at_edges);

struct BendSums {
  double turn = 0;  ///< sum w (n_j - n_i) . t, with the tangential part t of c_j - c_i.
  double way = 0;   ///< sum w t . t
};
BendSums SumBends(const NearLoops& loops, const Window& window);

struct PlaneSums {
  double height = 0;  ///< sum w ((n_i + n_j) / 2 . (c_j - c_i) + base_j), w as for kAtEdges.
  double total = 0;   ///< sum w
};
PlaneSums SumPlanes(const NearLoops& loops, const Window& window);

}  // namespace partiemc::space
