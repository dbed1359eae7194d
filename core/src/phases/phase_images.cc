#include "phases/phase_images.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/bits.h"
#include "base/cancellation.h"

namespace partiemc {
namespace {

struct Node {
  std::int64_t x = 0, y = 0;

  Point Position() const { return {static_cast<double>(x), static_cast<double>(y)}; }
};

TilePlace PlaceOf(const TileDirectory& directory, const Node& node) {
  const TileCoordinate tile{static_cast<std::int32_t>(node.y >> kTileShift),
                            static_cast<std::int32_t>(node.x >> kTileShift)};
  return {directory.Find(tile), static_cast<int>(node.x & (kTileSize - 1)),
          static_cast<int>(node.y & (kTileSize - 1))};
}

}  // namespace

void PhaseImages::Build(const Percolation* body, const BodyOutline& outline, double cell_size,
                        std::span<const PhaseRings> phases) {
  first_.assign(1, 0);
  for (const PhaseRings& phase : phases) {
    first_.push_back(first_.back() + phase.topology.components.size());
  }
  has_copies_ = body != nullptr;
  fates_.clear();
  root_.clear();
  bodies_.clear();
  ring_groups_.clear();
  if (!has_copies_) return;
  particles_ = body->particles;
  window_ = body->window;
  for (std::size_t k = 0; k < window_.axes.size(); ++k) {
    std::optional<PeriodicAxis>& axis = window_.axes[k];
    if (axis) axis = PeriodicAxis{axis->origin / cell_size, axis->length / cell_size};
    reach_[k] = body->reach[k] / cell_size;
  }
  fates_.resize(RegionCount());
  for (std::size_t k = 0; k < phases.size(); ++k) {
    const PhaseRings& phase = phases[k];
    // All nodes of a region lie in one component of the body, so each run sets the same fate.
    phase.topology.components.ForEachRun(
        phase.crossings,
        [&](std::uint32_t tile, int j, std::uint32_t mask, std::uint32_t component) {
          const std::uint32_t of_body =
              outline.topology.components.At(outline.crossings, {tile, std::countr_zero(mask), j});
          fates_[first_[k] + component] = body->fates[of_body];
        });
  }
  GroupRings(*body, outline);
}

void PhaseImages::GroupRings(const Percolation& body, const BodyOutline& outline) {
  const RingTopology& topology = outline.topology;
  ring_groups_.assign(topology.RingCount(), kNoRing);
  first_ring_.assign(topology.components.size(), kNoRing);
  for (std::uint32_t ring = 0; ring < topology.RingCount(); ++ring) {
    const std::uint32_t number = outline.placed.kept_as[ring];
    if (number == kNoRing || topology.outer_of[ring] != kNoRing || !body.IsCut(topology, ring)) {
      continue;
    }
    std::uint32_t& first = first_ring_[body.bodies[topology.component_of_ring[ring]]];
    if (first == kNoRing) first = number;
    ring_groups_[number] = first;
  }
}

bool PhaseImages::IsInReach(const Point& at) const {
  const std::array<double, 2> coordinates{at.x, at.y};
  for (std::size_t k = 0; k < coordinates.size(); ++k) {
    const std::optional<PeriodicAxis>& axis = window_.axes[k];
    if (!axis) continue;
    const double above = coordinates[k] - axis->origin;
    if (above < -reach_[k] || above > axis->length + reach_[k]) return false;
  }
  return true;
}

void PhaseImages::Join(std::uint32_t a, std::uint32_t b) {
  a = partiemc::RootOf(root_, a);
  b = partiemc::RootOf(root_, b);
  root_[std::max(a, b)] = std::min(a, b);
}

void PhaseImages::JoinByParticles(std::span<const std::uint32_t> originals,
                                  std::span<std::uint32_t> region_of) {
  for (std::size_t copy = 0; copy < originals.size(); ++copy) {
    if (copy % kItemsPerCheck == 0) ThrowIfCancelled();
    const std::uint32_t of_copy = region_of[particles_ + copy];
    if (of_copy == kNoComponent || !IsCut(of_copy)) continue;
    std::uint32_t& of_given = region_of[originals[copy]];
    // The lattice lies differently at a copy. Further copies join the region of this copy.
    if (of_given == kNoComponent) of_given = of_copy;
    if (IsCut(of_given)) Join(of_copy, of_given);
  }
}

void PhaseImages::JoinByNodes(const TileDirectory& directory, std::span<const PhaseRings> phases,
                              std::span<const std::uint32_t> region_of) {
  is_empty_.resize(RegionCount());
  for (std::uint32_t region = 0; region < RegionCount(); ++region) {
    is_empty_[region] = IsCut(region) ? 1 : 0;
  }
  for (const std::uint32_t region : region_of) {
    if (region != kNoComponent) is_empty_[region] = 0;
  }
  if (std::ranges::find(is_empty_, std::uint8_t{1}) == is_empty_.end()) return;
  const auto cells = [&](std::size_t axis) {
    return window_.axes[axis] ? std::llround(window_.axes[axis]->length) : 0;
  };
  const std::int64_t x = cells(0), y = cells(1);
  const std::array<Node, 4> shifts{{{x, 0}, {0, y}, {x, y}, {x, -y}}};
  for (std::size_t phase = 0; phase < phases.size(); ++phase) {
    const Components& components = phases[phase].topology.components;
    const Crossings& crossings = phases[phase].crossings;
    components.ForEachRun(
        crossings, [&](std::uint32_t tile, int j, std::uint32_t mask, std::uint32_t component) {
          const std::uint32_t region = RegionOf(phase, component);
          if (is_empty_[region] == 0) return;
          const Node node{(std::int64_t{directory[tile].x} << kTileShift) + std::countr_zero(mask),
                          (std::int64_t{directory[tile].y} << kTileShift) + j};
          if (!IsInReach(node.Position())) return;
          for (const Node& shift : shifts) {
            const Node image{node.x + shift.x, node.y + shift.y};
            const TilePlace place = PlaceOf(directory, image);
            if (!IsInside(crossings, place) || !IsInReach(image.Position())) continue;
            const std::uint32_t other = RegionOf(phase, components.At(crossings, place));
            if (is_empty_[other] != 0) Join(region, other);
          }
        });
  }
}

void PhaseImages::JoinImages(std::span<const std::uint32_t> originals,
                             const TileDirectory& directory, std::span<const PhaseRings> phases,
                             std::span<std::uint32_t> region_of) {
  root_.resize(RegionCount());
  std::iota(root_.begin(), root_.end(), 0u);
  JoinByParticles(originals, region_of);
  JoinByNodes(directory, phases, region_of);
  bodies_.resize(RegionCount());
  for (std::size_t phase = 0; phase + 1 < first_.size(); ++phase) {
    for (std::uint32_t region = first_[phase]; region < first_[phase + 1]; ++region) {
      root_[region] = partiemc::RootOf(root_, region);
      bodies_[region] = root_[region] - first_[phase];
    }
  }
}

Percolation PhaseImages::OfPhase(const Percolation& body, std::size_t phase) const {
  const std::uint32_t first = first_[phase], count = first_[phase + 1] - first;
  return {body.window, body.particles, std::span(fates_).subspan(first, count),
          std::span(bodies_).subspan(first, count)};
}

double LengthInWindow(const Point& from, const Point& to, const Window& window) {
  const std::array<double, 2> at{from.x, from.y}, step{to.x - from.x, to.y - from.y};
  double first = 0, last = 1;
  for (std::size_t k = 0; k < 2; ++k) {
    if (!window.axes[k]) continue;
    const double low = window.axes[k]->origin - at[k], high = low + window.axes[k]->length;
    if (step[k] == 0) {
      if (low > 0 || high < 0) return 0;
      continue;
    }
    const double a = low / step[k], b = high / step[k];
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  return std::max(last - first, 0.0) * std::sqrt(step[0] * step[0] + step[1] * step[1]);
}

}  // namespace partiemc
