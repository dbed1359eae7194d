#include "components.h"

#include <bit>
#include <numeric>

namespace partiemc {

std::uint32_t Components::RunAt(const Crossings& crossings, const TilePlace& node) const {
  const std::uint32_t starts = RunStarts(crossings.tiles[node.tile].inside[node.j]);
  const std::uint32_t up_to = 0xffffffffu >> (kTileSize - 1 - node.i);
  return first_run_[node.tile * kTileSize + node.j] +
         static_cast<std::uint32_t>(std::popcount(starts & up_to)) - 1;
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
  // The smaller index becomes the root, so that components come out in the order of their runs.
  if (a < b) {
    label_[b] = a;
  } else {
    label_[a] = b;
  }
}

void Components::UniteRuns(const TileDirectory& directory, const Crossings& crossings,
                           std::uint32_t tile) {
  for (int j = 0; j < kTileSize; ++j) {
    const std::uint32_t row = crossings.tiles[tile].inside[j];
    if (row == 0) continue;
    const TilePlace right = Normalise(directory, tile, kTileSize, j);
    if (row >> (kTileSize - 1) && right.tile != kNoTile &&
        (crossings.tiles[right.tile].inside[j] & 1)) {
      Unite(RunAt(crossings, {tile, kTileSize - 1, j}), RunAt(crossings, right));
    }
    const TilePlace above = Normalise(directory, tile, 0, j + 1);
    if (above.tile == kNoTile) continue;
    // One node of each stretch that both rows share joins the two runs.
    std::uint32_t shared = row & crossings.tiles[above.tile].inside[above.j];
    while (shared != 0) {
      const int i = std::countr_zero(shared);
      Unite(RunAt(crossings, {tile, i, j}), RunAt(crossings, {above.tile, i, above.j}));
      shared &= ~LowestRun(shared);
    }
  }
}

void Components::Label(const TileDirectory& directory, const Crossings& crossings) {
  const std::size_t rows = crossings.tiles.size() * kTileSize;
  first_run_.resize(rows);
  std::uint32_t runs = 0;
  for (std::size_t k = 0; k < rows; ++k) {
    first_run_[k] = runs;
    runs += static_cast<std::uint32_t>(
        std::popcount(RunStarts(crossings.tiles[k / kTileSize].inside[k % kTileSize])));
  }
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
    if (!IsInside(crossings, a) || !IsInside(crossings, b)) continue;  // Cleaning cleared them.
    Unite(RunAt(crossings, a), RunAt(crossings, b));
  }
  // Roots come before the runs below them, so one pass turns parents into component numbers.
  count_ = 0;
  for (std::uint32_t run = 0; run < runs; ++run) {
    label_[run] = label_[run] == run ? count_++ : label_[label_[run]];
  }
}

std::uint32_t Components::At(const Crossings& crossings, const TilePlace& node) const {
  return label_[RunAt(crossings, node)];
}

TilePlace Components::NearestInside(const ParticleBins& bins, const Crossings& crossings,
                                    std::uint32_t tile, std::uint32_t entry) const {
  const int i = static_cast<int>(bins.x[entry]);
  const int j = static_cast<int>(bins.y[entry]);
  // The nearest of the four corners is inside as a rule; of equal ones the lower, the more left.
  const TilePlace closest =
      Normalise(bins.tiles, tile, i + (bins.x[entry] - static_cast<float>(i) > 0.5f),
                j + (bins.y[entry] - static_cast<float>(j) > 0.5f));
  if (IsInside(crossings, closest)) return closest;
  TilePlace nearest{kNoTile, 0, 0};
  float nearest_distance = 4;  // Above the square of a cell's diagonal.
  for (int corner = 0; corner < 4; ++corner) {
    const int di = corner & 1;
    const int dj = corner >> 1;
    const TilePlace node = Normalise(bins.tiles, tile, i + di, j + dj);
    if (!IsInside(crossings, node)) continue;
    const float dx = bins.x[entry] - static_cast<float>(i + di);
    const float dy = bins.y[entry] - static_cast<float>(j + dj);
    const float distance = dx * dx + dy * dy;
    if (distance < nearest_distance) {
      nearest_distance = distance;
      nearest = node;
    }
  }
  return nearest;
}

void Components::CountParticles(const ParticleBins& bins, const Crossings& crossings,
                                std::span<std::uint64_t> counts, std::span<double> weights) const {
  ForEachParticle(bins, crossings,
                  [&](std::uint32_t /*tile*/, std::uint32_t entry, std::uint32_t component) {
                    ++counts[component];
                    if (!bins.weight.empty()) weights[component] += bins.weight[entry];
                  });
}

}  // namespace partiemc
