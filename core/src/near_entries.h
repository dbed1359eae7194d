// The particles of a tile and of its neighbours that a step has to look at.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

#include "bins.h"
#include "cell_mask.h"
#include "lattice.h"

namespace partiemc {

/// Particles around a tile, in cells relative to it, one after the other.
struct NearEntries {
  static constexpr int kCapacity = 256;
  // A vector of chosen lanes is written whole.
  static constexpr int kPadding = 16;
  template <typename Value>
  using PerEntry = std::array<Value, kCapacity + kPadding>;

  PerEntry<float> x, y;
  PerEntry<std::uint32_t> entry;   ///< Index into ParticleBins::entries.
  PerEntry<std::uint32_t> source;  ///< Index in the frame.
  int count = 0;
};

/// A walk over the particles in cells of `mask`, or over all of a tile and its neighbours where it
/// is null. Cost: linear in the lists of those tiles in which the mask has cells.
class NearWalk {
 public:
  NearWalk(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask);

  /// Calls visit(const NearEntries&) for all in the order of the frame: a sum over them does not
  /// know of tiles.
  template <typename Visit>
  void InOrder(Visit visit) {
    if (list_count_ == 1) return InAnyOrder(visit);
    NearEntries near;
    for (StartMerging(); MergeNext(near);) visit(std::as_const(near));
  }

  /// The same in the order of the lists, which is cheaper.
  template <typename Visit>
  void InAnyOrder(Visit visit) {
    for (int k = 0; k < list_count_; ++k) {
      while (ChooseMore(lists_[k])) visit(std::as_const(lists_[k].chosen));
    }
  }

 private:
  // A tile's list, and those of it that are chosen and not yet merged.
  struct List {
    std::uint32_t next, end;
    BitRows cells;
    float shift_x, shift_y;
    NearEntries chosen;
    int merged;
  };
  static constexpr int kMaxLists = std::tuple_size_v<Neighbourhood>;

  bool ChooseMore(List& list) const;
  void StartMerging();
  bool MergeNext(NearEntries& near);
  void SetHead(int list);

  std::span<const BinEntry> entries_;
  std::array<List, kMaxLists> lists_;
  int list_count_ = 0;
  std::array<std::uint64_t, kMaxLists> heads_;  // By list: source and list of the next to merge.
};

}  // namespace partiemc
