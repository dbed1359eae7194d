#include "ring_tracks.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include "id_hash.h"

namespace partiemc {
namespace {

bool HasLessHash(const ParticleSample& a, const ParticleSample& b) { return a.hash < b.hash; }

std::int32_t NearestNode(std::int32_t tile, float relative) {
  return tile * kTileSize + static_cast<std::int32_t>(relative + 0.5f);
}

// Where each ring's samples go: as many places as it has particles, kMaxSamples at most.
void ReserveSamples(std::span<const std::uint64_t> particle_count, RingTracks& t) {
  t.first_sample.clear();
  std::uint32_t places = 0;
  for (const std::uint64_t particles : particle_count) {
    t.first_sample.push_back(places);
    places += static_cast<std::uint32_t>(std::min<std::uint64_t>(particles, kMaxSamples));
  }
  t.samples.resize(places);
  t.sample_count.assign(particle_count.size(), 0);
}

// A ring's samples are a heap: the one with the largest hash is the next to go.
void TakeSample(const ParticleSample& sample, RingTracks& t) {
  ParticleSample* const first = t.samples.data() + t.first_sample[sample.ring];
  std::uint32_t& count = t.sample_count[sample.ring];
  if (count == kMaxSamples) {
    if (!HasLessHash(sample, *first)) return;
    std::pop_heap(first, first + count, HasLessHash);
    --count;
  }
  first[count++] = sample;
  std::push_heap(first, first + count, HasLessHash);
}

// Velocities as integers: in units of a power of two, so small that the largest of them times the
// number of particles fits into 62 bits. Sums are then exact, hence the same in any order.
class VelocityUnits {
 public:
  explicit VelocityUnits(const Frame& frame) {
    float largest = 0;
    for (const float value : frame.velocities) largest = std::max(largest, std::abs(value));
    if (largest == 0) return;
    int exponent = 0;
    std::frexp(largest, &exponent);  // This and ldexp touch exponents only: they are exact.
    per_unit_ =
        std::ldexp(1.0, 62 - static_cast<int>(std::bit_width(frame.ParticleCount())) - exponent);
  }

  std::int64_t Of(float value) const { return static_cast<std::int64_t>(value * per_unit_); }
  double Mean(std::int64_t sum, std::uint64_t count) const {
    return static_cast<double>(sum) / static_cast<double>(count) / per_unit_;
  }

 private:
  double per_unit_ = 1;
};

}  // namespace

void FollowParticles(const TrackInput& input, const RingHistory& previous, RingTracks& t) {
  const Frame& frame = input.frame;
  const std::size_t rings = input.particle_count.size();
  const bool has_ids = !frame.ids.empty();
  const bool has_velocities = !frame.velocities.empty();
  t.samples.clear();
  t.found.clear();
  t.velocity_x.assign(rings, 0);
  t.velocity_y.assign(rings, 0);
  if (!has_ids && !has_velocities) return;
  if (has_ids) ReserveSamples(input.particle_count, t);
  t.sum_x.assign(rings, 0);
  t.sum_y.assign(rings, 0);
  const HashIndex<ParticleSample> known(previous.samples, t.bucket);
  const VelocityUnits units(frame);

  const auto follow_id = [&](std::uint32_t tile, std::uint32_t entry, std::uint32_t ring) {
    const TileCoordinate& origin = input.bins.tiles[tile];
    const ParticleSample now{HashOf(frame.ids[input.bins.entries[entry].source]),
                             NearestNode(origin.x, input.bins.entries[entry].x),
                             NearestNode(origin.y, input.bins.entries[entry].y), ring};
    TakeSample(now, t);
    if (const ParticleSample* const before = known.Find(now.hash)) {
      t.found.push_back(
          {before->ring,
           ring,
           {std::int64_t{now.column} - before->column, std::int64_t{now.row} - before->row}});
    }
  };
  input.components.ForEachParticle(
      input.bins, input.crossings,
      [&](std::uint32_t tile, std::uint32_t entry, std::uint32_t component) {
        const std::uint32_t ring = input.ring_of_component[component];
        if (ring == kNoRing) return;
        if (has_ids) follow_id(tile, entry, ring);
        if (!has_velocities) return;
        const PlaneVelocity velocity =
            VelocityOf(frame, input.plane, input.bins.entries[entry].source);
        t.sum_x[ring] += units.Of(velocity.x);
        t.sum_y[ring] += units.Of(velocity.y);
      });
  std::sort(t.found.begin(), t.found.end(), [](const FoundSample& x, const FoundSample& y) {
    return std::tie(x.before, x.now) < std::tie(y.before, y.now);
  });
  for (std::size_t ring = 0; ring < rings; ++ring) {
    if (input.particle_count[ring] == 0) continue;
    t.velocity_x[ring] = units.Mean(t.sum_x[ring], input.particle_count[ring]);
    t.velocity_y[ring] = units.Mean(t.sum_y[ring], input.particle_count[ring]);
  }
}

}  // namespace partiemc
