#include "space_identities/shell_tracks.h"

#include <algorithm>
#include <tuple>

#include "base/id_hash.h"
#include "identities/smallest_hashes.h"
#include "identities/velocity_units.h"

namespace partiemc::space {
namespace {

/// Reserves a range of samples for each shell: one for each particle, at most kMaxSamples.
void ReserveShellSamples(const NumberedShells& shells, ShellTracks& t) {
  t.first_sample.clear();
  std::uint32_t count = 0;
  for (const std::uint64_t particles : shells.particles) {
    t.first_sample.push_back(count);
    count += static_cast<std::uint32_t>(std::min<std::uint64_t>(particles, kMaxSamples));
  }
  t.samples.resize(count);
  t.sample_count.assign(shells.particles.size(), 0);
}

void SampleShells(const Frame& frame, const SpaceBins& bins, const ShellHistory& previous,
                  const NumberedShells& shells, ShellTracks& t) {
  ReserveShellSamples(shells, t);
  const std::span<const ShellSample> before = previous.samples;
  const HashIndex<ShellSample> index(before, t.bucket);
  const KnownHashes known(before, t.known);
  for (std::uint32_t brick = 0; brick < bins.bricks.size(); ++brick) {
    const BrickCoordinate& at = bins.bricks[brick];
    const auto nearest_node = [](std::int32_t coordinate, float within) {
      return coordinate * kBrickSize + static_cast<std::int32_t>(within + .5f);
    };
    for (std::uint32_t p = bins.FirstOf(brick); p < bins.EndOf(brick); ++p) {
      const std::uint32_t shell = shells.of_particle[p];
      if (shell == kNoShell) continue;
      const ShellSample now{HashOf(frame.ids[bins.source[p]]), nearest_node(at.x, bins.x[p]),
                            nearest_node(at.y, bins.y[p]), nearest_node(at.z, bins.z[p]), shell};
      AddToHeap(now, t.samples.data() + t.first_sample[shell], t.sample_count[shell]);
      if (!known.MayHave(now.hash)) continue;
      const ShellSample* const same = index.Find(now.hash);
      if (same == nullptr) continue;
      t.found.push_back({same->shell,
                         shell,
                         {std::int64_t{now.x} - same->x, std::int64_t{now.y} - same->y,
                          std::int64_t{now.z} - same->z}});
    }
  }
  std::ranges::sort(t.found, [](const auto& a, const auto& b) {
    return std::tie(a.before, a.now) < std::tie(b.before, b.now);
  });
}

void AverageVelocities(const Frame& frame, const SpaceBins& bins, NumberedShells& shells,
                       ShellTracks& t) {
  t.velocity.assign(shells.shells.size(), {0, 0, 0});
  const VelocityUnits units(frame);
  for (std::size_t p = 0; p < shells.of_particle.size(); ++p) {
    const std::uint32_t shell = shells.of_particle[p];
    if (shell == kNoShell) continue;
    const float* const velocity = &frame.velocities[3 * std::size_t{bins.source[p]}];
    t.velocity[shell].x += units.Of(velocity[0]);
    t.velocity[shell].y += units.Of(velocity[1]);
    t.velocity[shell].z += units.Of(velocity[2]);
  }
  for (std::size_t shell = 0; shell < shells.shells.size(); ++shell) {
    const std::uint64_t count = shells.particles[shell];
    if (count == 0) continue;
    shells.shells[shell].velocity_x = units.Mean(t.velocity[shell].x, count);
    shells.shells[shell].velocity_y = units.Mean(t.velocity[shell].y, count);
    shells.shells[shell].velocity_z = units.Mean(t.velocity[shell].z, count);
  }
}

}  // namespace

void FollowShells(const Frame& frame, const SpaceBins& bins, const ShellHistory& previous,
                  NumberedShells& shells, ShellTracks& tracks) {
  tracks.samples.clear();
  tracks.found.clear();
  if (!frame.ids.empty()) SampleShells(frame, bins, previous, shells, tracks);
  if (!frame.velocities.empty()) AverageVelocities(frame, bins, shells, tracks);
}

}  // namespace partiemc::space
