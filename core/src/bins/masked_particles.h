// The particles of a tile and of its neighbours that a step has to look at.
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

/// Particles around a tile, in cells relative to it, one after the other.
struct ParticleBlock {
  static constexpr int kCapacity = 512;
  // A vector of chosen lanes is written whole.
  static constexpr int kPadding = 16;
  template <typename Value>
  using PerParticle = std::array<Value, kCapacity + kPadding>;

  PerParticle<float> x, y;
  PerParticle<std::uint32_t> particle;  ///< Index into ParticleBins::particles.
  int count = 0;
};

/// A walk over the particles in cells of `mask`, or over all of a tile and its neighbours where it
/// is null. Cost: linear in the lists of those tiles in which the mask has cells.
class MaskedParticles {
 public:
  /// What is left of a tile's list: of its particles those in `cells`, shifted.
  struct List {
    std::uint32_t next, end;
    BitRows cells;
    float shift_x, shift_y;
  };

  MaskedParticles(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask);

  /// Calls visit(const ParticleBlock&) for all, a block after the other: tile after tile in the
  /// order of Neighbourhood, those of each in the order of the frame.
  template <typename Visit>
  void ForEachBlock(Visit visit) {
    while (ChooseMore()) visit(std::as_const(chosen_));
  }

 private:
  static constexpr int kMaxLists = std::tuple_size_v<Neighbourhood>;

  // A block is full when no more particles than this could be looked at.
  static constexpr int kLeastRoom = 64;

  bool ChooseMore();

  std::span<const BinnedParticle> particles_;
  std::array<List, kMaxLists> lists_;
  int list_count_ = 0;
  int list_ = 0;  // The one that the next particles come from.
  ParticleBlock chosen_;
};

}  // namespace partiemc
