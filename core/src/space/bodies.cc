#include "space/bodies.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "base/bits.h"
#include "base/cancellation.h"

namespace partiemc::space {
namespace {

constexpr std::uint64_t kFirstColumn = 0x0101010101010101, kLastColumn = 0x8080808080808080;

/// The nodes of `inside`, the inside nodes of a brick, that are connected to `seed` in this brick.
BrickBits Connected(const BrickBits& inside, const BrickBits& seed) {
  BrickBits found = seed;
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (int k = 0; k < kBrickSize; ++k) {
      const std::uint64_t here = found[k];
      std::uint64_t word =
          here | (here << 1 & ~kFirstColumn) | (here >> 1 & ~kLastColumn) | here << 8 | here >> 8;
      if (k > 0) word |= found[k - 1];
      if (k + 1 < kBrickSize) word |= found[k + 1];
      word &= inside[k];
      if (word == found[k]) continue;
      found[k] = word;
      has_grown = true;
    }
  }
  return found;
}

/// Appends the parts of a brick: its connected sets of inside nodes.
void SplitBrick(const BrickBits& inside, std::uint32_t brick, std::vector<Bodies::Part>& parts) {
  BrickBits rest = inside;
  for (int k = 0; k < kBrickSize;) {
    if (rest[k] == 0) {
      ++k;
      continue;
    }
    BrickBits seed{};
    seed[k] = rest[k] & (~rest[k] + 1);
    const BrickBits found = Connected(rest, seed);
    for (int layer = 0; layer < kBrickSize; ++layer) rest[layer] &= ~found[layer];
    const auto index = static_cast<std::uint32_t>(parts.size());
    parts.push_back({found, brick, index});
  }
}

/// Whether part `low` of a brick and part `high` of the next brick along `axis` are connected.
bool AreJoined(const BrickBits& low, const BrickBits& high, int axis) {
  if (axis == 2) return (low[kBrickSize - 1] & high[0]) != 0;
  for (int k = 0; k < kBrickSize; ++k) {
    const std::uint64_t shifted = axis == 0 ? low[k] >> 7 & kFirstColumn : low[k] >> 56;
    if ((shifted & high[k]) != 0) return true;
  }
  return false;
}

std::uint32_t RootPart(std::vector<Bodies::Part>& parts, std::uint32_t part) {
  return partiemc::RootOf(parts, part, &Bodies::Part::body);
}

void JoinParts(const BrickDirectory& bricks, Bodies& bodies) {
  constexpr std::array<int, 3> kNext = {14, 16, 22};  // Neighbours along x, y, z.
  for (std::uint32_t brick = 0; brick < bricks.size(); ++brick) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t other = bricks.neighbours(brick)[kNext[axis]];
      if (other == kNoIndex) continue;
      for (std::uint32_t a = bodies.first[brick]; a < bodies.first[brick + 1]; ++a) {
        for (std::uint32_t b = bodies.first[other]; b < bodies.first[other + 1]; ++b) {
          if (!AreJoined(bodies.parts[a].nodes, bodies.parts[b].nodes, axis)) continue;
          const std::uint32_t p = RootPart(bodies.parts, a), q = RootPart(bodies.parts, b);
          bodies.parts[std::max(p, q)].body = std::min(p, q);
        }
      }
    }
  }
}

/// Numbers the bodies and finds their lowest nodes.
void NumberBodies(const BrickDirectory& bricks, Bodies& bodies) {
  const auto parts = static_cast<std::uint32_t>(bodies.parts.size());
  for (std::uint32_t part = 0; part < parts; ++part) RootPart(bodies.parts, part);
  std::vector<std::int64_t>& lowest_z = bodies.lowest_z;
  lowest_z.clear();
  // The root of a body is its first part.
  for (std::uint32_t index = 0; index < parts; ++index) {
    Bodies::Part& part = bodies.parts[index];
    std::uint32_t parent = part.body;
    if (parent == index) {
      part.body = static_cast<std::uint32_t>(bodies.bodies.size());
      bodies.bodies.push_back({.first_image = part.body});
      lowest_z.push_back(std::numeric_limits<std::int64_t>::max());
    } else {
      part.body = bodies.parts[parent].body;
    }
    int k = 0;
    while (part.nodes[k] == 0) ++k;
    const std::int64_t z = std::int64_t{bricks[part.brick].z} * kBrickSize + k;
    if (z >= lowest_z[part.body]) continue;
    lowest_z[part.body] = z;
    const int bit = std::countr_zero(part.nodes[k]);
    bodies.bodies[part.body].lowest = {part.brick, bit % kBrickSize, bit / kBrickSize, k};
  }
}

// Largest distance from the cell of a particle to an inside node of its body, in layers of nodes.
// Small drops require it: most of their particles lie in cells without inside nodes.
constexpr int kMostLayers = 2;
constexpr float kFar = std::numeric_limits<float>::infinity();

/// The nearest inside node among the corners of the cell of a particle and `layers` layers around
/// them, nearer than `reach`; brick kNoIndex if there is none.
BrickPlace NearestInside(const SpaceBins& bins, const SpaceField& field, std::uint32_t brick,
                         std::uint32_t particle, int layers, float reach) {
  const std::array<float, 3> at{bins.x[particle], bins.y[particle], bins.z[particle]};
  const std::array<int, 3> cell{static_cast<int>(at[0]), static_cast<int>(at[1]),
                                static_cast<int>(at[2])};
  BrickPlace nearest{kNoIndex, 0, 0, 0};
  const auto square = [](float value) { return value * value; };
  float least = square(reach);
  for (int k = cell[2] - layers; k <= cell[2] + 1 + layers; ++k) {
    for (int j = cell[1] - layers; j <= cell[1] + 1 + layers; ++j) {
      for (int i = cell[0] - layers; i <= cell[0] + 1 + layers; ++i) {
        const float distance = square(at[0] - static_cast<float>(i)) +
                               square(at[1] - static_cast<float>(j)) +
                               square(at[2] - static_cast<float>(k));
        if (distance >= least) continue;
        const BrickPlace node = Normalise(bins.bricks, brick, i, j, k);
        if (!field.IsInside(node)) continue;
        nearest = node;
        least = distance;
      }
    }
  }
  return nearest;
}

/// The only body in a brick and the bricks around it; kNoIndex if there are several or none.
std::uint32_t OnlyBodyAround(const BrickDirectory& bricks, const Bodies& bodies,
                             std::uint32_t brick) {
  std::uint32_t only = kNoIndex;
  for (const std::uint32_t other : bricks.neighbours(brick)) {
    if (other == kNoIndex) continue;
    for (std::uint32_t part = bodies.first[other]; part < bodies.first[other + 1]; ++part) {
      const std::uint32_t body = bodies.parts[part].body;
      if (only != kNoIndex && only != body) return kNoIndex;
      only = body;
    }
  }
  return only;
}

/// The body of a particle (FindBodies); kNoIndex if no inside node is near. `only`: OnlyBodyAround
/// of the brick.
std::uint32_t BodyOfParticle(const SpaceBins& bins, const SpaceField& field, const Bodies& bodies,
                             std::uint32_t brick, std::uint32_t only, float kernel_radius,
                             std::uint32_t particle) {
  if (only != kNoIndex) {
    // Any inside node near the particle will do. Most particles have one at the lowest corner.
    const BrickPlace corner{brick, static_cast<int>(bins.x[particle]),
                            static_cast<int>(bins.y[particle]), static_cast<int>(bins.z[particle])};
    if (field.IsInside(corner)) return only;
  }
  for (int layers = 0; layers <= kMostLayers; ++layers) {
    const bool is_limited = layers > 0 && !bins.size.empty();
    const float reach = is_limited ? kernel_radius * bins.size[particle] : kFar;
    const BrickPlace node = NearestInside(bins, field, brick, particle, layers, reach);
    if (node.brick != kNoIndex) return bodies.BodyOf(node);
  }
  return kNoIndex;
}

void CountParticles(const Frame& frame, const SpaceBins& bins, const SpaceField& field,
                    double spacing, float kernel_radius, Bodies& bodies) {
  const double usual = spacing * spacing * spacing;
  bodies.body_of_particle.assign(bins.source.size(), kNoIndex);
  for (std::uint32_t brick = 0; brick < bins.bricks.size(); ++brick) {
    const std::uint32_t only = OnlyBodyAround(bins.bricks, bodies, brick);
    for (std::uint32_t p = bins.FirstOf(brick); p < bins.EndOf(brick); ++p) {
      if (p % kItemsPerCheck == 0) ThrowIfCancelled();
      const std::uint32_t index =
          BodyOfParticle(bins, field, bodies, brick, only, kernel_radius, p);
      bodies.body_of_particle[p] = index;
      if (index == kNoIndex) continue;
      Body& body = bodies.bodies[index];
      if (bins.IsMirror(p)) {
        body.has_mirrors = true;
        continue;
      }
      if (bins.IsImage(p)) {
        ++body.copies;
        continue;
      }
      ++body.particles;
      body.volume += frame.volumes.empty() ? usual : frame.volumes[bins.source[p]];
    }
  }
}

}  // namespace

void FindBodies(const Frame& frame, const SpaceBins& bins, const SpaceField& field, double spacing,
                double kernel_radius, Bodies& bodies) {
  bodies.bodies.clear();
  bodies.parts.clear();
  bodies.first.clear();
  for (std::uint32_t brick = 0; brick < bins.bricks.size(); ++brick) {
    bodies.first.push_back(static_cast<std::uint32_t>(bodies.parts.size()));
    SplitBrick(field.inside[brick], brick, bodies.parts);
  }
  bodies.first.push_back(static_cast<std::uint32_t>(bodies.parts.size()));
  JoinParts(bins.bricks, bodies);
  NumberBodies(bins.bricks, bodies);
  CountParticles(frame, bins, field, spacing, static_cast<float>(kernel_radius), bodies);
}

}  // namespace partiemc::space
