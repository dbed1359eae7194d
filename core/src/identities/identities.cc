#include "identities/identities.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "base/bits.h"

namespace partiemc {
namespace {

// The number of a ring. Assigns the next number if the ring has none.
std::uint32_t NumberOf(std::uint32_t ring, IdentityScratch& s) {
  if (s.number[ring] == kNoRing) {
    s.number[ring] = static_cast<std::uint32_t>(s.topology_ring.size());
    s.topology_ring.push_back(ring);
  }
  return s.number[ring];
}

// The outer ring that stands for the body of a ring that will be cut.
std::uint32_t StandInOf(const IdentityInput& input, std::uint32_t ring) {
  return input.percolation->OuterOf(input.topology, input.topology.component_of_ring[ring]);
}

struct NodeWindow {
  std::array<std::int64_t, 2> first{}, last{};

  // Shortens a run to the window. Returns false if nothing is left.
  bool Clip(NodeRun& run) const {
    if (run.row < first[1] || run.row > last[1]) return false;
    if (run.last < first[0] || run.first > last[0]) return false;
    run.first = static_cast<std::int32_t>(std::max<std::int64_t>(run.first, first[0]));
    run.last = static_cast<std::int32_t>(std::min<std::int64_t>(run.last, last[0]));
    return true;
  }
};

NodeWindow NodesOf(const Window& window, double cell_size) {
  constexpr std::int64_t kFar = std::int64_t{1} << 40;
  NodeWindow nodes{{-kFar, -kFar}, {kFar, kFar}};
  for (std::size_t k = 0; k < 2; ++k) {
    if (!window.axes[k]) continue;
    const auto [origin, length] = *window.axes[k];
    nodes.first[k] = static_cast<std::int64_t>(std::ceil(origin / cell_size));
    nodes.last[k] = static_cast<std::int64_t>(std::ceil((origin + length) / cell_size)) - 1;
  }
  return nodes;
}

// Calls visit(run, ring) for each run of this frame that belongs to a kept ring of the topology.
// Each run lies between two crossed edges of a row. `run.ring` is 0.
template <typename Visit>
void ForEachRun(const IdentityInput& input, IdentityScratch& s, const Visit& visit) {
  const RingTopology& topology = input.topology;
  CrossedEdge last;
  s.rows.SetRings(input.crossings, topology.segments, topology.offsets);
  s.rows.ForEachEdge(input.bins.tiles, input.crossings, [&](const CrossedEdge& edge) {
    const CrossedEdge from = last;
    last = edge;
    if (from.ring == kNoRing || from.row != edge.row) return;
    std::uint32_t ring = edge.ring;
    if (!edge.begins_inside) {  // The nodes of the run are inside.
      if (topology.outer_of[ring] != kNoRing) ring = topology.outer_of[ring];
    } else if (topology.outer_of[ring] == kNoRing) {
      ring = from.ring;  // A run between outer rings is in no hole.
      if (topology.outer_of[ring] == kNoRing) return;
    }
    if (input.placed.kept_as[ring] == kNoRing) return;
    visit(NodeRun{edge.row, from.column + 1, edge.column, 0}, ring);
  });
}

// Numbers each body that will be cut but has no node in the box (Percolation::window), and adds all
// runs of its outer rings.
void AddBodiesBesideNodes(const IdentityInput& input, IdentityScratch& s,
                          std::vector<NodeRun>& runs) {
  const RingTopology& topology = input.topology;
  const auto has_number = [&](std::uint32_t ring) {
    return s.number[StandInOf(input, ring)] != kNoRing;
  };
  bool any = false;
  for (std::uint32_t ring = 0; ring < topology.RingCount(); ++ring) {
    any |= topology.outer_of[ring] == kNoRing && input.percolation->IsCut(topology, ring) &&
           !has_number(ring);
  }
  if (!any) return;
  const std::size_t numbered = s.topology_ring.size();
  ForEachRun(input, s, [&](NodeRun run, std::uint32_t ring) {
    if (topology.outer_of[ring] != kNoRing || !input.percolation->IsCut(topology, ring)) return;
    if (has_number(ring) && s.number[StandInOf(input, ring)] < numbered) return;
    run.ring = NumberOf(StandInOf(input, ring), s);
    runs.push_back(run);
  });
  std::ranges::sort(runs, ComesBefore<NodeRun>);
}

// Collects the runs of this frame and numbers the rings. Every ring has a run: it encloses a node,
// so it crosses the row of that node. Only the nodes in the window count for a body that will be
// cut. Its holes without such nodes get no number.
void CollectRuns(const IdentityInput& input, IdentityScratch& s, std::vector<NodeRun>& runs) {
  const RingTopology& topology = input.topology;
  const NodeWindow window = input.percolation != nullptr
                                ? NodesOf(input.percolation->window, input.cell_size)
                                : NodeWindow{};
  runs.clear();
  s.number.assign(topology.RingCount(), kNoRing);
  s.topology_ring.clear();
  ForEachRun(input, s, [&](NodeRun run, std::uint32_t ring) {
    if (input.percolation != nullptr && input.percolation->IsCut(topology, ring)) {
      if (!window.Clip(run)) return;
      const std::uint32_t outer = StandInOf(input, ring);
      NumberOf(outer, s);
      if (topology.outer_of[ring] == kNoRing) ring = outer;
    }
    run.ring = NumberOf(ring, s);
    runs.push_back(run);
  });
  if (input.percolation != nullptr) AddBodiesBesideNodes(input, s, runs);
}

// Gives the outer rings of all images of a body that will be cut the number of the body.
void ShareNumbers(const IdentityInput& input, IdentityScratch& s) {
  if (input.percolation == nullptr) return;
  const RingTopology& topology = input.topology;
  for (std::uint32_t ring = 0; ring < topology.RingCount(); ++ring) {
    const bool is_outer = topology.outer_of[ring] == kNoRing;
    if (is_outer && input.percolation->IsCut(topology, ring)) {
      s.number[ring] = s.number[StandInOf(input, ring)];
    }
  }
}

// Fills the arrays by number, and finds the outer ring of each component.
void FillNumberedRings(const IdentityInput& input, IdentityScratch& s) {
  const RingTopology& topology = input.topology;
  s.rings.clear();
  s.particle_count.clear();
  for (const std::uint32_t ring : s.topology_ring) {
    const std::uint32_t outer = topology.outer_of[ring];
    s.rings.push_back(
        {.is_hole = outer != kNoRing, .outer = outer == kNoRing ? kNoRing : s.number[outer]});
  }
  s.particle_count.assign(s.rings.size(), 0);
  for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
    if (s.number[ring] != kNoRing)
      s.particle_count[s.number[ring]] += topology.particle_count[ring];
  }
  s.ring_of_component.assign(input.topology.components.size(), kNoRing);
  for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
    if (topology.outer_of[ring] != kNoRing) continue;
    s.ring_of_component[input.topology.component_of_ring[ring]] = s.number[ring];
  }
}

// Passes on identities along the largest relations first. Gives new identities to the other rings.
void AssignIdentities(const RingHistory& previous, IdentityScratch& s, RingHistory& next) {
  FindContinued(previous.rings.size(), s.rings.size(), s.is_continued, s.relations, s.continues);
  next.identities_given = previous.identities_given;
  for (std::size_t number = 0; number < s.rings.size(); ++number) {
    const std::uint32_t before = s.continues[number];
    s.rings[number].identity =
        before != kNoIndex ? previous.rings[before].identity : ++next.identities_given;
  }
}

void WriteResult(const RingHistory& previous, std::span<const std::uint32_t> kept_as,
                 IdentityScratch& s, Rings& rings) {
  for (std::size_t ring = 0; ring < kept_as.size(); ++ring) {
    if (kept_as[ring] == kNoRing) continue;
    const std::uint32_t number = s.number[ring];
    if (number != kNoRing) rings.measures[kept_as[ring]].identity = s.rings[number].identity;
    auto relation = std::ranges::lower_bound(s.relations, number, {}, &Relation::now);
    for (; relation != s.relations.end() && relation->now == number; ++relation) {
      rings.parents.push_back(previous.rings[relation->before].identity);
    }
    rings.parent_offsets.push_back(static_cast<std::uint32_t>(rings.parents.size()));
  }
}

// Writes the history: rings sorted by identity, and runs and samples with indices of these rings.
void WriteHistory(const IdentityInput& input, IdentityScratch& s, RingHistory& next) {
  const std::size_t count = s.rings.size();
  std::vector<std::uint32_t>& by_identity = s.by_identity;
  by_identity.resize(count);
  std::iota(by_identity.begin(), by_identity.end(), 0u);
  std::ranges::sort(by_identity, {}, [&](std::uint32_t k) { return s.rings[k].identity; });
  s.rank.resize(count);
  for (std::uint32_t place = 0; place < count; ++place) s.rank[by_identity[place]] = place;
  next.rings.clear();
  for (const std::uint32_t number : by_identity) {
    KnownRing& ring = next.rings.emplace_back(s.rings[number]);
    if (ring.outer != kNoRing) ring.outer = s.rank[ring.outer];
  }
  for (NodeRun& run : next.runs) run.ring = s.rank[run.ring];
  next.samples = s.tracks.by_id.samples;
  for (ParticleSample& sample : next.samples) sample.ring = s.rank[sample.ring];
  std::ranges::sort(next.samples, {}, &ParticleSample::hash);
  next.time.reset();
  if (std::isfinite(input.frame.time)) next.time = input.frame.time;
  next.box = input.box_to_store;
}

}  // namespace

void ContinueRings(const IdentityInput& input, const RingHistory& last, IdentityScratch& scratch,
                   RingHistory& next, Rings& rings) {
  if (input.box_motion.any) MoveWithBox(input.box_motion, last, scratch.carried);
  const RingHistory& previous = input.box_motion.any ? scratch.carried : last;
  CollectRuns(input, scratch, next.runs);
  ShareNumbers(input, scratch);
  FillNumberedRings(input, scratch);
  FollowParticles({.frame = input.frame,
                   .plane = input.plane,
                   .particles = {.ids = input.frame.ids,
                                 .bins = input.bins,
                                 .crossings = input.crossings,
                                 .components = input.topology.components,
                                 .ring_of_component = scratch.ring_of_component,
                                 .particle_count = scratch.particle_count,
                                 .percolation = input.percolation,
                                 .subset = input.subset}},
                  previous, scratch.rings, scratch.tracks);
  RelatePieces<RingPieces>(previous,
                           {.runs = next.runs,
                            .pieces = scratch.rings,
                            .found = scratch.tracks.by_id.found,
                            .has_ids = !input.frame.ids.empty(),
                            .time = input.frame.time,
                            .cell_size = input.cell_size,
                            .periods = input.periods},
                           scratch.relation_scratch, scratch.relations);
  AssignIdentities(previous, scratch, next);
  WriteResult(previous, input.placed.kept_as, scratch, rings);
  WriteHistory(input, scratch, next);
}

}  // namespace partiemc
