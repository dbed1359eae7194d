#include "space/cleaning.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

#include "base/parallel.h"
#include "space/brick_layers.h"

namespace partiemc::space {
namespace {

/// Half of the directions in which outside nodes are connected: the directions to nodes that come
/// earlier by layer, row, column. The other half is opposite.
constexpr std::array<std::array<int, 3>, 9> kBefore = {{{-1, 0, 0},
                                                        {0, -1, 0},
                                                        {-1, -1, 0},
                                                        {1, -1, 0},
                                                        {0, 0, -1},
                                                        {-1, 0, -1},
                                                        {1, 0, -1},
                                                        {0, -1, -1},
                                                        {0, 1, -1}}};

/// Finds the outside nodes whose earlier neighbours are all inside. Each cavity has one at least.
void FindFirstNodes(const BrickDirectory& bricks, const SpaceField& field,
                    std::vector<BrickBits>& first_nodes) {
  first_nodes.resize(bricks.size());
  ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
    const BrickLayers inside(bricks, field.inside, brick);
    for (int k = 0; k < kBrickSize; ++k) {
      std::uint64_t nodes = ~field.inside[brick][k];
      for (const auto& [dx, dy, dz] : kBefore) nodes &= inside(k + dz, dx, dy);
      first_nodes[brick][k] = nodes;
    }
  });
}

/// Whether the outside nodes connected to `first` are a cavity of at most `most` nodes. Lists the
/// nodes in `cavity`, not all of them if the result is false.
bool FindCavity(const BrickDirectory& bricks, const SpaceField& field, const BrickPlace& first,
                std::size_t most, std::vector<BrickPlace>& cavity) {
  cavity.assign(1, first);
  const auto is_listed = [&](const BrickPlace& node) {
    return std::any_of(cavity.begin(), cavity.end(), [&](const BrickPlace& at) {
      return at.brick == node.brick && at.Index() == node.Index();
    });
  };
  for (std::size_t n = 0; n < cavity.size(); ++n) {
    const BrickPlace at = cavity[n];
    for (const auto& [dx, dy, dz] : kBefore) {
      for (const int sign : {1, -1}) {
        const BrickPlace node =
            Normalise(bricks, at.brick, at.i + sign * dx, at.j + sign * dy, at.k + sign * dz);
        if (node.brick == kNoIndex) return false;
        if (field.IsInside(node) || is_listed(node)) continue;
        if (cavity.size() == most) return false;
        cavity.push_back(node);
      }
    }
  }
  return true;
}

}  // namespace

std::uint64_t FillCavities(const BrickDirectory& bricks, std::size_t most_nodes,
                           CleaningScratch& scratch, SpaceField& field) {
  if (most_nodes == 0) return 0;
  FindFirstNodes(bricks, field, scratch.first_nodes);
  std::uint64_t filled = 0;
  for (std::uint32_t brick = 0; brick < bricks.size(); ++brick) {
    for (int k = 0; k < kBrickSize; ++k) {
      for (std::uint64_t bits = scratch.first_nodes[brick][k]; bits != 0; bits &= bits - 1) {
        const int bit = std::countr_zero(bits);
        const BrickPlace first{brick, bit % kBrickSize, bit / kBrickSize, k};
        // A cavity with several first nodes may be filled already.
        if (field.IsInside(first)) continue;
        if (!FindCavity(bricks, field, first, most_nodes, scratch.cavity)) continue;
        for (const BrickPlace& node : scratch.cavity) {
          field.inside[node.brick][node.k] |= std::uint64_t{1} << node.Bit();
        }
        ++filled;
      }
    }
  }
  return filled;
}

DroppedBodies DropBodies(const BodyLimits& limits, CleaningScratch& scratch, Bodies& bodies,
                         SpaceField& field) {
  DroppedBodies dropped;
  scratch.new_index.resize(bodies.bodies.size());
  std::uint32_t kept = 0;
  for (std::size_t index = 0; index < bodies.bodies.size(); ++index) {
    const Body& body = bodies.bodies[index];
    const bool has_images = body.copies > 0 || body.has_mirrors;
    const bool is_gone = body.fate == BodyFate::kGone;
    const bool has_only_images = body.particles == 0 && has_images;
    const bool is_empty = limits.drops_empty && body.particles == 0;
    const bool is_spray =
        body.volume < limits.least_volume || body.particles < limits.least_particles;
    const bool counts = !is_gone && !has_only_images && body.first_image == index;
    dropped.empty += is_empty && counts;
    dropped.spray += is_spray && !is_empty && counts;
    const bool is_dropped =
        (is_gone && limits.drops_gone) || has_only_images || is_empty || is_spray;
    scratch.new_index[index] = is_dropped ? kNoIndex : kept;
    if (is_dropped) continue;
    bodies.bodies[kept++] = body;
  }
  if (kept == bodies.bodies.size()) return dropped;
  bodies.bodies.resize(kept);
  // All images of a body have its particles and its volume, so all of them remain or none does.
  for (Body& body : bodies.bodies) body.first_image = scratch.new_index[body.first_image];
  for (std::uint32_t& body : bodies.body_of_particle) {
    if (body == kNoIndex || body == kDroppedBody) continue;
    const std::uint32_t index = scratch.new_index[body];
    body = index == kNoIndex ? kDroppedBody : index;
  }
  std::uint32_t kept_parts = 0;
  for (std::size_t brick = 0; brick + 1 < bodies.first.size(); ++brick) {
    const std::uint32_t begin = bodies.first[brick], end = bodies.first[brick + 1];
    bodies.first[brick] = kept_parts;
    for (std::uint32_t part = begin; part < end; ++part) {
      Bodies::Part of = bodies.parts[part];
      of.body = scratch.new_index[of.body];
      if (of.body != kNoIndex) {
        bodies.parts[kept_parts++] = of;
        continue;
      }
      for (int k = 0; k < kBrickSize; ++k) field.inside[brick][k] &= ~of.nodes[k];
    }
  }
  bodies.first.back() = kept_parts;
  bodies.parts.resize(kept_parts);
  return dropped;
}

}  // namespace partiemc::space
