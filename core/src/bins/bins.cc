#include "bins/bins.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/parallel.h"
#include "bins/quantise.h"
#include "bins/tile_halo.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// Tiles must exist within the kernel radius plus this margin of each particle, in cells. An inside
// node is within the kernel radius of a particle, and the other corners of its active cells are at
// most one cell farther. The nodes of a small hole are farther by at most the radius of a disk with
// the area of the hole.
double TileMargin(const Scale& scale) {
  return 1 + std::sqrt(kHoleMarginParticles / std::numbers::pi) * scale.spacing;
}

// Particles per block, few enough that the data of a block stay in the nearest cache.
constexpr std::size_t kBlockParticles = 256;

// A direct-mapped cache of tile indices, addressed by the low bits of tile coordinates. It avoids
// unpredictable probes of the directory. A body of up to 256 x 256 tiles fits into the cache
// completely; of scattered tiles, most are found in it. Indices that do not fit into 16 bits are
// not cached.
class RecentHomes {
 public:
  explicit RecentHomes(BinStretch& stretch) : stretch_(stretch) { index_.fill(kNone); }

  std::uint32_t Find(TileCoordinate tile) {
    constexpr int kColumns = (1 << kColumnBits) - 1, kRows = (1 << kRowBits) - 1;
    std::uint16_t& recent = index_[(tile.y & kRows) << kColumnBits | (tile.x & kColumns)];
    if (recent != kNone && stretch_.homes[recent] == tile) return recent;
    const std::uint32_t index = stretch_.homes.Insert(tile);
    if (index == stretch_.places.size()) stretch_.places.push_back(0);
    recent = static_cast<std::uint16_t>(std::min<std::uint32_t>(index, kNone));
    return index;
  }

 private:
  static constexpr int kColumnBits = 8, kRowBits = 8;
  static constexpr std::uint16_t kNone = std::numeric_limits<std::uint16_t>::max();
  BinStretch& stretch_;
  std::array<std::uint16_t, 1 << (kColumnBits + kRowBits)> index_;
};

// First pass over a stretch: finds the home tile of each particle, and counts the particles of each
// tile. Returns false if a particle is too far from the origin, or if there are more than
// `max_tiles` tiles.
template <typename Reader>
bool FindHomes(const Reader& reader, std::size_t first, std::size_t last, double units_per_world,
               std::size_t max_tiles, BinStretch& stretch, BinScratch& scratch) {
  stretch.homes.Clear();
  stretch.places.clear();
  RecentHomes recent(stretch);
  std::array<typename Reader::Number, 2 * kBlockParticles> copy;
  std::array<std::int32_t, 2 * kBlockParticles> tiles;
  for (std::size_t start = first; start < last; start += kBlockParticles) {
    const std::size_t count = std::min(kBlockParticles, last - start);
    if (!FindTiles(reader.Pairs(start, count, copy.data()), units_per_world, tiles.data(),
                   scratch.positions.data() + 2 * start)) {
      return false;
    }
    // The next block is fetched while homes are looked up, because the look-up reads no distant
    // memory.
    reader.Prefetch(start + count, std::min(kBlockParticles, last - start - count));
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t home = recent.Find({tiles[2 * k + 1], tiles[2 * k]});
      ++stretch.places[home];
      scratch.home[start + k] = home;
    }
    if (stretch.homes.size() > max_tiles) return false;
  }
  return true;
}

// Collects the homes of all stretches in `tiles`, sorted, and sets BinStretch::tiles. Returns false
// if there are more than `max_tiles`.
bool JoinHomes(std::size_t max_tiles, BinScratch& scratch, TileDirectory& tiles) {
  for (BinStretch& stretch : scratch.stretches) {
    stretch.tiles.clear();
    for (const TileCoordinate& home : stretch.homes.tiles()) {
      stretch.tiles.push_back(tiles.Insert(home));
    }
    if (tiles.size() > max_tiles) return false;
  }
  scratch.homes.assign(tiles.tiles().begin(), tiles.tiles().end());
  tiles.Sort();
  // Each tile is looked up once, not once per stretch.
  scratch.next.clear();
  for (const TileCoordinate& home : scratch.homes) scratch.next.push_back(tiles.Find(home));
  for (BinStretch& stretch : scratch.stretches) {
    for (std::uint32_t& home : stretch.tiles) home = scratch.next[home];
  }
  scratch.homes.assign(tiles.tiles().begin(), tiles.tiles().end());
  return true;
}

// Turns the counts of all stretches into the indices of their first particles. The list of a tile
// has the particles of the first stretch, then of the second, and so on. Returns the number of
// particles.
std::uint32_t PlaceParticles(BinScratch& scratch) {
  scratch.next.assign(scratch.homes.size(), 0);
  for (const BinStretch& stretch : scratch.stretches) {
    for (std::size_t k = 0; k < stretch.places.size(); ++k) {
      scratch.next[stretch.tiles[k]] += stretch.places[k];
    }
  }
  std::uint32_t total = 0;
  for (std::uint32_t& next : scratch.next) {
    const std::uint32_t count = next;
    next = total;
    total += count;
  }
  scratch.offsets = scratch.next;
  for (BinStretch& stretch : scratch.stretches) {
    for (std::size_t k = 0; k < stretch.places.size(); ++k) {
      std::uint32_t& next = scratch.next[stretch.tiles[k]];
      const std::uint32_t count = stretch.places[k];
      stretch.places[k] = next;
      next += count;
    }
  }
  return total;
}

// Prefetch distance in the list of a tile: the cache line after the line of the particle. The list
// continues in that line only after hundreds of particles of other tiles.
constexpr std::size_t kNextLine = 64 / sizeof(BinnedParticle) + 1;

// Second pass over a stretch: writes its particles to the lists of their tiles.
void FillTiles(std::size_t first, std::size_t last, std::span<const float> volumes,
               double weight_per_world_volume, const Scale& scale, BinStretch& stretch,
               ParticleBins& bins) {
  const float* const positions = bins.scratch.positions.data();
  const std::uint32_t* const home = bins.scratch.home.data();
  std::uint32_t* const next = stretch.places.data();
  BinnedParticle* const particles = bins.particles.data();
  const auto fill = [&](auto set_weight) {
    for (std::size_t k = first; k < last; ++k) {
      const std::uint32_t place = next[home[k]]++;
      hwy::Prefetch(particles + place + kNextLine);
      particles[place] = {positions[2 * k], positions[2 * k + 1], static_cast<std::uint32_t>(k)};
      set_weight(place, k);
    }
  };
  const auto set_weight = [&](std::uint32_t place, std::size_t k) {
    bins.weight[place] = static_cast<float>(volumes[k] * weight_per_world_volume);
  };
  if (volumes.empty()) {
    fill([](std::uint32_t, std::size_t) {});
  } else if (scale.has_own_sizes) {
    const double spacing = scale.spacing * scale.cell_size;
    fill([&](std::uint32_t place, std::size_t k) {
      set_weight(place, k);
      bins.size[place] = static_cast<float>(std::sqrt(double{volumes[k]}) / spacing);
    });
  } else {
    fill(set_weight);
  }
}

// Whether all eight neighbours of a tile exist.
bool IsSurrounded(const TileDirectory& tiles, TileCoordinate tile) {
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (tiles.Find({tile.y + dy, tile.x + dx}) == kNoTile) return false;
    }
  }
  return true;
}

// Adds the tiles around the tiles with particles, and seals the directory. Returns false if there
// are more than `max_tiles`.
bool AddReachedTiles(float reach, std::size_t max_tiles, ParticleBins& bins) {
  BinScratch& scratch = bins.scratch;
  const auto homes = static_cast<std::uint32_t>(scratch.homes.size());
  const TileHalo reached(reach);
  scratch.reached.resize(homes);
  ParallelFor(homes, [&](std::uint32_t k) {
    // Inside a body all neighbours exist, so the particles need not be examined.
    scratch.reached[k] = 0;
    if (reached.AreNeighbours() && IsSurrounded(bins.tiles, scratch.homes[k])) return;
    const std::uint32_t end =
        k + 1 < homes ? scratch.offsets[k + 1] : static_cast<std::uint32_t>(bins.particles.size());
    scratch.reached[k] =
        reached.Of(std::span(bins.particles).subspan(scratch.offsets[k], end - scratch.offsets[k]));
  });
  for (std::uint32_t k = 0; k < homes; ++k) {
    TileHalo::ForEach(scratch.homes[k], scratch.reached[k],
                      [&](TileCoordinate tile) { bins.tiles.Insert(tile); });
    if (bins.tiles.size() > max_tiles) return false;
  }
  bins.tiles.Seal();
  return true;
}

// Sets the first particle of each tile, and maps the homes of the stretches to tiles of the sealed
// directory.
void SetOffsets(ParticleBins& bins) {
  BinScratch& scratch = bins.scratch;
  const auto particles = static_cast<std::uint32_t>(bins.particles.size());
  bins.offsets.resize(bins.tiles.size() + 1);
  std::size_t home = 0;
  for (std::size_t tile = 0; tile < bins.tiles.size(); ++tile) {
    bins.offsets[tile] = home < scratch.homes.size() ? scratch.offsets[home] : particles;
    if (home == scratch.homes.size() || scratch.homes[home] != bins.tiles[tile]) continue;
    scratch.next[home++] = static_cast<std::uint32_t>(tile);
  }
  bins.offsets.back() = particles;
  for (BinStretch& stretch : scratch.stretches) {
    for (std::uint32_t& tile : stretch.tiles) tile = scratch.next[tile];
  }
}

// The error of a frame that cannot be binned: its first particle too far from the origin, else too
// many tiles.
absl::Status Refusal(const Frame& frame, Plane plane, const Scale& scale, std::size_t max_tiles) {
  if (absl::Status status = CheckDistances(frame, plane, scale); !status.ok()) return status;
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonTooManyTiles), "positions",
       absl::StrCat("more than ", max_tiles, " tiles of 32 x 32 cells"),
       absl::StrCat("must reach at most ", max_tiles, " tiles: is the spacing of ",
                    ShortestNumber(scale.spacing * scale.cell_size), " right?")});
}

// Smallest stretch and largest number of stretches. There are enough stretches for the tasks to
// balance, and few enough that the counts of all stretches and tiles are fewer than the particles.
// Each stretch looks up most tiles again, so a single thread has one stretch.
constexpr std::size_t kMinStretch = 1 << 15;
constexpr std::size_t kMaxStretches = 16;
constexpr std::size_t kStretchesPerThread = 4;

std::size_t MaxStretches() {
  const std::size_t threads = ThreadCount();
  return threads > 1 ? std::min(kMaxStretches, kStretchesPerThread * threads) : 1;
}

}  // namespace

void ParticleBins::Clear() {
  tiles.Clear();
  offsets.clear();
  particles.clear();
  weight.clear();
  height.clear();
  size.clear();
}

absl::Status CheckDistances(const Frame& frame, Plane plane, const Scale& scale) {
  const double units_per_world = UnitsPerWorld(scale);
  const auto find_far = [&](const auto& reader) -> std::optional<std::size_t> {
    for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
      const Point position = reader[k];
      if (!IsNearOrigin(position.x * units_per_world) ||
          !IsNearOrigin(position.y * units_per_world)) {
        return k;
      }
    }
    return std::nullopt;
  };
  const std::optional<std::size_t> far = VisitPositions(frame, plane, find_far);
  if (!far) return absl::OkStatus();
  const Axes axes = AxesOf(frame, plane);
  const Point position = PositionOf(frame, plane, *far);
  const bool is_first = !IsNearOrigin(position.x * units_per_world);
  // In the caller's frame, a particle of a slab has another index and other axes, so neither is
  // named.
  return InvalidFrame(kReasonOutOfRange,
                      scale.is_slice
                          ? "positions"
                          : CoordinateField("positions", *far, is_first ? axes.first : axes.second),
                      ShortestNumber(is_first ? position.x : position.y),
                      absl::StrCat("must be within 2^30 cells of ", ShortestNumber(scale.cell_size),
                                   " from the origin"));
}

absl::Status BinParticles(const Frame& frame, Plane plane, const Scale& scale,
                          const FrameLimits& limits, ParticleBins& bins) {
  bins.tiles.Clear();
  bins.height.clear();
  BinScratch& scratch = bins.scratch;
  const std::size_t count = frame.ParticleCount();
  scratch.home.resize(count);
  scratch.positions.resize(2 * count);
  const std::size_t most = MaxStretches();
  const std::size_t length = std::max(kMinStretch, (count + most - 1) / most);
  const std::size_t stretches = (count + length - 1) / length;
  if (scratch.all_stretches.size() < stretches) scratch.all_stretches.resize(stretches);
  scratch.stretches = std::span(scratch.all_stretches).first(stretches);
  for (std::size_t k = 0; k < stretches; ++k) {
    scratch.stretches[k].first = k * length;
    scratch.stretches[k].last = std::min(count, (k + 1) * length);
  }
  const auto for_each_stretch = [&](auto visit) {
    ParallelFor(scratch.stretches.size(), [&](std::size_t k) {
      BinStretch& stretch = scratch.stretches[k];
      visit(stretch, stretch.first, stretch.last);
    });
  };

  std::atomic<bool> found = true;
  const double units_per_world = UnitsPerWorld(scale);
  VisitPositions(frame, plane, [&](const auto& reader) {
    for_each_stretch([&](BinStretch& stretch, std::size_t first, std::size_t last) {
      if (!FindHomes(reader, first, last, units_per_world, limits.max_tiles, stretch, scratch)) {
        found = false;
      }
    });
  });
  if (!found || !JoinHomes(limits.max_tiles, scratch, bins.tiles)) {
    return Refusal(frame, plane, scale, limits.max_tiles);
  }
  const std::uint32_t particles = PlaceParticles(scratch);
  bins.particles.resize(particles);
  bins.weight.resize(frame.volumes.empty() ? 0 : particles);
  bins.size.resize(scale.has_own_sizes ? particles : 0);
  double weight_per_world_volume = scale.weight_per_volume / scale.cell_size / scale.cell_size;
  if (scale.is_slice) weight_per_world_volume /= scale.cell_size;
  for_each_stretch([&](BinStretch& stretch, std::size_t first, std::size_t last) {
    FillTiles(first, last, frame.volumes, weight_per_world_volume, scale, stretch, bins);
  });
  if (!AddReachedTiles(RoundedUp(scale.reach + TileMargin(scale)), limits.max_tiles, bins)) {
    return Refusal(frame, plane, scale, limits.max_tiles);
  }
  SetOffsets(bins);
  return absl::OkStatus();
}

void SetHeights(std::span<const double> heights, const Scale& scale, ParticleBins& bins) {
  bins.height.resize(bins.particles.size());
  for (std::size_t k = 0; k < bins.particles.size(); ++k) {
    bins.height[k] = static_cast<float>(heights[bins.particles[k].source] / scale.cell_size);
  }
}

}  // namespace partiemc
