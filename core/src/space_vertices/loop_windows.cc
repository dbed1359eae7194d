#include "space_vertices/loop_windows.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/parallel.h"
#include "space_vertices/window_sums.h"

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

/// Splits the loops of each brick into chunks.
void SplitLoops(const SpaceCrossings& crossings, LoopWindows& windows) {
  windows.chunk_count = 0;
  std::uint32_t begin = 0;
  const auto cells = static_cast<std::uint32_t>(crossings.cells.size());
  for (std::size_t brick = 1; brick <= crossings.bricks.size(); ++brick) {
    const std::uint32_t next =
        brick < crossings.bricks.size() ? crossings.bricks[brick].first_cell : cells;
    const std::uint32_t end = next < cells ? crossings.cells[next].first_loop - crossings.edge_count
                                           : crossings.loop_count;
    while (begin < end) {
      if (windows.chunk_count == windows.chunks.size()) windows.chunks.emplace_back();
      LoopWindows::Chunk& chunk = windows.chunks[windows.chunk_count++];
      chunk.begin = begin;
      chunk.end = begin = std::min(begin + LoopWindows::kMostLoopsOfChunk, end);
    }
  }
}

struct Box {
  Vec3 low, high;

  void Include(const Vec3& at) {
    low = {std::min(low.x, at.x), std::min(low.y, at.y), std::min(low.z, at.z)};
    high = {std::max(high.x, at.x), std::max(high.y, at.y), std::max(high.z, at.z)};
  }
  double SquareTo(const Vec3& at) const {
    const Vec3 to{std::max({0.0, low.x - at.x, at.x - high.x}),
                  std::max({0.0, low.y - at.y, at.y - high.y}),
                  std::max({0.0, low.z - at.z, at.z - high.z})};
    return Dot(to, to);
  }
};

/// Finds the windows of the loops of a chunk: those within reach to which links lead.
class ChunkSearch {
 public:
  ChunkSearch(const LoopWindows& windows, std::span<const Vec3> centres,
              std::span<const float> sizes, double reach, LoopWindows::Chunk& chunk)
      : windows_(windows),
        centres_(centres),
        sizes_(sizes),
        square_(reach * reach),
        chunk_(chunk) {}

  void Find() {
    FindNear();
    FindLinks();
    LoadPlaces();
    const std::size_t words = chunk_.Words();
    chunk_.self.clear();
    chunk_.bits.assign((chunk_.end - chunk_.begin) * words, 0);
    for (std::uint32_t loop = chunk_.begin; loop < chunk_.end; ++loop) {
      chunk_.self.push_back(static_cast<std::uint16_t>(IndexOf(loop)));
      FindWindow(chunk_.self.back(), SquareOf(loop),
                 chunk_.bits.data() + (loop - chunk_.begin) * words);
    }
  }

 private:
  static constexpr std::size_t kSlots = 4096;
  static_assert(kSlots >= 2 * LoopWindows::kMostNear);
  static constexpr std::uint16_t kFree = 0xffff;

  /// The slot of a loop, or the free slot where it belongs.
  std::size_t SlotOf(std::uint32_t loop) const {
    std::size_t slot = (loop * 0x9e3779b1u) >> 20;
    while (slots_[slot] != kFree && chunk_.near[slots_[slot]] != loop) slot = (slot + 1) % kSlots;
    return slot;
  }
  std::uint16_t IndexOf(std::uint32_t loop) const { return slots_[SlotOf(loop)]; }

  /// The squared reach of the window of a loop.
  double SquareOf(std::uint32_t loop) const {
    return sizes_.empty() ? square_ : square_ * double{sizes_[loop]} * double{sizes_[loop]};
  }

  /// Finds the loops within reach of the box around the chunk.
  void FindNear() {
    std::vector<std::uint32_t>& near = chunk_.near;
    near.clear();
    slots_.fill(kFree);
    Box box{centres_[chunk_.begin], centres_[chunk_.begin]};
    double square = SquareOf(chunk_.begin);
    for (std::uint32_t loop = chunk_.begin; loop < chunk_.end; ++loop) {
      box.Include(centres_[loop]);
      square = std::max(square, SquareOf(loop));
      Add(loop);
    }
    for (std::size_t k = 0; k < near.size(); ++k) {
      for (std::uint32_t n = windows_.link_first[near[k]]; n < windows_.link_first[near[k] + 1];
           ++n) {
        const std::uint32_t to = windows_.links[n];
        if (near.size() < LoopWindows::kMostNear && box.SquareTo(centres_[to]) < square) Add(to);
      }
    }
    std::sort(near.begin(), near.end());
    slots_.fill(kFree);
    for (std::size_t k = 0; k < near.size(); ++k) {
      slots_[SlotOf(near[k])] = static_cast<std::uint16_t>(k);
    }
  }
  void Add(std::uint32_t loop) {
    std::uint16_t& slot = slots_[SlotOf(loop)];
    if (slot != kFree) return;
    slot = static_cast<std::uint16_t>(chunk_.near.size());
    chunk_.near.push_back(loop);
  }

  /// Finds the links between near loops.
  void FindLinks() {
    chunk_.first.clear();
    chunk_.links.clear();
    for (const std::uint32_t loop : chunk_.near) {
      const std::size_t first = chunk_.links.size();
      chunk_.first.push_back(static_cast<std::uint16_t>(first));
      for (std::uint32_t n = windows_.link_first[loop]; n < windows_.link_first[loop + 1]; ++n) {
        const std::uint16_t to = IndexOf(windows_.links[n]);
        if (to == kFree) continue;
        const std::uint32_t word = to / kWordBits, bit = std::uint32_t{1} << to % kWordBits;
        std::size_t k = first;
        while (k < chunk_.links.size() && chunk_.links[k].word != word) ++k;
        if (k == chunk_.links.size()) chunk_.links.push_back({word, 0});
        chunk_.links[k].bits |= bit;
      }
    }
    chunk_.first.push_back(static_cast<std::uint16_t>(chunk_.links.size()));
  }

  void LoadPlaces() {
    const Vec3 origin = centres_[chunk_.begin];
    std::size_t k = 0;
    for (const std::uint32_t loop : chunk_.near) {
      const Vec3 at = centres_[loop] - origin;
      places_.x[k] = static_cast<float>(at.x);
      places_.y[k] = static_cast<float>(at.y);
      places_.z[k++] = static_cast<float>(at.z);
    }
    constexpr float kFar = 1e9f;
    for (; k % kWordBits != 0; ++k) places_.x[k] = places_.y[k] = places_.z[k] = kFar;
  }

  /// Sets the bits of the window of a near loop. Requires: they are 0.
  void FindWindow(std::uint16_t loop, double square, std::uint32_t* found) {
    const std::size_t words = chunk_.Words();
    FindWithin(places_, words, loop, static_cast<float>(square), within_.data());
    std::fill_n(done_.begin(), words, 0u);
    found[loop / kWordBits] |= std::uint32_t{1} << loop % kWordBits;
    // Alternate directions reach all loops in few passes.
    for (bool is_up = true, has_new = true; has_new; is_up = !is_up) {
      has_new = false;
      for (std::size_t k = 0; k < words; ++k) {
        const std::size_t word = is_up ? k : words - 1 - k;
        while (const std::uint32_t fresh = found[word] & ~done_[word]) {
          has_new = true;
          done_[word] |= fresh;
          Follow(word, fresh, found);
        }
      }
    }
  }

  /// Follows the links from loops of a word.
  void Follow(std::size_t word, std::uint32_t from, std::uint32_t* found) {
    for (; from != 0; from &= from - 1) {
      const std::size_t loop = kWordBits * word + static_cast<std::size_t>(std::countr_zero(from));
      for (std::size_t n = chunk_.first[loop]; n < chunk_.first[loop + 1]; ++n) {
        const LoopWindows::Link& link = chunk_.links[n];
        found[link.word] |= link.bits & within_[link.word];
      }
    }
  }

  static constexpr std::size_t kWordBits = LoopWindows::kWordBits;

  const LoopWindows& windows_;
  std::span<const Vec3> centres_;
  std::span<const float> sizes_;
  const double square_;
  LoopWindows::Chunk& chunk_;
  std::array<std::uint16_t, kSlots> slots_;
  NearLoops places_;  // Centres only.
  std::array<std::uint32_t, LoopWindows::kMostNear / kWordBits> within_, done_;
};

}  // namespace

void FindWindows(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                 std::span<const Vec3> centres, double reach, LoopWindows& windows,
                 std::span<const float> sizes) {
  windows.loop_count = crossings.loop_count;
  LinkLoops(bricks, crossings, windows);
  SplitLoops(crossings, windows);
  ParallelFor(windows.chunk_count, [&](std::size_t index) {
    ChunkSearch(windows, centres, sizes, reach, windows.chunks[index]).Find();
  });
}

}  // namespace partiemc::space
