#include "bins/spacing_doubt.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "frame/near_ring.h"

namespace partiemc {
namespace {

// Limit of the particles that the check visits. In full tiles one sample visits two thousand.
constexpr std::size_t kMaxLooks = std::size_t{1} << 20;

// If a tile has more particles per squared spacing, the spacing of the particles is less than half
// the spacing in use, for any arrangement.
constexpr double kMaxDensity = 4;

// The k-th sample of a tile. The choice depends on the positions, not on their order.
const BinnedParticle& Chosen(std::span<const BinnedParticle> particles, std::uint64_t k) {
  const auto hash = [k](const BinnedParticle& particle) {
    const std::uint64_t bits = std::uint64_t{std::bit_cast<std::uint32_t>(particle.x)} << 32 |
                               std::bit_cast<std::uint32_t>(particle.y);
    const std::uint64_t mixed = (bits + k) * 0x9e3779b97f4a7c15u;
    return (mixed ^ mixed >> 32) * 0xc2b2ae3d27d4eb4fu;
  };
  const BinnedParticle* chosen = particles.data();
  std::uint64_t least = hash(*chosen);
  for (const BinnedParticle& particle : particles.subspan(1)) {
    if (const std::uint64_t next = hash(particle); next < least) {
      least = next;
      chosen = &particle;
    }
  }
  return *chosen;
}

// NearRing::Distance() is 1 spacing on lattices and up to 1.2 in simulations, so these limits mean
// a factor of at least two.
constexpr double kMaxDistance = 2.4;
constexpr double kMinDistance = 0.5;

class Probe {
 public:
  Probe(const ParticleBins& bins, const Scale& scale)
      : bins_(bins),
        spacing_(scale.spacing),
        largest_(scale.sizes.largest),
        most_in_tile_(kMaxDensity * kTileNodes / (scale.spacing * scale.spacing)) {}

  // Whether the sample at this place of the particles contradicts the spacing.
  bool Contradicts(std::size_t particle) {
    const auto above = std::upper_bound(bins_.offsets.begin(), bins_.offsets.end(), particle);
    const auto tile = static_cast<std::size_t>(above - bins_.offsets.begin()) - 1;
    const std::uint64_t k = particle - bins_.offsets[tile];
    const auto particles = ParticlesOf(tile);
    if (SquaredSizesOf(tile) > most_in_tile_) return true;
    looks_ += particles.size();
    // Small frames are sampled completely.
    const BinnedParticle& chosen =
        bins_.particles.size() <= kAsked ? particles[k] : Chosen(particles, k);
    const Sample at{chosen.x, chosen.y, SizeOf(&chosen - bins_.particles.data())};
    NearRing ring;
    Gather(tile, tile, at, ring);
    const Neighbourhood& neighbours = bins_.tiles.neighbours(tile);
    for (const std::uint32_t neighbour : neighbours) {
      if (neighbour != kNoTile && neighbour != tile) Gather(neighbour, tile, at, ring);
    }
    const double reach = WidestPair(at) * WidestPair(at) * ring.reach_square();
    if (reach > kTileSize * kTileSize) GatherFar(tile, at, ring);
    if (!ring.IsAround()) return false;
    const double distance = ring.Distance();
    return distance > kMaxDistance * spacing_ || distance < kMinDistance * spacing_;
  }

  bool IsExhausted() const { return looks_ > kMaxLooks; }

 private:
  // A sampled particle, with its size in spacings.
  struct Sample {
    float x, y;
    double size;
  };

  double SizeOf(std::ptrdiff_t particle) const {
    return bins_.size.empty() ? 1.0 : double{bins_.size[particle]};
  }

  // The sum of the squared sizes of the particles of a tile; their number if sizes are equal.
  double SquaredSizesOf(std::size_t tile) const {
    if (bins_.size.empty()) return bins_.CountOf(tile);
    double sum = 0;
    for (std::uint32_t p = bins_.offsets[tile]; p < bins_.offsets[tile + 1]; ++p) {
      sum += double{bins_.size[p]} * bins_.size[p];
    }
    return sum;
  }

  // The largest mean size of the sample and another particle.
  double WidestPair(const Sample& at) const { return (at.size + largest_) / 2; }

  std::span<const BinnedParticle> ParticlesOf(std::size_t tile) const {
    return std::span(bins_.particles).subspan(bins_.offsets[tile], bins_.CountOf(tile));
  }

  // Adds the particles of `other`, unless the whole tile lies beyond the six nearest positions so
  // far. Distances count in mean sizes of both particles.
  void Gather(std::size_t other, std::size_t tile, const Sample& at, NearRing& ring) {
    const double x =
        (static_cast<double>(bins_.tiles[other].x) - bins_.tiles[tile].x) * kTileSize - at.x;
    const double y =
        (static_cast<double>(bins_.tiles[other].y) - bins_.tiles[tile].y) * kTileSize - at.y;
    const double across_x = std::max({0.0, x, -x - kTileSize});
    const double across_y = std::max({0.0, y, -y - kTileSize});
    const double widest = WidestPair(at);
    if (across_x * across_x + across_y * across_y >= widest * widest * ring.reach_square()) return;
    const auto particles = ParticlesOf(other);
    looks_ += particles.size();
    for (const BinnedParticle& particle : particles) {
      const double pair = (at.size + SizeOf(&particle - bins_.particles.data())) / 2;
      ring.Add((x + particle.x) / pair, (y + particle.y) / pair);
    }
  }

  // Adds the particles of all tiles that are not neighbours.
  void GatherFar(std::size_t tile, const Sample& at, NearRing& ring) {
    looks_ += bins_.tiles.size();
    for (std::size_t other = 0; other < bins_.tiles.size() && !IsExhausted(); ++other) {
      const auto& neighbours = bins_.tiles.neighbours(tile);
      if (std::find(neighbours.begin(), neighbours.end(), other) != neighbours.end()) continue;
      if (bins_.CountOf(other) > 0) Gather(other, tile, at, ring);
    }
  }

  const ParticleBins& bins_;
  double spacing_, largest_, most_in_tile_;
  std::size_t looks_ = 0;
};

}  // namespace

bool ContradictsSpacing(const ParticleBins& bins, const Scale& scale) {
  Probe probe(bins, scale);
  return SamplesContradict(bins.particles.size(), probe);
}

}  // namespace partiemc
