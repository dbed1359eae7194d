#include "identities/ring_relations.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>

namespace partiemc {
namespace {

// Two rings that share fewer than a quarter of the nodes of the smaller one are neighbours: one of
// them moved to where the other was.
constexpr std::uint64_t kSmallestPart = 4;

// For a full set of 16 samples: the largest difference between the share of the samples and the
// share of the nodes, in samples. This is three standard deviations of the samples of a ring that
// splits in halves.
constexpr std::uint64_t kTolerance = 6;

// A ring of the last frame that shares nodes with a ring of this frame, but has no samples in it,
// is not its parent if the samples of other rings account for at least this many quarters of the
// new ring's nodes.
constexpr std::uint64_t kAccountedQuarters = 3;

// Largest movement within a frame, in cells, because lattice coordinates have 32 bits.
constexpr double kMaxShift = 1u << 31;

void CountNodes(std::span<const NodeRun> runs, std::size_t rings,
                std::vector<std::uint64_t>& nodes) {
  nodes.assign(rings, 0);
  for (const NodeRun& run : runs) nodes[run.ring] += NodeCount(run.first, run.last);
}

// Moves holes with their outer rings.
void MoveHolesAlong(std::span<const KnownRing> rings, std::vector<CellShift>& shifts) {
  for (std::size_t ring = 0; ring < shifts.size(); ++ring) {
    if (rings[ring].outer != kNoRing) shifts[ring] = shifts[rings[ring].outer];
  }
}

// The lower median: a few stray particles do not change it much. Requires: not empty.
std::int64_t MedianOf(std::vector<std::int64_t>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Moves each outer ring by the median displacement of its samples.
void ShiftBySamples(std::span<const FoundSample> found, RelationScratch& s) {
  for (std::size_t first = 0, last = 0; first < found.size(); first = last) {
    while (last < found.size() && found[last].before == found[first].before) ++last;
    const auto median = [&](std::int64_t CellShift::*part) {
      s.displacements.clear();
      for (std::size_t k = first; k < last; ++k) {
        s.displacements.push_back(found[k].displacement.*part);
      }
      return MedianOf(s.displacements);
    };
    s.shift_before[found[first].before] = {median(&CellShift::columns), median(&CellShift::rows)};
  }
}

CellShift ShiftOf(double cells_x, double cells_y) {
  if (!(std::abs(cells_x) <= kMaxShift && std::abs(cells_y) <= kMaxShift)) return {};
  return {static_cast<std::int64_t>(std::floor(cells_x + 0.5)),
          static_cast<std::int64_t>(std::floor(cells_y + 0.5))};
}

// Moves the rings of the last frame forward by their velocities, unless samples move them, and the
// rings of this frame backward by their velocities.
void ShiftByVelocities(const RingHistory& previous, const RingsNow& now, bool by_samples,
                       RelationScratch& s) {
  if (!previous.time || !std::isfinite(now.time) || !(now.time > *previous.time)) return;
  const double cells = (now.time - *previous.time) / now.cell_size;
  for (std::size_t ring = 0; ring < previous.rings.size() && !by_samples; ++ring) {
    const KnownRing& known = previous.rings[ring];
    s.shift_before[ring] = ShiftOf(known.velocity_x * cells, known.velocity_y * cells);
  }
  for (std::size_t ring = 0; ring < s.shift_now.size(); ++ring) {
    const KnownRing& known = now.rings[ring];
    s.shift_now[ring] = ShiftOf(-known.velocity_x * cells, -known.velocity_y * cells);
  }
}

bool AnyMoves(const std::vector<CellShift>& shifts) {
  return std::any_of(shifts.begin(), shifts.end(),
                     [](const CellShift& shift) { return shift != CellShift{}; });
}

// Merges the relations of each pair into one, with the maximum of each count.
void Unite(std::vector<RingRelation>& relations) {
  std::sort(relations.begin(), relations.end(), [](const RingRelation& x, const RingRelation& y) {
    return std::tie(x.before, x.now) < std::tie(y.before, y.now);
  });
  std::size_t kept = 0;
  for (const RingRelation& relation : relations) {
    if (kept > 0 && relations[kept - 1].before == relation.before &&
        relations[kept - 1].now == relation.now) {
      RingRelation& same = relations[kept - 1];
      same.nodes = std::max(same.nodes, relation.nodes);
      same.samples = std::max(same.samples, relation.samples);
      same.counts = same.counts || relation.counts;
    } else {
      relations[kept++] = relation;
    }
  }
  relations.resize(kept);
}

bool AreOfOneKind(const RingHistory& previous, const RingsNow& now, std::uint32_t before,
                  std::uint32_t number) {
  return previous.rings[before].is_hole == now.rings[number].is_hole;
}

// Relates rings by the nodes that they share after moving the last frame's rings forward, or this
// frame's rings backward.
void RelateByNodes(const RingHistory& previous, const RingsNow& now, RelationScratch& s,
                   std::vector<RingRelation>& relations) {
  const auto add = [&](std::uint32_t before, std::uint32_t number, std::uint64_t nodes) {
    if (AreOfOneKind(previous, now, before, number)) relations.push_back({before, number, nodes});
  };
  MoveRuns(previous.runs, s.shift_before, s.moved);
  FindSharedNodes(s.moved, now.runs, s.newest, s.shared);
  for (const SharedNodes& pair : s.shared) add(pair.a, pair.b, pair.nodes);
  if (AnyMoves(s.shift_now)) {
    MoveRuns(now.runs, s.shift_now, s.moved);
    FindSharedNodes(s.moved, previous.runs, s.newest, s.shared);
    for (const SharedNodes& pair : s.shared) add(pair.b, pair.a, pair.nodes);
  }
  Unite(relations);
}

void AddFoundSamples(const RingHistory& previous, const RingsNow& now, RelationScratch& s,
                     std::vector<RingRelation>& relations) {
  s.sample_count.assign(previous.rings.size(), 0);
  for (const ParticleSample& sample : previous.samples) ++s.sample_count[sample.ring];
  const std::span<const FoundSample> found = now.found;
  for (std::size_t first = 0, last = 0; first < found.size(); first = last) {
    while (last < found.size() && found[last].before == found[first].before &&
           found[last].now == found[first].now) {
      ++last;
    }
    relations.push_back({.before = found[first].before,
                         .now = found[first].now,
                         .samples = static_cast<std::uint32_t>(last - first)});
  }
  Unite(relations);
}

// Estimates the nodes that a ring passed to another ring: its number of nodes, times the share of
// its samples that are in the other ring.
std::uint64_t NodesBySamples(const RingRelation& relation, const RelationScratch& s) {
  const std::uint64_t nodes = s.nodes_before[relation.before];
  const std::uint64_t count = s.sample_count[relation.before];
  const std::uint64_t carried =
      nodes / count * relation.samples + nodes % count * relation.samples / count;
  return std::min(carried, s.nodes_now[relation.now]);
}

// Whether the samples of a ring agree with its nodes, within the statistical error. False for an
// incomplete set: such a set has all particles of the ring, so it is exact and decides alone.
bool SamplesAgree(std::span<const RingRelation> of_one_ring, const RelationScratch& s) {
  const std::uint32_t ring = of_one_ring.front().before;
  if (s.sample_count[ring] < kMaxSamples) return false;
  const std::uint64_t nodes = s.nodes_before[ring];
  return std::all_of(of_one_ring.begin(), of_one_ring.end(), [&](const RingRelation& relation) {
    const std::uint64_t by_nodes = relation.nodes * kMaxSamples;
    const std::uint64_t by_samples = relation.samples * nodes;
    const std::uint64_t difference =
        std::max(by_nodes, by_samples) - std::min(by_nodes, by_samples);
    return difference <= kTolerance * nodes;
  });
}

// Corrects the shared nodes of all relations of one ring of the last frame by its samples.
void CorrectBySamples(std::span<RingRelation> of_one_ring, const RelationScratch& s) {
  const bool sampled = s.sample_count[of_one_ring.front().before] > 0;
  // If samples and nodes agree, the nodes are more accurate than the estimate from samples.
  const bool by_nodes = !sampled || SamplesAgree(of_one_ring, s);
  for (RingRelation& relation : of_one_ring) {
    if (relation.samples > 0) {
      if (!by_nodes || relation.nodes == 0) relation.nodes = NodesBySamples(relation, s);
    } else if (!by_nodes ||
               4 * s.accounted[relation.now] >= kAccountedQuarters * s.nodes_now[relation.now]) {
      relation.nodes = 0;
    }
  }
}

// Applies the samples of all outer rings to their relations.
void ApplySamples(const RingHistory& previous, RelationScratch& s,
                  std::vector<RingRelation>& relations) {
  s.accounted.assign(s.nodes_now.size(), 0);
  for (const RingRelation& relation : relations) {
    if (relation.samples > 0) s.accounted[relation.now] += NodesBySamples(relation, s);
  }
  for (std::size_t first = 0, last = 0; first < relations.size(); first = last) {
    while (last < relations.size() && relations[last].before == relations[first].before) ++last;
    if (previous.rings[relations[first].before].is_hole) continue;
    CorrectBySamples(std::span(relations).subspan(first, last - first), s);
  }
  std::erase_if(relations, [](const RingRelation& relation) { return relation.nodes == 0; });
}

void MarkCounting(RelationScratch& s, std::vector<RingRelation>& relations) {
  for (RingRelation& relation : relations) {
    const std::uint64_t smaller =
        std::min(s.nodes_before[relation.before], s.nodes_now[relation.now]);
    relation.counts = relation.nodes >= smaller / kSmallestPart + (smaller % kSmallestPart != 0);
    if (relation.counts) s.linked_before[relation.before] = s.linked_now[relation.now] = 1;
  }
}

// Relates two rings by their nodes at the original positions, if moving found no relation for
// either ring: a hole may not follow the body around it, and velocities may be wrong. Skips outer
// rings with samples.
void AddUnmoved(const RingHistory& previous, const RingsNow& now, RelationScratch& s,
                std::vector<RingRelation>& relations) {
  FindSharedNodes(previous.runs, now.runs, s.newest, s.shared);
  for (const SharedNodes& pair : s.shared) {
    if (!AreOfOneKind(previous, now, pair.a, pair.b)) continue;
    if (s.linked_before[pair.a] || s.linked_now[pair.b]) continue;
    if (!s.sample_count.empty() && s.sample_count[pair.a] > 0) continue;
    relations.push_back({pair.a, pair.b, pair.nodes});
  }
  Unite(relations);
}

}  // namespace

void RelateRings(const RingHistory& previous, const RingsNow& now, RelationScratch& s,
                 std::vector<RingRelation>& relations) {
  relations.clear();
  CountNodes(previous.runs, previous.rings.size(), s.nodes_before);
  CountNodes(now.runs, now.rings.size(), s.nodes_now);
  s.shift_before.assign(previous.rings.size(), {});
  s.shift_now.assign(now.rings.size(), {});
  s.sample_count.clear();
  const bool by_samples = now.has_ids && !previous.samples.empty();
  if (by_samples) ShiftBySamples(now.found, s);
  ShiftByVelocities(previous, now, by_samples, s);
  MoveHolesAlong(previous.rings, s.shift_before);
  MoveHolesAlong(now.rings, s.shift_now);

  RelateByNodes(previous, now, s, relations);
  if (by_samples) {
    AddFoundSamples(previous, now, s, relations);
    ApplySamples(previous, s, relations);
  }
  s.linked_before.assign(previous.rings.size(), 0);
  s.linked_now.assign(now.rings.size(), 0);
  MarkCounting(s, relations);
  if (AnyMoves(s.shift_before) || AnyMoves(s.shift_now)) {
    AddUnmoved(previous, now, s, relations);
    MarkCounting(s, relations);
  }
  std::erase_if(relations, [&](const RingRelation& relation) {
    return !relation.counts && (s.linked_before[relation.before] || s.linked_now[relation.now]);
  });
}

}  // namespace partiemc
