// Labels the nodes of the lattice by phase, and finds where phases meet.
//
// A lattice edge between nodes of two phases has a point of the interface. A cell in which three or
// four phases meet has a junction. Where phases meet in a cell that the outline of the body
// crosses, they meet at the vertex of the outline.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bins/lattice.h"
#include "crossings/crossings.h"
#include "phases/phase_field.h"

namespace partiemc {

/// A lattice edge between two phases, from its lower or left node.
struct PhaseEdge {
  std::uint32_t tile = 0;
  std::uint8_t i = 0, j = 0;
  std::uint8_t is_up = 0;       ///< Whether the edge is vertical.
  PhaseLabel from = 0, to = 0;  ///< Phases of its nodes.

  std::uint64_t Key() const {
    return ((std::uint64_t{tile} * kTileSize + j) * kTileSize + i) * 2 + is_up;
  }
};

/// A cell that has a shared point of its own.
struct PhaseCell {
  std::uint32_t tile = 0;
  std::uint8_t i = 0, j = 0;
  /// In a cell with one outside corner: the opposite corner. It has another phase than the two
  /// corners beside it, so the interface runs around it. kNoCorner in a cell with a junction.
  std::uint8_t corner = 0;

  std::uint64_t Key() const { return (std::uint64_t{tile} * kTileSize + j) * kTileSize + i; }
};
inline constexpr std::uint8_t kNoCorner = 4;

struct PhaseMap {
  std::vector<std::array<PhaseLabel, kTileNodes>> labels;  ///< By tile; kNoPhase: outside.
  std::vector<PhaseEdge> edges;                            ///< In the order of their keys.
  std::vector<PhaseCell> cells;                            ///< In the order of their keys.
  /// Saddle cells with two phases, by ascending PhaseCell::Key, and the phase whose two opposite
  /// corners are joined.
  std::vector<std::pair<std::uint64_t, PhaseLabel>> joined;

  PhaseLabel At(const TilePlace& node) const {
    return node.tile == kNoTile ? kNoPhase : labels[node.tile][node.j * kTileSize + node.i];
  }
  /// Index in `edges` of the edge up or to the right from a node. Requires: it exists.
  std::uint32_t EdgeAt(const TilePlace& node, bool is_up) const;
  /// Index of a cell in `cells`, or kNoIndex.
  std::uint32_t CellAt(const TilePlace& cell) const;

  /// The labels of the corners of a cell, in the order of crossings.h.
  std::array<PhaseLabel, 4> CornersOf(const TileDirectory& directory, std::uint32_t tile, int i,
                                      int j) const;

  /// Labels the inside nodes of `body`, and finds edges and cells. Deterministic. Cost: linear in
  /// nodes; the kernel sums at nodes with several phases within reach, and in the middle of each
  /// saddle between two phases.
  void Build(const TileDirectory& directory, const Crossings& body, const PhaseField& field);

  /// Whether the two corners of phase `label` are joined in a saddle of its outline. `key`: of the
  /// cell. `body_joined`: whether the inside corners of the body's saddle in this cell are joined.
  bool IsJoined(const std::array<PhaseLabel, 4>& corners, PhaseLabel label, std::uint64_t key,
                bool body_joined) const;

 private:
  void LabelNodes(const TileDirectory& directory, const Crossings& body, const PhaseField& field);
  void FindPlaces(const TileDirectory& directory, const PhaseField& field);
};

}  // namespace partiemc
