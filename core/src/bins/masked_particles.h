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
  // Whole vectors are written, also beyond the last selected particle.
  static constexpr int kPadding = 16;
  template <typename Value>
  using PerParticle = std::array<Value, kCapacity + kPadding>;

  PerParticle<float> x, y;
  PerParticle<float> size;              ///< Only of particles chosen by their reach.
  PerParticle<std::uint32_t> particle;  ///< Index into ParticleBins::particles.
  int count = 0;
};

/// Visits the particles in the cells of `mask`, or all particles of a tile and its neighbours if
/// `mask` is null. `bins` must outlive the visit. Cost: linear in the particles of the tiles in
/// which the mask has cells.
class MaskedParticles {
 public:
  /// The particles of one tile that are still to be visited: the indices, the selected cells, and
  /// the shift to the coordinates of the central tile.
  struct List {
    std::uint32_t next, end;
    BitRows cells;
    float shift_x, shift_y;
  };

  MaskedParticles(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask);
  /// If sizes differ, leaves out particles whose kernels reach no node of the tile, and sets
  /// ParticleBlock::size. `radius`: the kernel radius of a particle of size 1, in cells.
  MaskedParticles(const ParticleBins& bins, std::uint32_t tile, const CellMask* mask, float radius);

  /// Calls visit(const ParticleBlock&) for all blocks: tile by tile in the order of Neighbourhood,
  /// within a tile in the order of the frame.
  template <typename Visit>
  void ForEachBlock(Visit visit) {
    while (ChooseMore()) visit(std::as_const(chosen_));
  }

 private:
  static constexpr int kMaxLists = std::tuple_size_v<Neighbourhood>;

  // A block with less free capacity than this counts as full.
  static constexpr int kLeastRoom = 64;

  bool ChooseMore();

  std::span<const BinnedParticle> particles_;
  std::span<const float> sizes_;  // Empty if the reach of particles does not matter.
  float radius_ = 0;
  std::array<List, kMaxLists> lists_;
  int list_count_ = 0;
  int list_ = 0;  // The current list.
  ParticleBlock chosen_;
};

}  // namespace partiemc
