#include "identities/ring_relations.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>

namespace partiemc {
namespace {

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

// Moves the rings of the last frame forward, unless both frames have ids (`by_samples`), and the
// rings of this frame backward.
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

bool AreOfOneKind(const RingHistory& previous, const RingsNow& now, std::uint32_t before,
                  std::uint32_t number) {
  return previous.rings[before].is_hole == now.rings[number].is_hole;
}

// Moves runs, then wraps them into the box if there is one.
std::span<const NodeRun> Moved(std::span<const NodeRun> runs, std::span<const CellShift> shifts,
                               const LatticePeriods& periods, RelationScratch& s) {
  MoveRuns(runs, shifts, s.moved);
  if (!periods.Any()) return s.moved;
  WrapRuns(s.moved, periods, s.wrapped);
  return s.wrapped;
}

// The runs of both frames, unmoved, wrapped into the box if there is one.
struct ComparedRuns {
  std::span<const NodeRun> before, now;
};
ComparedRuns RunsToCompare(const RingHistory& previous, const RingsNow& now, RelationScratch& s) {
  if (!now.periods.Any()) return {previous.runs, now.runs};
  WrapRuns(previous.runs, now.periods, s.wrapped_before);
  WrapRuns(now.runs, now.periods, s.wrapped_now);
  return {s.wrapped_before, s.wrapped_now};
}

// Relates rings by the nodes that they share after moving the last frame's rings forward, or this
// frame's rings backward.
void RelateByNodes(const RingHistory& previous, const RingsNow& now, const ComparedRuns& runs,
                   RelationScratch& s, std::vector<Relation>& relations) {
  const auto add = [&](std::uint32_t before, std::uint32_t number, std::uint64_t nodes) {
    if (AreOfOneKind(previous, now, before, number)) relations.push_back({before, number, nodes});
  };
  FindSharedNodes(Moved(previous.runs, s.shift_before, now.periods, s), runs.now, s.newest,
                  s.shared);
  for (const SharedNodes& pair : s.shared) add(pair.a, pair.b, pair.nodes);
  if (AnyMoves(s.shift_now)) {
    FindSharedNodes(Moved(now.runs, s.shift_now, now.periods, s), runs.before, s.newest, s.shared);
    for (const SharedNodes& pair : s.shared) add(pair.b, pair.a, pair.nodes);
  }
  Unite(relations);
}

void CountSamples(const RingHistory& previous, Evidence& evidence) {
  evidence.sample_count.assign(previous.rings.size(), 0);
  for (const ParticleSample& sample : previous.samples) ++evidence.sample_count[sample.ring];
}

// Relates two rings by their nodes where they are, if moving found no relation that counts for
// either ring: a hole may not follow the body around it, and velocities may be wrong. Skips outer
// rings with samples.
void AddUnmoved(const RingHistory& previous, const RingsNow& now, const ComparedRuns& runs,
                RelationScratch& s, std::vector<Relation>& relations) {
  const Evidence& e = s.evidence;
  FindSharedNodes(runs.before, runs.now, s.newest, s.shared);
  for (const SharedNodes& pair : s.shared) {
    if (!AreOfOneKind(previous, now, pair.a, pair.b)) continue;
    if (e.linked_before[pair.a] || e.linked_now[pair.b]) continue;
    if (!e.sample_count.empty() && e.sample_count[pair.a] > 0) continue;
    relations.push_back({pair.a, pair.b, pair.nodes});
  }
  Unite(relations);
}

}  // namespace

void RelateRings(const RingHistory& previous, const RingsNow& now, RelationScratch& s,
                 std::vector<Relation>& relations) {
  Evidence& e = s.evidence;
  relations.clear();
  CountNodes(previous.runs, previous.rings.size(), e.nodes_before);
  CountNodes(now.runs, now.rings.size(), e.nodes_now);
  s.shift_before.assign(previous.rings.size(), {});
  s.shift_now.assign(now.rings.size(), {});
  e.sample_count.clear();
  const bool by_samples = now.has_ids && !previous.samples.empty();
  if (by_samples) ShiftBySamples(now.found, s);
  ShiftByVelocities(previous, now, by_samples, s);
  MoveHolesAlong(previous.rings, s.shift_before);
  MoveHolesAlong(now.rings, s.shift_now);

  const ComparedRuns runs = RunsToCompare(previous, now, s);
  RelateByNodes(previous, now, runs, s, relations);
  if (by_samples) {
    CountSamples(previous, e);
    AddFoundSamples(now.found, relations);
    ApplySamples(e, relations);
  }
  e.linked_before.assign(previous.rings.size(), 0);
  e.linked_now.assign(now.rings.size(), 0);
  MarkCounting(e, relations);
  if (AnyMoves(s.shift_before) || AnyMoves(s.shift_now)) {
    AddUnmoved(previous, now, runs, s, relations);
    MarkCounting(e, relations);
  }
  DropNeighbours(e, relations);
}

}  // namespace partiemc
