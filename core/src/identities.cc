#include "identities.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <tuple>

namespace partiemc {
namespace {

// Rings that share less than this part of the smaller one's nodes are neighbours of which one
// moved into the other's place, not continuations.
constexpr std::uint64_t kSmallestPart = 4;

// Where each ring of the topology is in the result: placing vertices may have dropped it.
void FindKeptRings(const RingTopology& topology, const PlacedVertices& placed,
                   std::vector<std::uint32_t>& result_ring) {
  result_ring.assign(topology.RingCount(), kNoRing);
  std::uint32_t kept = 0;
  for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
    if (placed.point_of_segment[topology.offsets[ring]] != kNoPoint) result_ring[ring] = kept++;
  }
}

// The number of a ring, given to it now if it has none.
std::uint32_t NumberOf(std::uint32_t ring, const RingTopology& topology, IdentityScratch& s) {
  if (s.number[ring] == kNoRing) {
    s.number[ring] = static_cast<std::uint32_t>(s.topology_ring.size());
    s.topology_ring.push_back(ring);
    s.is_hole.push_back(topology.outer_of[ring] != kNoRing);
  }
  return s.number[ring];
}

// The runs of this frame, with numbers of rings. Each run lies between two crossed edges. Every
// ring has one: it encloses a node, hence crosses that node's row.
void CollectRuns(const TileDirectory& directory, const Crossings& crossings,
                 const RingTopology& topology, IdentityScratch& s, std::vector<NodeRun>& runs) {
  runs.clear();
  s.number.assign(topology.RingCount(), kNoRing);
  s.topology_ring.clear();
  s.is_hole.clear();
  CrossedEdge last;
  s.rows.SetRings(crossings, topology.segments, topology.offsets);
  s.rows.ForEachEdge(directory, crossings, [&](const CrossedEdge& edge) {
    const CrossedEdge from = last;
    last = edge;
    if (from.ring == kNoRing || from.row != edge.row) return;
    std::uint32_t ring = edge.ring;
    if (!edge.begins_inside) {  // The nodes in between are inside.
      if (topology.outer_of[ring] != kNoRing) ring = topology.outer_of[ring];
    } else if (topology.outer_of[ring] == kNoRing) {
      ring = from.ring;  // A void between two islands is next to no hole's ring.
      if (topology.outer_of[ring] == kNoRing) return;
    }
    if (s.result_ring[ring] == kNoRing) return;
    runs.push_back({edge.row, from.column + 1, edge.column, NumberOf(ring, topology, s)});
  });
}

std::uint64_t NodeCount(std::int32_t first, std::int32_t last) {
  return static_cast<std::uint64_t>(std::int64_t{last} - first + 1);
}

void CountNodes(std::span<const NodeRun> runs, std::size_t rings,
                std::vector<std::uint64_t>& nodes) {
  nodes.assign(rings, 0);
  for (const NodeRun& run : runs) nodes[run.ring] += NodeCount(run.first, run.last);
}

// The nodes that each pair of rings shares: one pass over both frames' runs.
void FindOverlaps(const RingHistory& previous, std::span<const NodeRun> runs, IdentityScratch& s) {
  std::vector<RingOverlap>& overlaps = s.overlaps;
  overlaps.clear();
  for (std::size_t a = 0, b = 0; a < previous.runs.size() && b < runs.size();) {
    const NodeRun& before = previous.runs[a];
    const NodeRun& now = runs[b];
    const std::int32_t first = std::max(before.first, now.first);
    const std::int32_t last = std::min(before.last, now.last);
    if (before.row == now.row && first <= last &&
        previous.rings[before.ring].is_hole == (s.is_hole[now.ring] != 0)) {
      overlaps.push_back({before.ring, now.ring, NodeCount(first, last)});
    }
    // The run that ends first meets no further one.
    ++(std::tie(before.row, before.last) < std::tie(now.row, now.last) ? a : b);
  }
  std::sort(overlaps.begin(), overlaps.end(), [](const RingOverlap& x, const RingOverlap& y) {
    return std::tie(x.before, x.now) < std::tie(y.before, y.now);
  });
  std::size_t kept = 0;
  for (const RingOverlap& overlap : overlaps) {
    if (kept > 0 && overlaps[kept - 1].before == overlap.before &&
        overlaps[kept - 1].now == overlap.now) {
      overlaps[kept - 1].nodes += overlap.nodes;
    } else {
      overlaps[kept++] = overlap;
    }
  }
  overlaps.resize(kept);
}

// Keeps the pairs that are related.
void KeepRelated(const RingHistory& previous, std::span<const NodeRun> runs, IdentityScratch& s) {
  const std::size_t count_now = s.topology_ring.size();
  CountNodes(previous.runs, previous.rings.size(), s.nodes_before);
  CountNodes(runs, count_now, s.nodes_now);
  s.linked_before.assign(previous.rings.size(), 0);
  s.linked_now.assign(count_now, 0);
  for (RingOverlap& pair : s.overlaps) {
    const std::uint64_t smaller = std::min(s.nodes_before[pair.before], s.nodes_now[pair.now]);
    pair.counts = pair.nodes >= smaller / kSmallestPart + (smaller % kSmallestPart != 0);
    if (pair.counts) s.linked_before[pair.before] = s.linked_now[pair.now] = 1;
  }
  std::erase_if(s.overlaps, [&](const RingOverlap& pair) {
    return !pair.counts && (s.linked_before[pair.before] || s.linked_now[pair.now]);
  });
}

// Hands identities on along the largest overlaps, then gives new ones.
void GiveIdentities(const RingHistory& previous, IdentityScratch& s, RingHistory& next) {
  s.identity.assign(s.topology_ring.size(), 0);
  std::sort(s.overlaps.begin(), s.overlaps.end(), [](const RingOverlap& x, const RingOverlap& y) {
    return std::tie(y.nodes, x.before, x.now) < std::tie(x.nodes, y.before, y.now);
  });
  std::vector<std::uint8_t>& is_continued = s.linked_before;
  is_continued.assign(previous.rings.size(), 0);
  for (const RingOverlap& pair : s.overlaps) {
    if (is_continued[pair.before] || s.identity[pair.now] != 0) continue;
    is_continued[pair.before] = 1;
    s.identity[pair.now] = previous.rings[pair.before].identity;
  }
  next.identities_given = previous.identities_given;
  for (std::uint64_t& identity : s.identity) {
    if (identity == 0) identity = ++next.identities_given;
  }
}

// Identities and parents into the result.
void Tell(const RingHistory& previous, IdentityScratch& s, Rings& rings) {
  std::sort(s.overlaps.begin(), s.overlaps.end(), [](const RingOverlap& x, const RingOverlap& y) {
    return std::tie(x.now, x.before) < std::tie(y.now, y.before);
  });
  std::vector<std::uint32_t>& first_overlap = s.rank;
  first_overlap.assign(s.topology_ring.size() + 1, 0);
  for (const RingOverlap& pair : s.overlaps) ++first_overlap[pair.now + 1];
  std::partial_sum(first_overlap.begin(), first_overlap.end(), first_overlap.begin());
  for (std::size_t ring = 0; ring < s.result_ring.size(); ++ring) {
    if (s.result_ring[ring] == kNoRing) continue;
    const std::uint32_t number = s.number[ring];
    rings.measures[s.result_ring[ring]].identity = s.identity[number];
    for (std::uint32_t k = first_overlap[number]; k < first_overlap[number + 1]; ++k) {
      rings.parents.push_back(previous.rings[s.overlaps[k].before].identity);
    }
    rings.parent_offsets.push_back(static_cast<std::uint32_t>(rings.parents.size()));
  }
}

// Rings by identity, and the runs with indices into them.
void Remember(IdentityScratch& s, RingHistory& next) {
  next.rings.clear();
  for (std::size_t number = 0; number < s.identity.size(); ++number) {
    next.rings.push_back({s.identity[number], s.is_hole[number] != 0});
  }
  std::sort(next.rings.begin(), next.rings.end(),
            [](const KnownRing& x, const KnownRing& y) { return x.identity < y.identity; });
  s.rank.resize(s.identity.size());
  for (std::size_t number = 0; number < s.identity.size(); ++number) {
    const auto place = std::lower_bound(
        next.rings.begin(), next.rings.end(), s.identity[number],
        [](const KnownRing& ring, std::uint64_t identity) { return ring.identity < identity; });
    s.rank[number] = static_cast<std::uint32_t>(place - next.rings.begin());
  }
  for (NodeRun& run : next.runs) run.ring = s.rank[run.ring];
}

}  // namespace

void ContinueRings(const TileDirectory& directory, const Crossings& crossings,
                   const RingTopology& topology, const PlacedVertices& placed,
                   const RingHistory& previous, IdentityScratch& scratch, RingHistory& next,
                   Rings& rings) {
  FindKeptRings(topology, placed, scratch.result_ring);
  CollectRuns(directory, crossings, topology, scratch, next.runs);
  FindOverlaps(previous, next.runs, scratch);
  KeepRelated(previous, next.runs, scratch);
  GiveIdentities(previous, scratch, next);
  Tell(previous, scratch, rings);
  Remember(scratch, next);
}

}  // namespace partiemc
