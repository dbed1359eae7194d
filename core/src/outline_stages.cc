#include "outline_stages.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "bins/cell_mask.h"
#include "field/slice_field.h"
#include "frame/frame_view.h"
#include "frame/in_stage.h"
#include "frame/placement_traits.h"
#include "frame_lengths.h"
#include "mesh/touched_cells.h"
#include "normals/grain_crossings.h"
#include "workspace_bytes.h"

namespace partiemc {
namespace {

void SumMeasures(const Rings& rings, FrameStatistics& statistics) {
  for (const RingMeasures& measures : rings.measures) {
    statistics.area += measures.area;
    statistics.perimeter += measures.perimeter;
  }
}

// Fills in the statistics that no stage sets.
void Summarise(const Workspace::Buffers& b, Result& result) {
  FrameStatistics& statistics = result.statistics;
  statistics.tiles = b.bins.tiles.size();
  statistics.active_cells = b.crossings.cells.size();
  statistics.dropped_holes = b.topology.dropped_holes;
  statistics.dropped_components = b.topology.dropped_components;
  statistics.dropped_spray = b.topology.dropped_spray;
  SumMeasures(result.rings, statistics);
}

void ClearIdentities(Rings& rings) {
  for (RingMeasures& measures : rings.measures) measures.identity = 0;
  rings.parents.clear();
  rings.parent_offsets.assign(1, 0);
}

std::uint64_t AttributeValuesOf(const Frame& frame) {
  std::uint64_t values = 0;
  for (const Attribute& attribute : frame.attributes) values += attribute.components;
  return values;
}

// Adds the sizes of a mesh over these interior cells to `size`.
void AddMesh(const ReconstructionParameters& parameters, const std::vector<BitRows>& interior,
             FrameSize& size) {
  if (parameters.fill == Fill::kGrid) size.grid_cells = CountCells(interior);
  if (HasBlocks(parameters) && size.attribute_values > 0) {
    size.block_cells = CountCells(interior);
    size.block_tiles = interior.size() - std::ranges::count_if(interior, IsEmpty);
  }
}

// Requires: TraceRings has run.
FrameSize SizeOf(const ReconstructionParameters& parameters, const Frame& frame,
                 const Workspace::Buffers& b) {
  FrameSize size{.particles = frame.ParticleCount(),
                 .tiles = b.bins.tiles.size(),
                 .segments = b.topology.segments.size(),
                 .attribute_values = AttributeValuesOf(frame),
                 .phases = CountPhases(parameters)};
  AddMesh(parameters, b.crossings.interior, size);
  return size;
}

// Stage 1 of a frame that has passed CheckFrame. Sets `seen` to the particles that the later stages
// use: the frame, or the slab around a slice. `lengths` stays empty if the particles give no
// estimate of the spacing. Errors: see Reconstruct.
absl::Status SortParticles(const OutlineTask& task, Workspace::Buffers& b, Frame& seen,
                           std::optional<Lengths>& lengths, Scale& scale,
                           FrameStatistics& statistics) {
  const ReconstructionParameters& parameters = task.parameters;
  const Frame& frame = task.frame;
  seen = frame;
  statistics.particles = frame.ParticleCount();
  if (task.prepared != nullptr) {
    lengths = task.prepared->lengths;
    statistics.doubts = task.prepared->doubts;
    statistics.particles = task.prepared->lifted.particles;
  } else {
    auto decided = DecideLengths(parameters, frame, task.previous, b.spacing);
    if (!decided.ok()) return decided.status();
    lengths = *decided;
  }
  if (!lengths) {
    if (frame.ParticleCount() > 0) statistics.doubts.Add(Doubt::kSpacingProvisional);
    return absl::OkStatus();
  }
  statistics.spacing = lengths->spacing;
  statistics.cell_size = lengths->cell_size;
  const double spacing = lengths->spacing;
  const double usual = parameters.slice ? spacing * spacing * spacing : spacing * spacing;
  absl::Status status;
  if (parameters.sizes == Sizes::kOwn) {
    const auto sizes = RangeOfSizes(frame, parameters, *lengths);
    if (!sizes.ok()) return sizes.status();
    scale = MakeScale(parameters, spacing, lengths->cell_size, usual, *sizes);
  } else {
    const auto lightest = LightestVolume(frame, usual, statistics.doubts);
    if (!lightest.ok()) return lightest.status();
    scale = MakeScale(parameters, spacing, lengths->cell_size, *lightest);
  }
  if (parameters.slice) {
    b.slab.Take(frame, *parameters.slice, parameters.kernel_radius * spacing);
    seen = b.slab.AsFrame();
  }
  status = BinParticles(seen, parameters.plane, scale, task.limits, b.bins);
  if (!status.ok()) return status;
  if (parameters.slice) SetHeights(b.slab.heights(), scale, b.bins);
  return JudgeLengths(seen, parameters.plane, *lengths, scale, b.bins, statistics.doubts);
}

// Finds the tiles near walls. Adds the numbers of tiles, lines and pairs to `size`. Errors:
// RESOURCE_EXHAUSTED if memory is short.
absl::Status FindWalls(const OutlineTask& task, const Scale& scale, FrameSize& size,
                       FrameMemory& memory, Workspace::Buffers& b) {
  const TileDirectory& directory = b.bins.tiles;
  InStage(task.observer, Stage::kField, [&] {
    b.walls.ListLines({task.walls.fixed, task.walls.of_particles, task.walls.are_obstacles},
                      scale.cell_size, directory);
  });
  size.wall_pairs = b.walls.PairCount();
  size.wall_lines = b.walls.lines().edges().size();
  size.wall_tiles = b.walls.TileCount();
  if (absl::Status status = memory.ReserveOutline(size); !status.ok()) return status;
  InStage(task.observer, Stage::kField, [&] { b.walls.FindTiles(directory); });
  return absl::OkStatus();
}

std::uint64_t CountInside(const LevelSet& level_set) {
  std::uint64_t count = 0;
  for (const BitRows& rows : level_set.inside) {
    for (const std::uint32_t row : rows) count += static_cast<std::uint64_t>(CountBits(row));
  }
  return count;
}

// Cuts the fluid at the walls.
void ApplyWalls(const Scale& scale, Workspace::Buffers& b, Doubts& doubts) {
  const std::uint64_t before = CountInside(b.level_set);
  b.walls.Apply(b.bins, scale, b.level_set);
  if (3 * CountInside(b.level_set) < before) doubts.Add(Doubt::kWallsHideFluid);
}

// Runs the stages field, crossings and rings.
void FindRings(const OutlineTask& task, const Scale& scale, Workspace::Buffers& b, Doubts& doubts) {
  StageObserver* const observer = task.observer;
  InStage(observer, Stage::kField, [&] {
    scale.is_slice ? SampleSlice(b.bins, scale, b.level_set)
                   : SampleField(b.bins, scale, b.level_set);
    if (task.walls.Any()) ApplyWalls(scale, b, doubts);
  });
  InStage(observer, Stage::kCrossings,
          [&] { FindCrossings(b.bins.tiles, b.level_set, b.crossings); });
  InStage(observer, Stage::kRings, [&] {
    TraceRings(b.bins, b.level_set, scale, task.parameters, b.crossings, b.ring_scratch, b.topology,
               task.HasCopies());
  });
}

// Rings to be filled with triangles.
struct FillTask {
  const OutlineTask& outline;
  const Frame& frame;
  const Scale& scale;
  const Crossings& crossings;
  const RingTopology& topology;
  const PlacedVertices& placed;
  ParticleSubset particles;  // All, or those of one phase.
};

// Runs the stages mesh and attributes for `result.rings`. Requires: `b.attribute_scratch.sorted` is
// empty or of this frame. Errors: INTERNAL if BuildMesh fails, which is a bug.
absl::Status FillRings(const FillTask& task, Workspace::Buffers& b, Result& result) {
  const ReconstructionParameters& parameters = task.outline.parameters;
  const Frame& frame = task.frame;
  StageObserver* const observer = task.outline.observer;
  const auto at_points = [&](std::span<const double> points) -> std::span<const AttributeValues> {
    InterpolateAttributes(frame, b.bins, task.scale, points, b.attribute_scratch, b.node_attributes,
                          task.particles);
    return b.node_attributes;
  };
  const AttributeSource attributes = {.frame = frame,
                                      .bins = b.bins,
                                      .at_points = at_points,
                                      .tolerance = parameters.attribute_tolerance};
  const bool has_blocks = HasBlocks(parameters) && !frame.attributes.empty();
  const bool is_filled = InStage(observer, Stage::kMesh, [&] {
    return BuildMesh({b.bins.tiles, task.crossings, task.topology, b.planes, task.placed,
                      result.rings, parameters, task.scale, has_blocks ? &attributes : nullptr},
                     b.mesh_scratch, result.mesh, result.statistics);
  });
  if (!is_filled) return absl::InternalError("rings cannot be triangulated");
  if (frame.attributes.empty()) return absl::OkStatus();
  InStage(observer, Stage::kAttributes, [&] {
    InterpolateAttributes(frame, b.bins, task.scale, VerticesOf(result.rings, result.mesh),
                          b.attribute_scratch, result.attributes, task.particles);
  });
  return absl::OkStatus();
}

// Divides the outline among the phases. Errors: RESOURCE_EXHAUSTED if memory is short; INTERNAL if
// RepairPhases fails, which is a bug.
absl::Status DividePhases(const OutlineTask& task, const Frame& frame, const Scale& scale,
                          FrameMemory& memory, Workspace::Buffers& b, Rings& rings) {
  PhaseInput input{frame,       task.parameters, task.variant,     scale,  b.bins,
                   b.crossings, b.topology,      b.vertex_scratch, b.walls};
  if (b.last.percolation) {
    input.percolation = &*b.last.percolation;
    input.originals = task.prepared->lifted.originals;
  }
  InStage(task.observer, Stage::kVertices, [&] { MapPhases(input, b.phases); });
  FrameSize size = SizeOf(task.parameters, frame, b);
  size.interface_points = InterfacePointsOf(b.phases);
  // A phase has points of the body and of interfaces.
  if (task.HasCopies()) size.cut_segments = size.segments + size.interface_points;
  if (absl::Status status = memory.ReserveOutline(size); !status.ok()) return status;
  const bool is_divided = InStage(task.observer, Stage::kVertices,
                                  [&] { return PlacePhases(input, b.placed, b.phases, rings); });
  if (is_divided) return absl::OkStatus();
  return absl::InternalError("outlines of phases cross although every point is at its root");
}

// Rings of the body or of a phase, and what they consist of.
struct RingParts {
  const Percolation& percolation;
  Crossings& crossings;
  const RingTopology& topology;
  PlacedVertices& placed;
  Rings& rings;
};

RingCutInput CutInput(const RingParts& parts, const OutlineTask& task, const Scale& scale) {
  return {parts.percolation, parts.topology, scale.spacing * scale.cell_size,
          HasPhases(task.parameters)};
}

// Whether the outlines of all phases can be cut with these steps. Overwrites `b.placed_phase`.
bool CanCutPhases(const OutlineTask& task, const Scale& scale, int steps, Workspace::Buffers& b) {
  for (std::size_t k = 0; k < CountPhases(task.parameters); ++k) {
    const Percolation percolation = b.phases.images.OfPhase(*b.last.percolation, k);
    PhaseRings& phase = b.phases.rings[k];
    const RingParts parts{percolation, phase.crossings, phase.topology, b.placed_phase,
                          b.phase_rings};
    WritePhaseRings(b.phases, scale, static_cast<PhaseLabel>(k + 1), b.placed_phase, b.phase_rings);
    RemoveGoneRings(percolation, phase.topology, b.placed_phase, b.phase_rings);
    if (!CanCutRings(CutInput(parts, task, scale), steps, b.ring_cut, b.placed_phase,
                     b.phase_rings)) {
      return false;
    }
  }
  return true;
}

// Cuts rings at the faces of the box, and their interior cells. Returns false if this is not
// possible with these steps.
bool CutParts(const OutlineTask& task, const Scale& scale, int steps, const RingParts& parts,
              Workspace::Buffers& b, FrameStatistics& statistics) {
  const TileDirectory& directory = b.bins.tiles;
  if (TraitsOf(task.parameters.placement).refines) {
    // Before the cut drops the segments outside of the window: while their vertices moved, these
    // segments may have passed over cells inside.
    ExcludeTouchedCells(directory, parts.rings.points, parts.rings.offsets, parts.placed.roots,
                        scale.cell_size, parts.crossings.interior);
  }
  if (!CutRings(CutInput(parts, task, scale), steps, b.ring_cut, parts.placed, parts.rings,
                statistics.cut_bodies)) {
    return false;
  }
  ClearOutside(parts.percolation, directory, parts.topology.components, scale.cell_size,
               parts.crossings);
  return true;
}

// Cuts the outline of the body with the fewest steps with which all its phases can be cut, too.
bool CutOutline(const OutlineTask& task, const Scale& scale, const RingParts& parts,
                Workspace::Buffers& b, FrameStatistics& statistics) {
  for (int& steps = b.last.cut_steps = 0; steps < kMostCutSteps; ++steps) {
    if (CanCutPhases(task, scale, steps, b) && CutParts(task, scale, steps, parts, b, statistics)) {
      return true;
    }
  }
  return false;
}

// Keeps the next state of an outline, unless its lengths are provisional. Then no next frame could
// continue its rings, so they lose their identities.
void KeepState(const Lengths& lengths, Workspace::Buffers& b, NextState& next, Result& result) {
  if (lengths.is_provisional) {
    ClearIdentities(result.rings);
    return;
  }
  next.is_kept = true;
  next.state.cell_size = lengths.cell_size;
  next.state.spacing = lengths.spacing;
  std::swap(next.state.history, b.next_history);
}

// Runs the stages from normals to attributes. Errors: RESOURCE_EXHAUSTED if memory for phases is
// short; INTERNAL if rings cannot be repaired, cut or triangulated, which is a bug.
absl::Status FillOutline(const OutlineTask& task, const Frame& frame, const Scale& scale,
                         FrameMemory& memory, Workspace::Buffers& b, Result& result) {
  const ReconstructionParameters& parameters = task.parameters;
  const State& previous = task.previous;
  StageObserver* const observer = task.observer;
  InStage(observer, Stage::kNormals, [&] {
    const PlacementTraits& traits = TraitsOf(parameters.placement);
    b.sampler.Build(b.bins, b.crossings, scale, traits.Reach(scale.kernel_radius),
                    traits.takes_particles);
    if (scale.has_grains) {
      FindGrainCrossings(b.bins.tiles, b.level_set, b.crossings, b.sampler, b.topology);
    }
    // In a periodic box, a body may have changed its image since the last frame.
    const bool is_lifted = task.prepared != nullptr && task.prepared->is_lifted;
    const auto known =
        is_lifted ? std::span<const CellNormal>() : std::span<const CellNormal>(previous.normals);
    EstimateNormals({b.bins, b.crossings, b.topology, b.sampler, parameters}, known,
                    b.normal_scratch, b.planes, b.next_normals);
  });
  std::optional<Percolation>& percolation = b.last.percolation;
  percolation.reset();
  if (task.HasCopies()) {
    const Prepared& prepared = *task.prepared;
    ChooseBodies({.lifted = prepared.lifted,
                  .window = prepared.window,
                  .reach = prepared.reach,
                  .parameters = parameters,
                  .spacing = scale.spacing * scale.cell_size,
                  .cell_size = scale.cell_size,
                  .bins = b.bins,
                  .crossings = b.crossings},
                 b.choice, b.topology);
    percolation =
        Percolation{prepared.window, static_cast<std::uint32_t>(prepared.lifted.particles),
                    b.choice.fates, b.choice.bodies, prepared.reach};
  }
  const bool is_placed = InStage(observer, Stage::kVertices, [&] {
    b.next_area_offset = previous.area_offset;
    return PlaceVertices({frame, b.bins, b.level_set, b.crossings, b.topology, b.sampler, b.planes,
                          parameters, task.variant, scale, percolation ? &*percolation : nullptr,
                          task.walls.Any() ? &b.walls : nullptr},
                         b.next_area_offset, b.vertex_scratch, b.placed, result.rings);
  });
  if (!is_placed) return absl::InternalError("rings cross although every vertex is at its root");
  result.statistics.self_intersections = b.placed.self_intersections;
  if (HasPhases(parameters)) {
    if (absl::Status status = DividePhases(task, frame, scale, memory, b, result.rings);
        !status.ok()) {
      return status;
    }
  }
  if (percolation) RemoveGoneRings(*percolation, b.topology, b.placed, result.rings);
  InStage(observer, Stage::kIdentities, [&] {
    ContinueRings({frame,
                   parameters.plane,
                   b.bins,
                   b.crossings,
                   b.topology,
                   b.placed,
                   scale.cell_size,
                   PeriodsOf(parameters, task.frame, scale.cell_size),
                   percolation ? &*percolation : nullptr,
                   {},
                   MotionInPlane(parameters, task.frame, previous.history.box, scale.cell_size),
                   BoxToStore(parameters.box, task.frame.box)},
                  previous.history, b.identity_scratch, b.next_history, result.rings);
  });
  if (percolation &&
      !CutOutline(task, scale, {*percolation, b.crossings, b.topology, b.placed, result.rings}, b,
                  result.statistics)) {
    return absl::InternalError("rings cannot be cut at the faces of the box");
  }
  b.attribute_scratch.sorted.clear();
  return FillRings({task, frame, scale, b.crossings, b.topology, b.placed, {}}, b, result);
}

}  // namespace

absl::Status ReconstructOutline(const OutlineTask& task, FrameMemory& memory, Workspace::Buffers& b,
                                NextState& next, Result& result) {
  const ReconstructionParameters& parameters = task.parameters;
  StageObserver* const observer = task.observer;
  Frame seen;
  std::optional<Lengths> lengths;
  Scale scale;
  next.is_kept = false;
  b.last.lengths.reset();
  b.last.doubts = {};
  absl::Status status = InStage(observer, Stage::kBins, [&] {
    absl::Status checked = task.is_first
                               ? CheckFrame(task.frame, parameters, task.limits, b.distinct_ids)
                               : absl::OkStatus();
    return checked.ok() ? SortParticles(task, b, seen, lengths, scale, result.statistics) : checked;
  });
  b.last.doubts = result.statistics.doubts;
  if (!status.ok() || !lengths) return status;
  FrameSize size{.particles = seen.ParticleCount(),
                 .tiles = b.bins.tiles.size(),
                 .attribute_values = AttributeValuesOf(seen),
                 .phases = CountPhases(parameters)};
  status = task.walls.Any() ? FindWalls(task, scale, size, memory, b) : memory.ReserveOutline(size);
  if (!status.ok()) return status;
  FindRings(task, scale, b, result.statistics.doubts);
  b.last.doubts = result.statistics.doubts;
  FrameSize whole = SizeOf(parameters, seen, b);
  if (task.HasCopies()) whole.cut_segments = whole.segments;
  whole.wall_tiles = size.wall_tiles;
  whole.wall_pairs = size.wall_pairs;
  whole.wall_lines = size.wall_lines;
  status = memory.ReserveOutline(whole);
  if (!status.ok()) return status;
  status = FillOutline(task, seen, scale, memory, b, result);
  if (!status.ok()) return status;
  Summarise(b, result);
  b.last.frame = seen;
  b.last.lengths = lengths;
  b.last.scale = scale;
  b.last.doubts = result.statistics.doubts;
  next.state.area_offset = b.next_area_offset;
  std::swap(next.state.normals, b.next_normals);
  KeepState(*lengths, b, next, result);
  return absl::OkStatus();
}

absl::Status ReconstructPhase(const OutlineTask& task, PhaseLabel label, FrameMemory& memory,
                              Workspace::Buffers& b, NextState& next, Result& result) {
  next.is_kept = false;
  const LastOutline& last = b.last;
  const std::size_t copies = task.HasCopies() ? task.prepared->lifted.originals.size() : 0;
  const auto given = std::span(b.phases.labels).first(b.phases.labels.size() - copies);
  result.statistics.particles = static_cast<std::uint64_t>(std::ranges::count(given, label));
  result.statistics.doubts = last.doubts;
  if (!last.lengths) return absl::OkStatus();
  PhaseRings& phase = b.phases.rings[label - 1u];
  FrameSize size{.segments = phase.points.size(),
                 .cut_segments = last.percolation ? phase.points.size() : 0,
                 .attribute_values = AttributeValuesOf(last.frame)};
  AddMesh(task.parameters, phase.crossings.interior, size);
  absl::Status status = memory.ReserveOutline(size);
  if (!status.ok()) return status;
  WritePhaseRings(b.phases, last.scale, label, b.placed_phase, result.rings);
  std::optional<Percolation> percolation;
  if (last.percolation) {
    percolation = b.phases.images.OfPhase(*last.percolation, label - 1u);
    RemoveGoneRings(*percolation, phase.topology, b.placed_phase, result.rings);
  }
  InStage(task.observer, Stage::kIdentities, [&] {
    ContinueRings({last.frame,
                   task.parameters.plane,
                   b.bins,
                   phase.crossings,
                   phase.topology,
                   b.placed_phase,
                   last.scale.cell_size,
                   PeriodsOf(task.parameters, task.frame, last.scale.cell_size),
                   percolation ? &*percolation : nullptr,
                   {b.phases.labels, label},
                   MotionInPlane(task.parameters, task.frame, task.previous.history.box,
                                 last.scale.cell_size),
                   BoxToStore(task.parameters.box, task.frame.box)},
                  task.previous.history, b.identity_scratch, b.next_history, result.rings);
  });
  if (percolation &&
      !CutParts(task, last.scale, last.cut_steps,
                {*percolation, phase.crossings, phase.topology, b.placed_phase, result.rings}, b,
                result.statistics)) {
    return absl::InternalError("a phase cannot be cut at the faces of the box");
  }
  status = FillRings({task,
                      last.frame,
                      last.scale,
                      phase.crossings,
                      phase.topology,
                      b.placed_phase,
                      {b.phases.labels, label}},
                     b, result);
  if (!status.ok()) return status;
  FrameStatistics& statistics = result.statistics;
  statistics.tiles = b.bins.tiles.size();
  statistics.active_cells = phase.crossings.cells.size();
  statistics.spacing = last.lengths->spacing;
  statistics.cell_size = last.lengths->cell_size;
  SumMeasures(result.rings, statistics);
  // A phase has neither cell normals nor an area offset.
  next.state.normals.clear();
  next.state.area_offset.reset();
  KeepState(*last.lengths, b, next, result);
  return absl::OkStatus();
}

}  // namespace partiemc
