#include "space_identities/shell_relations.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>

namespace partiemc::space {
namespace {

void CountNodes(std::span<const ShellRun> runs, std::size_t shells,
                std::vector<std::uint64_t>& nodes) {
  nodes.assign(shells, 0);
  for (const ShellRun& run : runs) nodes[run.shell] += NodeCount(run.first, run.last);
}

/// Moves cavities with their outer shells.
void MoveCavitiesAlong(std::span<const KnownShell> shells, std::vector<NodeShift>& shifts) {
  for (std::size_t shell = 0; shell < shifts.size(); ++shell) {
    if (shells[shell].outer != kNoShell) shifts[shell] = shifts[shells[shell].outer];
  }
}

/// Moves each body by the median displacement of its samples.
void ShiftBySamples(std::span<const FoundShellSample> found, ShellRelationScratch& s) {
  for (std::size_t first = 0, last = 0; first < found.size(); first = last) {
    while (last < found.size() && found[last].before == found[first].before) ++last;
    const auto median = [&](std::int64_t NodeShift::*part) {
      s.displacements.clear();
      for (std::size_t k = first; k < last; ++k) {
        s.displacements.push_back(found[k].displacement.*part);
      }
      return MedianOf(s.displacements);
    };
    s.shift_before[found[first].before] = {median(&NodeShift::x), median(&NodeShift::y),
                                           median(&NodeShift::z)};
  }
}

/// The shift by a velocity over a time in units of one cell per velocity.
NodeShift ShiftOf(const KnownShell& shell, double cells) {
  const auto is_possible = [](double value) { return std::abs(value) <= kMaxShift; };
  const auto rounded = [](double value) {
    return static_cast<std::int64_t>(std::floor(value + 0.5));
  };
  const double x = shell.velocity_x * cells, y = shell.velocity_y * cells,
               z = shell.velocity_z * cells;
  if (!is_possible(x) || !is_possible(y) || !is_possible(z)) return {};
  return {rounded(x), rounded(y), rounded(z)};
}

/// Moves the bodies of the last frame forward by their velocities, unless samples move them, and
/// the bodies of this frame backward by their velocities.
void ShiftByVelocities(const ShellHistory& previous, const ShellsNow& now, bool by_samples,
                       ShellRelationScratch& s) {
  if (!previous.time || !std::isfinite(now.time) || !(now.time > *previous.time)) return;
  const double cells = (now.time - *previous.time) / now.cell_size;
  for (std::size_t shell = 0; shell < previous.shells.size() && !by_samples; ++shell) {
    s.shift_before[shell] = ShiftOf(previous.shells[shell], cells);
  }
  for (std::size_t shell = 0; shell < now.shells.size(); ++shell) {
    s.shift_now[shell] = ShiftOf(now.shells[shell], -cells);
  }
}

bool AnyMoves(const std::vector<NodeShift>& shifts) {
  return std::any_of(shifts.begin(), shifts.end(),
                     [](const NodeShift& shift) { return shift != NodeShift{}; });
}

bool ComesBefore(const ShellRun& a, const ShellRun& b) {
  return std::tie(a.layer, a.row, a.first, a.shell) < std::tie(b.layer, b.row, b.first, b.shell);
}

/// Writes `runs`, moved by the shifts of their shells, to `moved`, sorted by row, then node. Moved
/// runs may overlap. Drops runs that leave the range of coordinates.
void MoveRuns(std::span<const ShellRun> runs, std::span<const NodeShift> shift_of_shell,
              std::vector<ShellRun>& moved) {
  const auto fits = [](std::int64_t value) {
    return value >= std::numeric_limits<std::int32_t>::min() &&
           value <= std::numeric_limits<std::int32_t>::max();
  };
  moved.clear();
  for (const ShellRun& run : runs) {
    const NodeShift& shift = shift_of_shell[run.shell];
    const std::int64_t layer = run.layer + shift.z, row = run.row + shift.y;
    const std::int64_t first = run.first + shift.x, last = run.last + shift.x;
    if (!fits(layer) || !fits(row) || !fits(first) || !fits(last)) continue;
    moved.push_back({static_cast<std::int32_t>(layer), static_cast<std::int32_t>(row),
                     static_cast<std::int32_t>(first), static_cast<std::int32_t>(last), run.shell});
  }
  // Usually the runs are still sorted, because all of them move alike or not at all.
  if (std::is_sorted(moved.begin(), moved.end(), ComesBefore)) return;
  std::sort(moved.begin(), moved.end(), ComesBefore);
}

/// Writes `runs`, wrapped into the periodic box, to `wrapped`, sorted by row, then node.
void WrapRuns(std::span<const ShellRun> runs, const LatticePeriods& periods,
              std::vector<ShellRun>& wrapped) {
  wrapped.clear();
  for (const ShellRun& run : runs) {
    const auto layer = static_cast<std::int32_t>(run.layer - WrapOf(periods.cells[2], run.layer));
    const auto row = static_cast<std::int32_t>(run.row - WrapOf(periods.cells[1], run.row));
    ForEachWrapped(periods.cells[0], run.first, run.last,
                   [&](std::int32_t first, std::int32_t last) {
                     wrapped.push_back({layer, row, first, last, run.shell});
                   });
  }
  std::sort(wrapped.begin(), wrapped.end(), ComesBefore);
}

/// Moves runs, and wraps them if the box is periodic.
std::span<const ShellRun> Moved(std::span<const ShellRun> runs, std::span<const NodeShift> shifts,
                                const LatticePeriods& periods, ShellRelationScratch& s) {
  MoveRuns(runs, shifts, s.moved);
  if (!periods.Any()) return s.moved;
  WrapRuns(s.moved, periods, s.wrapped);
  return s.wrapped;
}

/// The runs of both frames, comparable.
struct ComparedRuns {
  std::span<const ShellRun> before, now;
};
ComparedRuns RunsToCompare(const ShellHistory& previous, const ShellsNow& now,
                           ShellRelationScratch& s) {
  if (!now.periods.Any()) return {previous.runs, now.runs};
  WrapRuns(previous.runs, now.periods, s.wrapped_before);
  WrapRuns(now.runs, now.periods, s.wrapped_now);
  return {s.wrapped_before, s.wrapped_now};
}

bool AreOfOneKind(const ShellHistory& previous, const ShellsNow& now, std::uint32_t before,
                  std::uint32_t number) {
  return previous.shells[before].is_cavity == now.shells[number].is_cavity;
}

/// Relates shells by the nodes that they share after moving the last frame's shells forward, or
/// this frame's shells backward.
void RelateByNodes(const ShellHistory& previous, const ShellsNow& now, const ComparedRuns& runs,
                   ShellRelationScratch& s, std::vector<Relation>& relations) {
  const auto add = [&](std::uint32_t before, std::uint32_t number, std::uint64_t nodes) {
    if (AreOfOneKind(previous, now, before, number)) relations.push_back({before, number, nodes});
  };
  SweepSharedNodes<ShellRun>(Moved(previous.runs, s.shift_before, now.periods, s), runs.now,
                             s.newest, s.shared);
  for (const SharedNodes& pair : s.shared) add(pair.a, pair.b, pair.nodes);
  if (AnyMoves(s.shift_now)) {
    SweepSharedNodes<ShellRun>(Moved(now.runs, s.shift_now, now.periods, s), runs.before, s.newest,
                               s.shared);
    for (const SharedNodes& pair : s.shared) add(pair.b, pair.a, pair.nodes);
  }
  Unite(relations);
}

/// Relates two shells by their nodes at the original positions, if moving found no relation for
/// either: a cavity may not follow the body around it, and velocities may be wrong. Skips bodies
/// with samples.
void AddUnmoved(const ShellHistory& previous, const ShellsNow& now, const ComparedRuns& runs,
                ShellRelationScratch& s, std::vector<Relation>& relations) {
  const Evidence& e = s.evidence;
  SweepSharedNodes<ShellRun>(runs.before, runs.now, s.newest, s.shared);
  for (const SharedNodes& pair : s.shared) {
    if (!AreOfOneKind(previous, now, pair.a, pair.b)) continue;
    if (e.linked_before[pair.a] || e.linked_now[pair.b]) continue;
    if (!e.sample_count.empty() && e.sample_count[pair.a] > 0) continue;
    relations.push_back({pair.a, pair.b, pair.nodes});
  }
  Unite(relations);
}

}  // namespace

void MoveWithBox(const BoxMotion& motion, const ShellHistory& history, ShellHistory& moved) {
  moved = history;
  for (ShellRun& run : moved.runs) {
    run.layer = motion.NodeAt(2, run.layer);
    run.row = motion.NodeAt(1, run.row);
    motion.MoveRun(0, run.first, run.last);
  }
  std::sort(moved.runs.begin(), moved.runs.end(), ComesBefore);
  for (ShellSample& sample : moved.samples) {
    sample.x = motion.NodeAt(0, sample.x);
    sample.y = motion.NodeAt(1, sample.y);
    sample.z = motion.NodeAt(2, sample.z);
  }
}

void RelateShells(const ShellHistory& previous, const ShellsNow& now, ShellRelationScratch& s,
                  std::vector<Relation>& relations) {
  Evidence& e = s.evidence;
  relations.clear();
  CountNodes(previous.runs, previous.shells.size(), e.nodes_before);
  CountNodes(now.runs, now.shells.size(), e.nodes_now);
  s.shift_before.assign(previous.shells.size(), {});
  s.shift_now.assign(now.shells.size(), {});
  e.sample_count.clear();
  const bool by_samples = now.has_ids && !previous.samples.empty();
  if (by_samples) ShiftBySamples(now.found, s);
  ShiftByVelocities(previous, now, by_samples, s);
  MoveCavitiesAlong(previous.shells, s.shift_before);
  MoveCavitiesAlong(now.shells, s.shift_now);

  const ComparedRuns runs = RunsToCompare(previous, now, s);
  RelateByNodes(previous, now, runs, s, relations);
  if (by_samples) {
    e.sample_count.assign(previous.shells.size(), 0);
    for (const ShellSample& sample : previous.samples) ++e.sample_count[sample.shell];
    AddFoundSamples(now.found, relations);
    ApplySamples(e, relations);
  }
  e.linked_before.assign(previous.shells.size(), 0);
  e.linked_now.assign(now.shells.size(), 0);
  MarkCounting(e, relations);
  if (AnyMoves(s.shift_before) || AnyMoves(s.shift_now)) {
    AddUnmoved(previous, now, runs, s, relations);
    MarkCounting(e, relations);
  }
  DropNeighbours(e, relations);
}

}  // namespace partiemc::space
