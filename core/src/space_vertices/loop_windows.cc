#include "space_vertices/loop_windows.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "base/parallel.h"
#include "space_vertices/window_sums.h"

namespace partiemc::space {
namespace {

/// Links the loops of each cell with the loops of its neighbours.
void LinkLoops(const BrickDirectory& bricks, const SpaceCrossings& crossings,
               LoopWindows& windows) {
  windows.links.resize(crossings.step_edges.size());
  ParallelFor(static_cast<std::uint32_t>(crossings.cells.size()), [&](std::uint32_t index) {
    const ActiveCell& cell = crossings.cells[index];
    const CellLoops& loops = LoopsOf(cell.corners);
    std::uint32_t next = crossings.FirstStepOf(cell);
    for (int step = 0; step < loops.Steps(); ++step) {
      const int face = loops.face[step];
      const ActiveCell& other = crossings.cells[CellAcross(bricks, crossings, cell, face)];
      const int edge = EdgeAcross(loops.edge[step], face);
      windows.links[next++] =
          other.first_loop - crossings.edge_count + LoopsOf(other.corners).loop_of_edge[edge];
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
    low = Lower(low, at);
    high = Upper(high, at);
  }
  double SquareTo(const Vec3& at) const {
    const Vec3 to{std::max({0.0, low.x - at.x, at.x - high.x}),
                  std::max({0.0, low.y - at.y, at.y - high.y}),
                  std::max({0.0, low.z - at.z, at.z - high.z})};
    return Dot(to, to);
  }
};

/// Transposes a matrix of bits.
void Transpose(std::array<std::uint64_t, 64>& rows) {
  std::uint64_t mask = 0xffffffff;
  for (std::size_t by = 32; by != 0; by >>= 1, mask ^= mask << by) {
    for (std::size_t row = 0; row < 64; row = (row + by + 1) & ~by) {
      const std::uint64_t swapped = ((rows[row] >> by) ^ rows[row + by]) & mask;
      rows[row] ^= swapped << by;
      rows[row + by] ^= swapped;
    }
  }
}

/// Finds the windows of the loops of a chunk. All windows grow at once: each near loop has a set of
/// windows that it belongs to, as a word with one bit for each loop of the chunk.
class ChunkSearch {
 public:
  ChunkSearch(std::span<const std::uint32_t> first_step, std::span<const std::uint32_t> links,
              std::span<const Vec3> centres, std::span<const float> sizes, double reach,
              LoopWindows::Chunk& chunk)
      : first_step_(first_step),
        links_between_(links),
        centres_(centres),
        sizes_(sizes),
        square_(reach * reach),
        chunk_(chunk) {}

  void Find() {
    FindNear();
    LoadPlaces();
    FindWithin(places_, count_, ends_, within_.data());
    GrowWindows();
    SortNear();
    StoreWindows();
  }

 private:
  static constexpr std::size_t kSlots = 4096;
  static_assert(kSlots >= 2 * LoopWindows::kMostNear);
  static constexpr std::uint16_t kFree = 0xffff;
  static_assert(LoopWindows::kMostLoopsOfChunk <= 64, "a word has a bit for each loop of a chunk");

  /// The slot of a loop, or the free slot where it belongs.
  std::size_t SlotOf(std::uint32_t loop) const {
    std::size_t slot = (loop * 0x9e3779b1u) >> 20;
    while (slots_[slot] != kFree && near_[slots_[slot]] != loop) slot = (slot + 1) % kSlots;
    return slot;
  }

  /// The squared reach of the window of a loop.
  double SquareOf(std::uint32_t loop) const {
    return sizes_.empty() ? square_ : square_ * double{sizes_[loop]} * double{sizes_[loop]};
  }

  /// Finds the near loops, breadth first, and the links between them. The near loops are the loops
  /// of the chunk, then the loops linked to them within reach of the box around the chunk.
  void FindNear() {
    count_ = 0;
    slots_.fill(kFree);
    Box box{centres_[chunk_.begin], centres_[chunk_.begin]};
    double square = SquareOf(chunk_.begin);
    for (std::uint32_t loop = chunk_.begin; loop < chunk_.end; ++loop) {
      box.Include(centres_[loop]);
      square = std::max(square, SquareOf(loop));
      Add(loop, SlotOf(loop));
    }
    std::size_t links = 0;
    for (std::size_t k = 0; k < count_; ++k) {
      first_[k] = static_cast<std::uint16_t>(links);
      for (std::uint32_t n = first_step_[near_[k]]; n < first_step_[near_[k] + 1]; ++n) {
        const std::uint32_t to = links_between_[n];
        const std::size_t slot = SlotOf(to);
        if (slots_[slot] == kFree) {
          if (count_ == LoopWindows::kMostNear || !(box.SquareTo(centres_[to]) < square)) continue;
          Add(to, slot);
        }
        links_[links++] = slots_[slot];
      }
    }
    first_[count_] = static_cast<std::uint16_t>(links);
  }
  void Add(std::uint32_t loop, std::size_t slot) {
    slots_[slot] = static_cast<std::uint16_t>(count_);
    near_[count_++] = loop;
  }

  void LoadPlaces() {
    const Vec3 origin = centres_[chunk_.begin];
    for (std::size_t k = 0; k < count_; ++k) {
      const Vec3 at = centres_[near_[k]] - origin;
      places_.x[k] = static_cast<float>(at.x);
      places_.y[k] = static_cast<float>(at.y);
      places_.z[k] = static_cast<float>(at.z);
    }
    ends_.count = chunk_.end - chunk_.begin;
    ends_.square.fill(0);
    for (std::uint32_t loop = chunk_.begin; loop < chunk_.end; ++loop) {
      ends_.square[loop - chunk_.begin] = static_cast<float>(SquareOf(loop));
    }
  }

  /// Follows the links until no window grows.
  void GrowWindows() {
    std::fill_n(found_.begin(), count_, std::uint64_t{0});
    for (std::size_t k = 0; k < ends_.count; ++k) found_[k] = std::uint64_t{1} << k;
    // FindNear has listed the near loops by their number of links from the chunk. Therefore a few
    // passes in alternating directions reach all of them.
    for (bool is_up = true, has_grown = true; has_grown; is_up = !is_up) {
      has_grown = false;
      for (std::size_t n = 0; n < count_; ++n) {
        const std::size_t k = is_up ? n : count_ - 1 - n;
        const std::uint64_t missing = within_[k] & ~found_[k];
        if (missing == 0) continue;
        std::uint64_t beside = 0;
        for (std::size_t link = first_[k]; link < first_[k + 1]; ++link) {
          beside |= found_[links_[link]];
        }
        found_[k] |= beside & missing;
        has_grown = has_grown || (beside & missing) != 0;
      }
    }
  }

  /// Sorts the near loops; sets `chunk_.near`, `chunk_.self` and `sorted_`.
  void SortNear() {
    for (std::size_t k = 0; k < count_; ++k) sorted_[k] = std::uint64_t{near_[k]} << 32 | k;
    std::sort(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(count_));
    chunk_.near.resize(count_);
    chunk_.self.resize(ends_.count);
    for (std::size_t k = 0; k < count_; ++k) {
      chunk_.near[k] = static_cast<std::uint32_t>(sorted_[k] >> 32);
      const std::size_t from = IndexOf(sorted_[k]);
      if (from < ends_.count) chunk_.self[from] = static_cast<std::uint16_t>(k);
    }
  }
  static std::size_t IndexOf(std::uint64_t sorted) { return sorted & 0xffffffff; }

  void StoreWindows() {
    const std::size_t words = chunk_.Words();
    chunk_.bits.resize(ends_.count * words);
    for (std::size_t word = 0; word < words; word += 2) {
      std::array<std::uint64_t, 64> rows{};
      const std::size_t first = word * LoopWindows::kWordBits;
      for (std::size_t k = first; k < std::min(first + 64, count_); ++k) {
        rows[k - first] = found_[IndexOf(sorted_[k])];
      }
      Transpose(rows);
      for (std::size_t loop = 0; loop < ends_.count; ++loop) {
        std::uint32_t* const to = chunk_.bits.data() + loop * words + word;
        to[0] = static_cast<std::uint32_t>(rows[loop]);
        if (word + 1 < words) to[1] = static_cast<std::uint32_t>(rows[loop] >> 32);
      }
    }
  }

  template <typename Value>
  using PerNear = std::array<Value, LoopWindows::kMostNear>;

  std::span<const std::uint32_t> first_step_, links_between_;
  std::span<const Vec3> centres_;
  std::span<const float> sizes_;
  const double square_;
  LoopWindows::Chunk& chunk_;

  std::array<std::uint16_t, kSlots> slots_;
  std::size_t count_ = 0;  // Of near loops.
  PerNear<std::uint32_t> near_;
  // The links of near loop k are [first_[k], first_[k + 1]).
  std::array<std::uint16_t, LoopWindows::kMostNear + 1> first_;
  std::array<std::uint16_t, LoopWindows::kMostNear * kMostCrossings> links_;
  NearPlaces places_;
  WindowEnds ends_;
  PerNear<std::uint64_t> within_, found_;
  PerNear<std::uint64_t> sorted_;  // Near loops (high half) and their indices in `near_`, sorted.
};

}  // namespace

void FindWindows(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                 std::span<const Vec3> centres, double reach, LoopWindows& windows,
                 std::span<const float> sizes) {
  LinkLoops(bricks, crossings, windows);
  SplitLoops(crossings, windows);
  ParallelFor(windows.chunk_count, [&](std::size_t index) {
    ChunkSearch(crossings.first_step, windows.links, centres, sizes, reach, windows.chunks[index])
        .Find();
  });
}

}  // namespace partiemc::space
