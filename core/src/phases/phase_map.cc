#include "phases/phase_map.h"

#include <algorithm>
#include <bit>

#include "base/bits.h"
#include "base/parallel.h"

namespace partiemc {
namespace {

template <typename Items>
std::uint32_t IndexOf(const Items& items, std::uint64_t key) {
  const auto at =
      std::ranges::lower_bound(items, key, {}, [](const auto& item) { return item.Key(); });
  return at == items.end() || at->Key() != key ? kNoIndex
                                               : static_cast<std::uint32_t>(at - items.begin());
}

// Gives each inside node without a label the label of the last inside node before it in row order,
// or `usual` if there is none. Such nodes are all nodes of a tile with one phase around it, and
// nodes in holes that cleaning closed.
void FillGaps(const BitRows& inside, PhaseLabel usual, std::array<PhaseLabel, kTileNodes>& labels) {
  for (int j = 0; j < kTileSize; ++j) {
    for (std::uint32_t bits = inside[j]; bits != 0; bits &= bits - 1) {
      PhaseLabel& label = labels[j * kTileSize + std::countr_zero(bits)];
      if (label == kNoPhase) label = usual;
      usual = label;
    }
  }
}

}  // namespace

std::uint32_t PhaseMap::EdgeAt(const TilePlace& node, bool is_up) const {
  return IndexOf(edges, PhaseEdge{node.tile, static_cast<std::uint8_t>(node.i),
                                  static_cast<std::uint8_t>(node.j), is_up, 0, 0}
                            .Key());
}

std::uint32_t PhaseMap::CellAt(const TilePlace& cell) const {
  return IndexOf(cells, PhaseCell{cell.tile, static_cast<std::uint8_t>(cell.i),
                                  static_cast<std::uint8_t>(cell.j), 0}
                            .Key());
}

std::array<PhaseLabel, 4> PhaseMap::CornersOf(const TileDirectory& directory, std::uint32_t tile,
                                              int i, int j) const {
  const auto at = [&](int di, int dj) { return At(Normalise(directory, tile, i + di, j + dj)); };
  return {at(0, 0), at(1, 0), at(1, 1), at(0, 1)};
}

void PhaseMap::LabelNodes(const TileDirectory& directory, const Crossings& body,
                          const PhaseField& field) {
  labels.resize(directory.size());
  ParallelFor(static_cast<std::uint32_t>(directory.size()), [&](std::uint32_t tile) {
    const BitRows& inside = body.tiles[tile].inside;
    std::array<PhaseLabel, kTileNodes>& at = labels[tile];
    at.fill(kNoPhase);
    const std::uint32_t around = field.PhasesAround(tile);
    const auto lowest = static_cast<PhaseLabel>(around == 0 ? 1 : std::countr_zero(around));
    if (HasSeveral(around)) {
      std::array<std::uint32_t, kTileNodes> phases;
      field.PhasesAroundCells(tile, phases);
      for (int j = 0; j < kTileSize; ++j) {
        for (std::uint32_t bits = inside[j]; bits != 0; bits &= bits - 1) {
          const int i = std::countr_zero(bits);
          const std::uint32_t near = phases[j * kTileSize + i];
          at[j * kTileSize + i] = HasSeveral(near) ? field.LargestAt(tile, i, j)
                                  : near == 0      ? kNoPhase
                                              : static_cast<PhaseLabel>(std::countr_zero(near));
        }
      }
    }
    FillGaps(inside, lowest, at);
  });
}

// Lists the edges and cells at which phases meet, and decides saddles between two phases.
void PhaseMap::FindPlaces(const TileDirectory& directory, const PhaseField& field) {
  edges.clear();
  cells.clear();
  joined.clear();
  for (std::uint32_t tile = 0; tile < directory.size(); ++tile) {
    std::uint32_t seen = 0;
    for (const std::uint32_t near :
         {tile, directory.neighbours(tile)[5], directory.neighbours(tile)[7],
          directory.neighbours(tile)[8]}) {
      if (near != kNoTile) seen |= field.PhasesAround(near);
    }
    if (!HasSeveral(seen)) continue;
    for (int j = 0; j < kTileSize; ++j) {
      for (int i = 0; i < kTileSize; ++i) {
        const std::array<PhaseLabel, 4> at = CornersOf(directory, tile, i, j);
        const auto differ = [](PhaseLabel a, PhaseLabel b) {
          return a != kNoPhase && b != kNoPhase && a != b;
        };
        const auto column = static_cast<std::uint8_t>(i), row = static_cast<std::uint8_t>(j);
        if (differ(at[0], at[1])) edges.push_back({tile, column, row, 0, at[0], at[1]});
        if (differ(at[0], at[3])) edges.push_back({tile, column, row, 1, at[0], at[3]});
        int changes = 0, outside = 0;
        for (int k = 0; k < 4; ++k) {
          changes += differ(at[k], at[(k + 1) % 4]);
          outside += at[k] == kNoPhase;
        }
        if (changes < 2) continue;
        const PhaseCell cell{tile, column, row, kNoCorner};
        const bool is_across[2] = {at[0] == at[2], at[1] == at[3]};
        if (outside == 0 && changes == 4 && is_across[0] && is_across[1]) {
          const PhaseLabel of[2] = {std::min(at[0], at[1]), std::max(at[0], at[1])};
          const bool first = field.Difference(tile, i + .5, j + .5, of[0], of[1]) >= 0;
          joined.emplace_back(cell.Key(), first ? of[0] : of[1]);
        } else if (outside == 0 && changes > 2 && !is_across[0] && !is_across[1]) {
          cells.push_back(cell);  // Three or four phases meet.
        } else if (outside == 1 && (is_across[0] || is_across[1])) {
          const auto out = static_cast<std::uint8_t>(std::ranges::find(at, kNoPhase) - at.begin());
          // The two neighbours of the outside node have one phase, which runs around the other.
          cells.push_back({tile, column, row, static_cast<std::uint8_t>((out + 2) % 4)});
        }
      }
    }
  }
}

void PhaseMap::Build(const TileDirectory& directory, const Crossings& body,
                     const PhaseField& field) {
  LabelNodes(directory, body, field);
  FindPlaces(directory, field);
}

bool PhaseMap::IsJoined(const std::array<PhaseLabel, 4>& corners, PhaseLabel label,
                        std::uint64_t key, bool body_joined) const {
  const bool first = corners[0] == label;
  const PhaseLabel a = corners[first ? 1 : 0], b = corners[first ? 3 : 2];
  if (a == kNoPhase && b == kNoPhase) return body_joined;
  if (a != b) return true;
  const auto at =
      std::ranges::lower_bound(joined, key, {}, [](const auto& item) { return item.first; });
  return at->second == label;
}

}  // namespace partiemc
