#include "rings/components.h"

#include <bit>
#include <limits>
#include <numeric>

#include "base/bits.h"
#include "base/parallel.h"

namespace partiemc {
namespace {

constexpr std::uint32_t kSeveralComponents = kNoComponent - 1;

}  // namespace

std::uint32_t Components::RunAt(const Crossings& crossings, const TilePlace& node) const {
  const std::uint32_t starts = RunStarts(crossings.tiles[node.tile].inside[node.j]);
  const std::uint32_t up_to = 0xffffffffu >> (kTileSize - 1 - node.i);
  return first_run_[node.tile * kTileSize + node.j] +
         static_cast<std::uint32_t>(CountBits(starts & up_to)) - 1;
}

std::uint32_t Components::Root(std::uint32_t run) {
  while (label_[run] != run) {
    label_[run] = label_[label_[run]];
    run = label_[run];
  }
  return run;
}

void Components::Unite(std::uint32_t a, std::uint32_t b) {
  a = Root(a);
  b = Root(b);
  // The smaller index becomes the root, so components are numbered in the order of their runs.
  if (a < b) {
    label_[b] = a;
  } else {
    label_[a] = b;
  }
}

void Components::UniteRuns(const TileDirectory& directory, const Crossings& crossings,
                           std::uint32_t tile) {
  const BitRows& rows = crossings.tiles[tile].inside;
  const std::uint32_t right = directory.neighbours(tile)[5];
  const std::uint32_t above = directory.neighbours(tile)[7];
  const bool full = IsFull(rows);
  // Unites the runs of two rows that overlap, at one node of each overlap.
  const auto unite_rows = [&](int j, std::uint32_t upper_tile, int upper_j) {
    const std::uint32_t upper_row = crossings.tiles[upper_tile].inside[upper_j];
    std::uint32_t shared = rows[j] & upper_row;
    if (shared != 0 && IsOneRun(rows[j]) && IsOneRun(upper_row)) {
      Unite(first_run_[tile * kTileSize + j], first_run_[upper_tile * kTileSize + upper_j]);
      return;
    }
    while (shared != 0) {
      const int i = std::countr_zero(shared);
      Unite(RunAt(crossings, {tile, i, j}), RunAt(crossings, {upper_tile, i, upper_j}));
      shared &= ~LowestRun(shared);
    }
  };
  for (int j = 0; !full && j + 1 < kTileSize; ++j) unite_rows(j, tile, j + 1);
  if (above != kNoTile) unite_rows(kTileSize - 1, above, 0);
  if (right == kNoTile) return;
  // If both tiles are full, each of them is one run, so one row suffices.
  const int last = full && IsFull(crossings.tiles[right].inside) ? 1 : kTileSize;
  for (int j = 0; j < last; ++j) {
    if (rows[j] >> (kTileSize - 1) && (crossings.tiles[right].inside[j] & 1)) {
      Unite(RunAt(crossings, {tile, kTileSize - 1, j}), RunAt(crossings, {right, 0, j}));
    }
  }
}

void Components::Label(const TileDirectory& directory, const Crossings& crossings) {
  first_run_.resize(crossings.tiles.size() * kTileSize + 1);
  std::uint32_t runs = 0;
  for (std::size_t tile = 0; tile < crossings.tiles.size(); ++tile) {
    const BitRows& rows = crossings.tiles[tile].inside;
    const bool full = IsFull(rows);
    for (int j = 0; j < kTileSize; ++j) {
      first_run_[tile * kTileSize + j] = runs;
      if (!full) runs += static_cast<std::uint32_t>(CountBits(RunStarts(rows[j])));
    }
    runs += full;
  }
  first_run_.back() = runs;
  label_.resize(runs);
  std::iota(label_.begin(), label_.end(), 0u);
  for (std::uint32_t tile = 0; tile < crossings.tiles.size(); ++tile) {
    UniteRuns(directory, crossings, tile);
  }
  for (const ActiveCell& cell : crossings.cells) {
    if (!cell.joined) continue;
    const int di = cell.corners == 5 ? 0 : 1;
    const TilePlace a = Normalise(directory, cell.tile, cell.i + di, cell.j);
    const TilePlace b = Normalise(directory, cell.tile, cell.i + 1 - di, cell.j + 1);
    if (!IsInside(crossings, a) || !IsInside(crossings, b)) continue;  // Cleaning cleared one.
    Unite(RunAt(crossings, a), RunAt(crossings, b));
  }
  // Roots precede their runs, so one pass turns parents into component numbers.
  count_ = 0;
  for (std::uint32_t run = 0; run < runs; ++run) {
    label_[run] = label_[run] == run ? count_++ : label_[label_[run]];
  }
}

std::uint32_t Components::At(const Crossings& crossings, const TilePlace& node) const {
  return label_[RunAt(crossings, node)];
}

// The component of all inside nodes of a tile and of its cells' corners in neighbouring tiles.
// kNoComponent if there are no such nodes, kSeveralComponents if they differ.
std::uint32_t Components::ComponentSeenFrom(const TileDirectory& directory,
                                            const Crossings& crossings, std::uint32_t tile) const {
  std::uint32_t seen = kNoComponent;
  ForEachRunSeenFrom(directory, crossings, tile, [&](std::uint32_t first, std::uint32_t count) {
    if (count == 0) return;
    if (seen == kNoComponent) seen = label_[first];
    std::uint32_t differs = 0;
    for (std::uint32_t run = first; run < first + count; ++run) differs |= label_[run] ^ seen;
    if (differs != 0) seen = kSeveralComponents;
  });
  return seen;
}

Components::TileShare Components::ShareOf(const ParticleBins& bins, const Crossings& crossings,
                                          std::uint32_t tile) const {
  if (bins.CountOf(tile) == 0) return {kNoComponent, 0, 0};
  const bool full = IsFull(crossings.tiles[tile].inside);
  const std::uint32_t component =
      full ? label_[first_run_[tile * kTileSize]] : ComponentSeenFrom(bins.tiles, crossings, tile);
  if (component == kNoComponent || component == kSeveralComponents) return {component, 0, 0};
  if (full) {
    TileShare share{component, bins.CountOf(tile), 0};
    if (bins.weight.empty()) return share;
    for (std::uint32_t p = bins.offsets[tile]; p < bins.offsets[tile + 1]; ++p) {
      share.weight += bins.weight[p];
    }
    return share;
  }

  BitRows cells;  // Cells with an inside corner.
  const NodeRows rows = InsideRows(bins.tiles, crossings.tiles, tile);
  for (int j = 0; j < kTileSize; ++j) {
    cells[j] = rows.left[j] | rows.right[j] | rows.left[j + 1] | rows.right[j + 1];
  }
  TileShare share{component, 0, 0};
  const std::uint32_t first = bins.offsets[tile], last = bins.offsets[tile + 1];
  for (std::uint32_t p = first; p < last; ++p) share.count += LiesIn(bins.particles[p], cells);
  if (bins.weight.empty()) return share;
  for (std::uint32_t p = first; p < last; ++p) {
    if (LiesIn(bins.particles[p], cells)) share.weight += bins.weight[p];
  }
  return share;
}

std::uint32_t Components::ComponentOf(const TileDirectory& directory, const Crossings& crossings,
                                      std::uint32_t tile, float x, float y) const {
  const int i = static_cast<int>(x);
  const int j = static_cast<int>(y);
  // Usually the nearest of the four corners is inside. Of corners at equal distance, the lower one
  // counts, then the left one.
  const TilePlace closest = Normalise(directory, tile, i + (x - static_cast<float>(i) > 0.5f),
                                      j + (y - static_cast<float>(j) > 0.5f));
  if (IsInside(crossings, closest)) return At(crossings, closest);
  TilePlace nearest{kNoTile, 0, 0};
  float nearest_distance = 4;  // Above any squared distance in a cell.
  for (int corner = 0; corner < 4; ++corner) {
    const int di = corner & 1;
    const int dj = corner >> 1;
    const TilePlace node = Normalise(directory, tile, i + di, j + dj);
    if (!IsInside(crossings, node)) continue;
    const float dx = x - static_cast<float>(i + di);
    const float dy = y - static_cast<float>(j + dj);
    const float distance = dx * dx + dy * dy;
    if (distance < nearest_distance) {
      nearest_distance = distance;
      nearest = node;
    }
  }
  return nearest.tile == kNoTile ? kNoComponent : At(crossings, nearest);
}

void Components::CountParticles(const ParticleBins& bins, const Crossings& crossings,
                                std::span<std::uint64_t> counts, std::span<double> weights) {
  const auto tiles = static_cast<std::uint32_t>(bins.tiles.size());
  shares_.resize(tiles);
  ParallelFor(tiles, [&](std::uint32_t tile) { shares_[tile] = ShareOf(bins, crossings, tile); });
  for (std::uint32_t tile = 0; tile < tiles; ++tile) {
    const TileShare& share = shares_[tile];
    if (share.component == kNoComponent) continue;
    if (share.component != kSeveralComponents) {
      counts[share.component] += share.count;
      weights[share.component] += share.weight;
      continue;
    }
    ForEachParticleOf(bins, crossings, tile,
                      [&](std::uint32_t, std::uint32_t particle, std::uint32_t component) {
                        ++counts[component];
                        if (!bins.weight.empty()) weights[component] += bins.weight[particle];
                      });
  }
}

}  // namespace partiemc
