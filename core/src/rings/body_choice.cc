#include "rings/body_choice.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "base/bits.h"
#include "base/cancellation.h"

namespace partiemc {
namespace {

// Joins the components that share a particle.
void JoinImages(const BodyChoiceInput& input, const RingTopology& topology, BodyChoice& c) {
  const std::uint32_t components = topology.components.size();
  const std::size_t given = input.lifted.particles;
  c.component_of.assign(given + input.lifted.originals.size(), kNoComponent);
  c.given_count.assign(components, 0);
  c.given_weight.assign(components, 0);
  c.has_copies.assign(components, 0);
  c.total.assign(components, 0);
  const bool has_sizes = input.parameters.sizes == Sizes::kOwn;
  c.own_area.assign(has_sizes ? components : 0, 0);
  c.set.resize(components);
  std::iota(c.set.begin(), c.set.end(), 0u);
  std::size_t visited = 0;
  topology.components.ForEachParticle(
      input.bins, input.crossings,
      [&](std::uint32_t, std::uint32_t particle, std::uint32_t component) {
        if (visited++ % kItemsPerCheck == 0) ThrowIfCancelled();
        const std::uint32_t source = input.bins.particles[particle].source;
        c.component_of[source] = component;
        if (source >= given) return;
        ++c.given_count[component];
        if (!input.bins.weight.empty()) c.given_weight[component] += input.bins.weight[particle];
        if (has_sizes) c.own_area[component] += input.lifted.frame.volumes[source];
      });
  for (std::size_t copy = 0; copy < input.lifted.originals.size(); ++copy) {
    if (copy % kItemsPerCheck == 0) ThrowIfCancelled();
    const std::uint32_t of_copy = c.component_of[given + copy];
    if (of_copy == kNoComponent) continue;
    c.has_copies[of_copy] = 1;
    std::uint32_t& of_given = c.component_of[input.lifted.originals[copy]];
    if (of_given == kNoComponent) {
      of_given = of_copy;  // Further copies join this component.
      ++c.total[of_copy];
      if (has_sizes) c.own_area[of_copy] += input.lifted.frame.volumes[given + copy];
    }
    const std::uint32_t a = RootOf(c.set, of_copy), b = RootOf(c.set, of_given);
    c.set[std::max(a, b)] = std::min(a, b);
  }
  for (std::uint32_t component = 0; component < components; ++component) {
    c.has_copies[RootOf(c.set, component)] |= c.has_copies[component];
  }
}

// Whether a ring of the topology lies in the window, widened by `input.reach`.
bool IsWhole(const BodyChoiceInput& input, const RingTopology& topology, std::uint32_t ring) {
  for (std::uint32_t k = topology.offsets[ring]; k < topology.offsets[ring + 1]; ++k) {
    const Point& point = topology.entry_points[k];
    const std::array<double, 2> at{point.x * input.cell_size, point.y * input.cell_size};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto& ends = input.window.axes[axis];
      if (!ends) continue;
      const double above = at[axis] - ends->origin;
      if (above < -input.reach[axis] || above > ends->length + input.reach[axis]) return false;
    }
  }
  return true;
}

// Adds up the particles of each body, and finds the area of its largest image.
void MeasureBodies(const RingTopology& topology, BodyChoice& c) {
  const std::uint32_t components = topology.components.size();
  c.largest.assign(components, 0);
  for (std::uint32_t component = 0; component < components; ++component) {
    const std::uint32_t root = RootOf(c.set, component);
    const std::uint32_t outer = topology.outer_ring[component];
    // A particle has no component if no corner of its cell is inside. The lattice lies differently
    // at a copy, so a copy may have a component although its given particle has none. JoinImages
    // has counted such a particle once in `total`, at the component of that copy, which need not be
    // the root. `given_count` lacks it.
    c.total[root] += std::exchange(c.total[component], 0) + c.given_count[component];
    if (!c.own_area.empty()) c.own_area[root] += std::exchange(c.own_area[component], 0);
    if (outer != kNoRing) {
      c.largest[root] = std::max(c.largest[root], AreaOfRing(topology, outer));
    }
  }
}

// Finds the image of each body that stays whole: the complete image with the most given particles.
// There is none if this image does not have each particle of the body exactly once.
void FindBest(const BodyChoiceInput& input, const RingTopology& topology, BodyChoice& c) {
  const std::uint32_t components = topology.components.size();
  c.best.assign(components, kNoComponent);
  for (std::uint32_t component = 0; component < components; ++component) {
    const std::uint32_t outer = topology.outer_ring[component];
    const std::uint32_t root = RootOf(c.set, component);
    if (outer == kNoRing || !c.has_copies[root] || !IsWhole(input, topology, outer)) continue;
    std::uint32_t& best = c.best[root];
    if (best == kNoComponent || c.given_count[component] > c.given_count[best]) best = component;
  }
  for (std::uint32_t root = 0; root < components; ++root) {
    std::uint32_t& best = c.best[root];
    if (best == kNoComponent) continue;
    // Fewer: particles are missing. More: the image has a particle and its copy.
    if (topology.particle_count[topology.outer_ring[best]] != c.total[root]) best = kNoComponent;
  }
}

bool IsSpray(const BodyChoiceInput& input, const BodyChoice& c, std::uint32_t root) {
  const ReconstructionParameters& parameters = input.parameters;
  const double cell = input.cell_size * input.cell_size;
  const double square = input.spacing * input.spacing / cell;
  const double of_particles =
      c.own_area.empty() ? static_cast<double>(c.total[root]) * square : c.own_area[root] / cell;
  // An image of a long body ends where its copies end, so its area may be too small.
  const double area = std::max(c.largest[root], of_particles);
  return c.total[root] < parameters.min_component_particles ||
         area < parameters.min_component_area * square;
}

Fate FateOf(const BodyChoiceInput& input, const BodyChoice& c, std::uint32_t component,
            std::uint32_t root) {
  if (IsSpray(input, c, root)) return Fate::kGone;
  if (input.parameters.box->wraps) return Fate::kCut;
  if (!c.has_copies[root]) return Fate::kWhole;
  if (c.best[root] == kNoComponent) return Fate::kCut;
  return c.best[root] == component ? Fate::kWhole : Fate::kGone;
}

void DecideFates(const BodyChoiceInput& input, RingTopology& topology, BodyChoice& c) {
  const std::uint32_t components = topology.components.size();
  MeasureBodies(topology, c);
  FindBest(input, topology, c);
  c.fates.resize(components);
  c.bodies.resize(components);
  for (std::uint32_t component = 0; component < components; ++component) {
    const std::uint32_t root = RootOf(c.set, component);
    c.fates[component] = FateOf(input, c, component, root);
    c.bodies[component] = c.fates[component] == Fate::kCut ? root : component;
    if (root == component && IsSpray(input, c, root)) ++topology.dropped_spray;
  }
}

}  // namespace

void ChooseBodies(const BodyChoiceInput& input, BodyChoice& choice, RingTopology& topology) {
  JoinImages(input, topology, choice);
  DecideFates(input, topology, choice);
  for (std::uint32_t component = 0; component < choice.fates.size(); ++component) {
    const std::uint32_t outer = topology.outer_ring[component];
    if (choice.fates[component] != Fate::kCut || outer == kNoRing) continue;
    topology.particle_count[outer] = choice.given_count[component];
    topology.particle_weight[outer] = choice.given_weight[component];
  }
}

}  // namespace partiemc
