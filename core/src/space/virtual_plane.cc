#include "space/virtual_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "base/parallel.h"

namespace partiemc::space {
namespace {

// Loops per task. The windows of a task are collected in one list.
constexpr std::size_t kLoopsAtOnce = 1024;

double Square(double value) { return value * value; }

/// B(d, reach) by squares.
double Window(double square, double reach_square) {
  return Square(std::max(0.0, 1 - square / reach_square));
}

/// max(0, cosine)^32: stops at edges.
double Agreement(double cosine) {
  double power = std::max(0.0, cosine);
  for (int k = 0; k < 5; ++k) power *= power;
  return power;
}

/// Links loops across faces.
void LinkLoops(const VirtualPlaneInput& input, VirtualPlaneScratch& scratch) {
  const SpaceCrossings& crossings = input.crossings;
  scratch.neighbour_first.resize(crossings.loop_count + 1);
  std::uint32_t total = 0;
  for (const ActiveCell& cell : crossings.cells) {
    const CellLoops& loops = LoopsOf(cell.corners);
    for (int loop = 0; loop < loops.loops; ++loop) {
      scratch.neighbour_first[cell.first_loop - crossings.edge_count + loop] =
          total + loops.first[loop];
    }
    total += static_cast<std::uint32_t>(loops.Steps());
  }
  scratch.neighbour_first.back() = total;
  scratch.neighbours.resize(total);
  ParallelFor(static_cast<std::uint32_t>(crossings.cells.size()), [&](std::uint32_t index) {
    const ActiveCell& cell = crossings.cells[index];
    const CellLoops& loops = LoopsOf(cell.corners);
    std::uint32_t next = scratch.neighbour_first[cell.first_loop - crossings.edge_count];
    for (int step = 0; step < loops.Steps(); ++step) {
      const int face = loops.face[step];
      const ActiveCell& other =
          crossings.cells[CellAcross(input.bricks, crossings, cell, face)];
      const CellLoops& across = LoopsOf(other.corners);
      const int from = EdgeAcross(loops.edge[loops.Next(step)], face);
      int reversed = 0;
      while (across.edge[reversed] != from || across.face[reversed] != (face ^ 1)) ++reversed;
      scratch.neighbours[next++] =
          other.first_loop - crossings.edge_count + across.loop_of[reversed];
    }
  });
}

/// Collects loops within a reach of a point that are linked to seeds by such loops. Kept from
/// window to window.
class WindowFinder {
 public:
  WindowFinder(const VirtualPlaneScratch& scratch, std::span<const Vec3> loops)
      : scratch_(scratch), loops_(loops), slots_(kFirstSlots, kNoIndex) {}

  /// Appends the window to `found`.
  void Find(const Vec3& centre, double reach, std::span<const std::uint32_t> seeds,
            std::vector<std::uint32_t>& found) {
    const std::size_t first = found.size();
    const double square = reach * reach;
    for (const std::uint32_t seed : seeds) Visit(seed, first, found);
    for (std::size_t k = first; k < found.size(); ++k) {
      const std::uint32_t loop = found[k];
      for (std::uint32_t n = scratch_.neighbour_first[loop]; n < scratch_.neighbour_first[loop + 1];
           ++n) {
        const std::uint32_t other = scratch_.neighbours[n];
        const Vec3 to = loops_[other] - centre;
        if (Dot(to, to) < square) Visit(other, first, found);
      }
    }
    for (std::size_t k = first; k < found.size(); ++k) slots_[SlotOf(found[k])] = kNoIndex;
    // Removal in any order leaves no chain behind, as all go.
    std::fill(slots_.begin(), slots_.end(), kNoIndex);
  }

 private:
  static constexpr std::size_t kFirstSlots = 1024;

  std::size_t SlotOf(std::uint32_t loop) const {
    std::size_t slot = loop * 0x9e3779b1u & (slots_.size() - 1);
    while (slots_[slot] != kNoIndex && slots_[slot] != loop) slot = (slot + 1) & (slots_.size() - 1);
    return slot;
  }
  void Visit(std::uint32_t loop, std::size_t first, std::vector<std::uint32_t>& found) {
    std::uint32_t& slot = slots_[SlotOf(loop)];
    if (slot == loop) return;
    slot = loop;
    found.push_back(loop);
    if (2 * (found.size() - first) < slots_.size()) return;
    slots_.assign(2 * slots_.size(), kNoIndex);
    for (std::size_t k = first; k < found.size(); ++k) slots_[SlotOf(found[k])] = found[k];
  }

  const VirtualPlaneScratch& scratch_;
  std::span<const Vec3> loops_;
  std::vector<std::uint32_t> slots_;
};

}  // namespace

}  // namespace partiemc::space
