#include "space_vertices/loop_windows.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"

namespace partiemc::space {
namespace {

/// Links the loops of each cell with the loops of its neighbours.
void LinkLoops(const BrickDirectory& bricks, const SpaceCrossings& crossings,
               LoopWindows& windows) {
  windows.link_first.resize(windows.loop_count + 1);
  std::uint32_t total = 0;
  for (const ActiveCell& cell : crossings.cells) {
    const CellLoops& loops = LoopsOf(cell.corners);
    for (int loop = 0; loop < loops.loops; ++loop) {
      windows.link_first[cell.first_loop - crossings.edge_count + loop] = total + loops.first[loop];
    }
    total += static_cast<std::uint32_t>(loops.Steps());
  }
  windows.link_first.back() = total;
  windows.links.resize(total);
  ParallelFor(static_cast<std::uint32_t>(crossings.cells.size()), [&](std::uint32_t index) {
    const ActiveCell& cell = crossings.cells[index];
    const CellLoops& loops = LoopsOf(cell.corners);
    std::uint32_t next = windows.link_first[cell.first_loop - crossings.edge_count];
    for (int step = 0; step < loops.Steps(); ++step) {
      const int face = loops.face[step];
      const ActiveCell& other = crossings.cells[CellAcross(bricks, crossings, cell, face)];
      const CellLoops& across = LoopsOf(other.corners);
      // In the other cell, the curve runs in the opposite direction.
      const int from = EdgeAcross(loops.edge[loops.Next(step)], face);
      int reversed = 0;
      while (across.edge[reversed] != from || across.face[reversed] != (face ^ 1)) ++reversed;
      windows.links[next++] = other.first_loop - crossings.edge_count + across.loop_of[reversed];
    }
  });
}

/// Breadth-first search from loop to loop.
class WindowSearch {
 public:
  WindowSearch(const LoopWindows& windows, std::span<const Vec3> centres, double reach,
               LoopWindows::Chunk& chunk)
      : windows_(windows), centres_(centres), square_(reach * reach), chunk_(chunk) {
    chunk_.slots.assign(kSlots, kNoIndex);
  }

  /// Appends the window of a loop.
  void Append(std::uint32_t loop) {
    std::vector<std::uint32_t>& found = chunk_.loops;
    const std::size_t first = found.size();
    Visit(loop);
    for (std::size_t k = first; k < found.size(); ++k) {
      const std::uint32_t from = found[k];
      for (std::uint32_t n = windows_.link_first[from]; n < windows_.link_first[from + 1]; ++n) {
        const Vec3 to = centres_[windows_.links[n]] - centres_[loop];
        if (!(Dot(to, to) < square_)) continue;
        if (found.size() - first < LoopWindows::kMostLoopsOfWindow) Visit(windows_.links[n]);
      }
    }
    for (int k = 0; k < used_count_; ++k) chunk_.slots[used_[k]] = kNoIndex;
    used_count_ = 0;
  }

 private:
  static constexpr std::size_t kSlots = 1024;
  static_assert(kSlots > 2 * LoopWindows::kMostLoopsOfWindow);

  void Visit(std::uint32_t loop) {
    std::size_t slot = (loop * 0x9e3779b1u) >> 22;
    while (chunk_.slots[slot] != kNoIndex) {
      if (chunk_.slots[slot] == loop) return;
      slot = (slot + 1) % kSlots;
    }
    chunk_.slots[slot] = loop;
    used_[used_count_++] = static_cast<std::uint16_t>(slot);
    chunk_.loops.push_back(loop);
  }

  const LoopWindows& windows_;
  std::span<const Vec3> centres_;
  const double square_;
  LoopWindows::Chunk& chunk_;
  std::array<std::uint16_t, LoopWindows::kMostLoopsOfWindow> used_;
  int used_count_ = 0;
};

}  // namespace

void FindWindows(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                 std::span<const Vec3> centres, double reach, LoopWindows& windows) {
  windows.loop_count = crossings.loop_count;
  LinkLoops(bricks, crossings, windows);
  const std::size_t count = windows.ChunkCount();
  if (windows.chunks.size() < count) windows.chunks.resize(count);
  ParallelFor(count, [&](std::size_t index) {
    LoopWindows::Chunk& chunk = windows.chunks[index];
    chunk.first.clear();
    chunk.loops.clear();
    WindowSearch search(windows, centres, reach, chunk);
    const std::size_t first = index * LoopWindows::kLoopsAtOnce;
    const std::size_t last = std::min(first + LoopWindows::kLoopsAtOnce, windows.loop_count);
    for (std::size_t loop = first; loop < last; ++loop) {
      chunk.first.push_back(static_cast<std::uint32_t>(chunk.loops.size()));
      search.Append(static_cast<std::uint32_t>(loop));
    }
    chunk.first.push_back(static_cast<std::uint32_t>(chunk.loops.size()));
  });
}

}  // namespace partiemc::space
