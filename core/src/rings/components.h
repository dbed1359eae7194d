// Connected components of the inside nodes, for nodes, rings and particles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/bits.h"
#include "bins/bins.h"
#include "crossings/crossings.h"

namespace partiemc {

/// The component of a particle that has none.
inline constexpr std::uint32_t kNoComponent = 0xffffffff;

/// Components of inside nodes, connected along lattice edges and through saddles with joined inside
/// corners. This is the connectivity of the outline: each component has one outer ring.
class Components {
 public:
  /// Labels the inside nodes. Components are numbered in the order of their first nodes by tile,
  /// row, column. Cost: linear in runs of inside nodes.
  void Label(const TileDirectory& directory, const Crossings& crossings);

  std::uint32_t size() const { return count_; }

  std::uint32_t At(const Crossings& crossings, const TilePlace& node) const;

  /// The component of a particle at (x, y), in cells from the first node of its tile: the component
  /// of the nearest inside corner of its cell, or kNoComponent if no corner is inside.
  std::uint32_t ComponentOf(const TileDirectory& directory, const Crossings& crossings,
                            std::uint32_t tile, float x, float y) const;

  /// Calls visit(component) for the components to which particles of a tile may belong, with
  /// repetitions. Cost: linear in the runs of inside nodes in the tile and along its upper and
  /// right sides.
  template <typename Visit>
  void ForEachSeenFrom(const TileDirectory& directory, const Crossings& crossings,
                       std::uint32_t tile, Visit visit) const;

  /// Calls visit(tile, j, mask, component) for each run of inside nodes: the bits `mask` of row j.
  template <typename Visit>
  void ForEachRun(const Crossings& crossings, Visit visit) const;

  /// Calls visit(tile, particle, component) for each particle with a component (ComponentOf).
  /// `particle` is an index into ParticleBins::particles.
  template <typename Visit>
  void ForEachParticle(const ParticleBins& bins, const Crossings& crossings, Visit visit) const;
  template <typename Visit>
  void ForEachParticleOf(const ParticleBins& bins, const Crossings& crossings, std::uint32_t tile,
                         Visit visit) const;

  /// Adds the number of particles of each component to `counts`, and the sum of their weights to
  /// `weights`, unless weights are uniform. Both have size() elements. Parallel over tiles.
  /// Components of single particles are searched only in tiles with several components.
  void CountParticles(const ParticleBins& bins, const Crossings& crossings,
                      std::span<std::uint64_t> counts, std::span<double> weights);

 private:
  // The particles of one tile that belong to its component.
  struct TileShare {
    std::uint32_t component;  // kNoComponent, kSeveralComponents: the rest is 0.
    std::uint32_t count;
    double weight;
  };

  std::uint32_t ComponentSeenFrom(const TileDirectory& directory, const Crossings& crossings,
                                  std::uint32_t tile) const;
  TileShare ShareOf(const ParticleBins& bins, const Crossings& crossings, std::uint32_t tile) const;
  template <typename Visit>
  void ForEachRunSeenFrom(const TileDirectory& directory, const Crossings& crossings,
                          std::uint32_t tile, Visit visit) const;
  std::uint32_t RunAt(const Crossings& crossings, const TilePlace& node) const;
  std::uint32_t Root(std::uint32_t run);
  void Unite(std::uint32_t a, std::uint32_t b);
  void UniteRuns(const TileDirectory& directory, const Crossings& crossings, std::uint32_t tile);

  // By tile * 32 + row: index of the row's first run; the last element is the number of runs. A
  // full tile is one run.
  std::vector<std::uint32_t> first_run_;
  std::vector<std::uint32_t> label_;  // By run: its parent in the union, then its component.
  std::vector<TileShare> shares_;     // By tile.
  std::uint32_t count_ = 0;
};

/// Whether all nodes of a tile are inside.
inline bool IsFull(const BitRows& rows) {
  std::uint32_t all = ~std::uint32_t{0};
  for (const std::uint32_t row : rows) all &= row;
  return all == ~std::uint32_t{0};
}

/// The bits of a row where a run of ones begins.
inline std::uint32_t RunStarts(std::uint32_t row) { return row & ~(row << 1); }

/// Whether a row has a single run of ones. Requires: not 0.
inline bool IsOneRun(std::uint32_t row) { return (RunStarts(row) & (RunStarts(row) - 1)) == 0; }

/// The lowest run of ones of a row.
inline std::uint32_t LowestRun(std::uint32_t row) { return row & ~(row + (row & -row)); }

template <typename Visit>
void Components::ForEachRun(const Crossings& crossings, Visit visit) const {
  for (std::uint32_t tile = 0; tile < crossings.tiles.size(); ++tile) {
    for (int j = 0; j < kTileSize; ++j) {
      std::uint32_t run = first_run_[tile * kTileSize + j];
      for (std::uint32_t row = crossings.tiles[tile].inside[j]; row != 0;) {
        const std::uint32_t mask = LowestRun(row);
        visit(tile, j, mask, label_[run++]);
        row &= ~mask;
      }
    }
  }
}

// Calls visit(first, count) for the runs of the tile and of its cells' corners in neighbouring
// tiles. Runs are numbered by tile, row, column, so the runs of a tile or row are consecutive.
template <typename Visit>
void Components::ForEachRunSeenFrom(const TileDirectory& directory, const Crossings& crossings,
                                    std::uint32_t tile, Visit visit) const {
  const auto visit_left_nodes = [&](std::uint32_t other, int rows) {
    for (int j = 0; other != kNoTile && j < rows; ++j) {
      visit(first_run_[other * kTileSize + j], crossings.tiles[other].inside[j] & 1);
    }
  };
  const Neighbourhood& near = directory.neighbours(tile);
  const std::uint32_t first = first_run_[tile * kTileSize];
  visit(first, first_run_[(tile + 1) * kTileSize] - first);
  if (const std::uint32_t above = near[7]; above != kNoTile) {
    const std::uint32_t starts = RunStarts(crossings.tiles[above].inside[0]);
    visit(first_run_[above * kTileSize], static_cast<std::uint32_t>(CountBits(starts)));
  }
  visit_left_nodes(near[5], kTileSize);
  visit_left_nodes(near[8], 1);
}

template <typename Visit>
void Components::ForEachSeenFrom(const TileDirectory& directory, const Crossings& crossings,
                                 std::uint32_t tile, Visit visit) const {
  ForEachRunSeenFrom(directory, crossings, tile, [&](std::uint32_t first, std::uint32_t count) {
    for (std::uint32_t run = first; run < first + count; ++run) visit(label_[run]);
  });
}

template <typename Visit>
void Components::ForEachParticleOf(const ParticleBins& bins, const Crossings& crossings,
                                   std::uint32_t tile, Visit visit) const {
  for (std::uint32_t particle = bins.offsets[tile]; particle < bins.offsets[tile + 1]; ++particle) {
    const BinnedParticle& at = bins.particles[particle];
    const std::uint32_t component = ComponentOf(bins.tiles, crossings, tile, at.x, at.y);
    if (component != kNoComponent) visit(tile, particle, component);
  }
}

template <typename Visit>
void Components::ForEachParticle(const ParticleBins& bins, const Crossings& crossings,
                                 Visit visit) const {
  for (std::uint32_t tile = 0; tile < bins.tiles.size(); ++tile) {
    ForEachParticleOf(bins, crossings, tile, visit);
  }
}

}  // namespace partiemc
