#include "bins.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <span>
#include <string>

#include "absl/strings/str_cat.h"
#include "coordinate_block.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Sides of a tile that a kernel crosses, as in BinStretch.
enum Side : std::uint32_t { kLeft = 1, kRight = 2, kLower = 4, kUpper = 8 };
constexpr int kSideBits = 4;

// A tile's place in its own Neighbourhood.
constexpr int kHere = 4;

// The neighbours, by their place in Neighbourhood, that a kernel reaches which crosses the sides of
// its index; the tile itself in any case.
constexpr std::array<std::uint16_t, 16> ReachedBySides() {
  std::array<std::uint16_t, 16> reached{};
  for (unsigned sides = 0; sides < 16; ++sides) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const bool column = dx == 0 || (sides & (dx < 0 ? kLeft : kRight)) != 0;
        const bool row = dy == 0 || (sides & (dy < 0 ? kLower : kUpper)) != 0;
        if (column && row) reached[sides] |= 1 << ((dy + 1) * 3 + dx + 1);
      }
    }
  }
  return reached;
}
constexpr std::array<std::uint16_t, 16> kReachedBySides = ReachedBySides();

// Calls visit(place in Neighbourhood) for each tile that a kernel reaches.
template <typename Visit>
void ForEachReached(std::uint32_t sides, Visit visit) {
  for (std::uint32_t bits = kReachedBySides[sides]; bits != 0; bits &= bits - 1) {
    visit(std::countr_zero(bits));
  }
}

// How far beyond its kernel a particle needs tiles, in cells: an inside node is within reach of a
// particle, the rest of an active cell within one cell of it, and any node of a small hole within
// the radius of a disc of the hole's area of its ring.
double TileMargin(const Scale& scale) {
  return 1 + std::sqrt(kHoleMarginParticles / kPi) * scale.spacing;
}

// Five bits, moved five places apart: times the bits of a row, the bits of a box.
constexpr std::array<std::uint32_t, 32> SpreadBits() {
  std::array<std::uint32_t, 32> spread{};
  for (unsigned bits = 0; bits < 32; ++bits) {
    for (int k = 0; k < 5; ++k) spread[bits] |= (bits >> k & 1) << 5 * k;
  }
  return spread;
}
constexpr std::array<std::uint32_t, 32> kSpreadBits = SpreadBits();

// The homes met last, by the low bits of their coordinates: a body of up to 64 x 64 tiles finds all
// of its homes here, without a probe of the directory that would have to be guessed.
class RecentHomes {
 public:
  RecentHomes() { index_.fill(kNoTile); }

  std::uint32_t Insert(TileCoordinate tile, TileDirectory& homes) {
    constexpr int kMask = (1 << kBits) - 1;
    std::uint32_t& index = index_[(tile.y & kMask) << kBits | (tile.x & kMask)];
    if (index == kNoTile || homes[index] != tile) index = homes.Insert(tile);
    return index;
  }

 private:
  static constexpr int kBits = 6;
  std::array<std::uint32_t, 1 << 2 * kBits> index_;
};

// First pass over a stretch: finds home tiles and counts. Returns false if a particle is too far
// from the origin, or if there are more than `max_tiles`.
template <typename Reader>
bool FindHomes(const Reader& reader, std::size_t first, std::size_t last, const Reach& reach,
               std::size_t max_tiles, BinStretch& stretch, BinScratch& scratch) {
  stretch.homes.Clear();
  stretch.crossing.clear();
  stretch.reached.clear();
  RecentHomes recent;
  CoordinateBlock block;
  for (std::size_t start = first; start < last; start += kBlockParticles) {
    const int count = static_cast<int>(std::min<std::size_t>(kBlockParticles, last - start));
    for (int k = 0; k < count; ++k) {
      const WorldPosition position = reader[start + k];
      block.units[2 * k] = position.x * reach.units_per_world;
      block.units[2 * k + 1] = position.y * reach.units_per_world;
    }
    if (!FindTiles(2 * count, reach, block, scratch.positions.data() + 2 * start)) return false;
    for (int k = 0; k < count; ++k) {
      const std::uint32_t index =
          recent.Insert({block.tile[2 * k + 1], block.tile[2 * k]}, stretch.homes);
      if (index == stretch.reached.size()) {
        if (index == max_tiles) return false;
        stretch.crossing.emplace_back();
        stretch.reached.push_back(0);
      }
      const std::uint32_t sides = block.sides[2 * k] | block.sides[2 * k + 1] << 2;
      ++stretch.crossing[index][sides];
      stretch.reached[index] |= block.reached[2 * k] * kSpreadBits[block.reached[2 * k + 1]];
      scratch.home[start + k] = index << kSideBits | sides;
    }
  }
  return true;
}

// Joins the tiles of all stretches in `tiles`. Returns false if they are more than `max_tiles`.
bool CollectTiles(BinScratch& scratch, std::size_t max_tiles, TileDirectory& tiles) {
  scratch.reached.clear();
  for (const BinStretch& stretch : scratch.stretches) {
    for (std::size_t k = 0; k < stretch.homes.size(); ++k) {
      const std::uint32_t index = tiles.Insert(stretch.homes[k]);
      if (index == scratch.reached.size()) scratch.reached.push_back(0);
      scratch.reached[index] |= stretch.reached[k];
    }
    if (tiles.size() > max_tiles) return false;
  }
  const std::size_t homes = tiles.size();
  for (std::size_t k = 0; k < homes; ++k) {
    const TileCoordinate home = tiles[k];
    for (std::uint32_t bits = scratch.reached[k]; bits != 0; bits &= bits - 1) {
      const int place = std::countr_zero(bits);
      tiles.Insert({home.y + place / 5 - 2, home.x + place % 5 - 2});
    }
    if (tiles.size() > max_tiles) return false;
  }
  return true;
}

// Counts how many entries a stretch has in each tile.
void CountEntries(const TileDirectory& tiles, BinStretch& stretch) {
  stretch.entries.assign(tiles.size(), 0);
  stretch.tile.resize(stretch.homes.size());
  for (std::size_t k = 0; k < stretch.homes.size(); ++k) {
    stretch.tile[k] = tiles.Find(stretch.homes[k]);
    const Neighbourhood& near = tiles.neighbours(stretch.tile[k]);
    for (std::uint32_t sides = 0; sides < stretch.crossing[k].size(); ++sides) {
      const std::uint32_t count = stretch.crossing[k][sides];
      if (count == 0) continue;
      ForEachReached(sides, [&](int place) { stretch.entries[near[place]] += count; });
    }
  }
}

// Turns the counts of all stretches into the places of their first entries: a tile's list has the
// entries of the first stretch, then those of the second.
void PlaceEntries(ParticleBins& bins) {
  const std::size_t tiles = bins.tiles.size();
  bins.offsets.resize(tiles + 1);
  std::uint32_t next = 0;
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    bins.offsets[tile] = next;
    for (BinStretch& stretch : bins.scratch.stretches) {
      const std::uint32_t count = stretch.entries[tile];
      stretch.entries[tile] = next;
      next += count;
    }
  }
  bins.offsets[tiles] = next;
  bins.home_count.assign(tiles, 0);
  for (const BinStretch& stretch : bins.scratch.stretches) {
    for (std::size_t k = 0; k < stretch.tile.size(); ++k) {
      for (const std::uint32_t count : stretch.crossing[k]) {
        bins.home_count[stretch.tile[k]] += count;
      }
    }
  }
}

// Second pass over a stretch: writes its entries.
void FillEntries(std::size_t first, std::size_t last, std::span<const float> volumes,
                 double weight_per_world_volume, BinStretch& stretch, ParticleBins& bins) {
  constexpr auto kSize = static_cast<float>(kTileSize);
  const float* positions = bins.scratch.positions.data();
  BinEntry* entries = bins.entries.data();
  for (std::size_t k = first; k < last; ++k) {
    const std::uint32_t home = bins.scratch.home[k];
    const std::uint32_t tile = stretch.tile[home >> kSideBits];
    const float x = positions[2 * k];
    const float y = positions[2 * k + 1];
    const auto add = [&](std::uint32_t to, float at_x, float at_y) {
      const std::uint32_t entry = stretch.entries[to]++;
      entries[entry] = {at_x, at_y, static_cast<std::uint32_t>(k)};
      if (!volumes.empty()) {
        bins.weight[entry] = static_cast<float>(volumes[k] * weight_per_world_volume);
      }
    };
    add(tile, x, y);
    const std::uint32_t sides = home & ((1u << kSideBits) - 1);
    if (sides == 0) continue;
    const Neighbourhood& near = bins.tiles.neighbours(tile);
    ForEachReached(sides, [&](int place) {
      if (place == kHere) return;
      add(near[place], x - static_cast<float>(place % 3 - 1) * kSize,
          y - static_cast<float>(place / 3 - 1) * kSize);
    });
  }
}

// Why FindHomes or CollectTiles gave up: the first particle too far away, else too many tiles.
absl::Status Refusal(const Frame& frame, Plane plane, const Scale& scale, const Reach& reach,
                     std::size_t max_tiles) {
  const Axes axes = AxesOf(frame, plane);
  for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
    const WorldPosition position = PositionOf(frame, plane, k);
    for (const auto& [axis, value] :
         {std::pair(axes.first, position.x), std::pair(axes.second, position.y)}) {
      if (IsNearOrigin(value * reach.units_per_world)) continue;
      return InvalidFrame(kReasonOutOfRange, CoordinateField("positions", k, axis),
                          ShortestNumber(value),
                          absl::StrCat("must be within 2^30 cells of ",
                                       ShortestNumber(scale.cell_size), " from the origin"));
    }
  }
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonTooManyTiles), "positions",
       absl::StrCat("more than ", max_tiles, " tiles of 32 x 32 cells"),
       absl::StrCat("must reach at most ", max_tiles, " tiles: is the spacing of ",
                    ShortestNumber(scale.spacing * scale.cell_size), " right?")});
}

// A stretch has at least so many particles, and there are at most so many of them: enough for the
// tasks to balance, few enough that counts by stretch and tile stay below the particles.
constexpr std::size_t kMinStretch = 1 << 15;
constexpr std::size_t kMaxStretches = 16;

}  // namespace

void ParticleBins::Clear() {
  tiles.Clear();
  offsets.clear();
  home_count.clear();
  entries.clear();
  weight.clear();
}

absl::Status BinParticles(const Frame& frame, Plane plane, const Scale& scale,
                          const FrameLimits& limits, ParticleBins& bins) {
  bins.tiles.Clear();
  BinScratch& scratch = bins.scratch;
  const std::size_t count = frame.ParticleCount();
  const Reach reach = ReachOf(scale, TileMargin(scale));
  scratch.home.resize(count);
  scratch.positions.resize(2 * count);
  const std::size_t length = std::max(kMinStretch, (count + kMaxStretches - 1) / kMaxStretches);
  scratch.stretches.resize((count + length - 1) / length);
  const auto for_each_stretch = [&](auto visit) {
    tbb::parallel_for(std::size_t{0}, scratch.stretches.size(), [&](std::size_t k) {
      visit(scratch.stretches[k], k * length, std::min(count, (k + 1) * length));
    });
  };

  std::atomic<bool> found = true;
  VisitPositions(frame, plane, [&](const auto& reader) {
    for_each_stretch([&](BinStretch& stretch, std::size_t first, std::size_t last) {
      if (!FindHomes(reader, first, last, reach, limits.max_tiles, stretch, scratch)) found = false;
    });
  });
  if (!found || !CollectTiles(scratch, limits.max_tiles, bins.tiles)) {
    return Refusal(frame, plane, scale, reach, limits.max_tiles);
  }
  bins.tiles.Seal();
  for_each_stretch(
      [&](BinStretch& stretch, std::size_t, std::size_t) { CountEntries(bins.tiles, stretch); });
  PlaceEntries(bins);

  const std::size_t entries = bins.offsets.back();
  bins.entries.resize(entries);
  bins.weight.resize(frame.volumes.empty() ? 0 : entries);
  const double weight_per_world_volume =
      scale.weight_per_volume / scale.cell_size / scale.cell_size;
  for_each_stretch([&](BinStretch& stretch, std::size_t first, std::size_t last) {
    FillEntries(first, last, frame.volumes, weight_per_world_volume, stretch, bins);
  });
  return absl::OkStatus();
}

}  // namespace partiemc
