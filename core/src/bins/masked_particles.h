// Walks over the particles in selected cells of a tile and its neighbours.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

#include "bins/bins.h"
#include "bins/cell_mask.h"
#include "bins/lattice.h"

namespace partiemc {

/// A block of particles, in cells relative to the tile.
struct ParticleBlock {
  static constexpr int kCapacity = 512;
  // Vectors of selected lanes are written whole.
  static constexpr int kPadding = 16;
  template <typename Value>
  using PerParticle = std::array<Value, kCapacity + kPadding>;

  PerParticle<float> x, y;
  PerParticle<std::uint32_t> particle;  ///< Index into ParticleBins::particles.
  int count = 0;
};

/// A walk over the particles in the cells of `mask`, or over all particles of a tile and its
/// neighbours if it is null. Cost: linear in the lists of the tiles in which the mask has cells.
class MaskedParticles {
 public:
  /// The rest of a tile's list: its particles in `cells`, to be shifted.
  struct List {
    std::uint32_t next, end;
    BitRows cells;
    float shift_x, shift_y;
  };

  MaskedParticles(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask);

  /// Calls visit(const ParticleBlock&) for all blocks: tile by tile in the order of Neighbourhood,
  /// within a tile in the order of the frame.
  template <typename Visit>
  void ForEachBlock(Visit visit) {
    while (ChooseMore()) visit(std::as_const(chosen_));
  }

 private:
  static constexpr int kMaxLists = std::tuple_size_v<Neighbourhood>;

  // A block with less free capacity is full.
  static constexpr int kLeastRoom = 64;

  bool ChooseMore();

  std::span<const BinnedParticle> particles_;
  std::array<List, kMaxLists> lists_;
  int list_count_ = 0;
  int list_ = 0;  // The current list.
  ParticleBlock chosen_;
};

}  // namespace partiemc
