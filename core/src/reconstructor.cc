#include "partiemc/reconstructor.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation.h"
#include "bins/cell_mask.h"
#include "core/internal/research.h"
#include "field/slice_field.h"
#include "frame/frame_view.h"
#include "frame/in_stage.h"
#include "frame/placement_traits.h"
#include "frame_lengths.h"
#include "frame_memory.h"
#include "mesh/touched_cells.h"
#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"
#include "prepared_frame.h"
#include "workspace.h"
#include "workspace_bytes.h"

namespace partiemc {
namespace {

// Empties a result, but keeps the buffers of rings and mesh.
void MakeEmpty(Result& result) {
  result.Clear();
  result.attributes.clear();
  result.surface.attributes.clear();
  result.sections.clear();
}

// Sets the names and component counts of attributes, so that an outline without points lists them,
// too.
void Name(std::span<const Attribute> attributes, std::vector<AttributeValues>& values) {
  values.resize(attributes.size());
  for (std::size_t k = 0; k < attributes.size(); ++k) {
    values[k].name = attributes[k].name;
    values[k].components = attributes[k].components;
  }
}

void Prepare(std::span<const Attribute> attributes, const ReconstructionParameters& parameters,
             Result& result) {
  const bool is_surface = parameters.output == Output::kSurface;
  const std::size_t sections = parameters.sections.size();
  result.Clear();
  Name(is_surface ? std::span<const Attribute>() : attributes, result.attributes);
  result.sections.resize(sections);
  for (Result& section : result.sections) Name(attributes, section.attributes);
}

// The parameters of a section, not yet resolved.
ReconstructionParameters ParametersOf(ReconstructionParameters parameters, const Section& section) {
  parameters.output = Output::kOutline;
  parameters.sections.clear();
  if (section.slice) parameters.slice = section.slice;
  parameters.isovalue = section.isovalue;
  return parameters;
}

// Fills in the statistics that no stage sets.
void Summarise(const Workspace::Buffers& b, Result& result) {
  FrameStatistics& statistics = result.statistics;
  statistics.tiles = b.bins.tiles.size();
  statistics.active_cells = b.crossings.cells.size();
  statistics.dropped_holes = b.topology.dropped_holes;
  statistics.dropped_components = b.topology.dropped_components;
  statistics.dropped_spray = b.topology.dropped_spray;
  for (const RingMeasures& measures : result.rings.measures) {
    statistics.area += measures.area;
    statistics.perimeter += measures.perimeter;
  }
}

// Removes the identities from the rings of a frame with provisional lengths: such a frame leaves no
// state, so the next frame could not continue them.
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

// Requires: segments are known.
FrameSize SizeOf(const ReconstructionParameters& parameters, const Frame& frame,
                 const Workspace::Buffers& b) {
  FrameSize size{.particles = frame.ParticleCount(),
                 .tiles = b.bins.tiles.size(),
                 .segments = b.topology.segments.size(),
                 .attribute_values = AttributeValuesOf(frame)};
  if (parameters.fill == Fill::kGrid) size.grid_cells = CountCells(b.crossings.interior);
  if (HasBlocks(parameters) && size.attribute_values > 0) {
    size.block_cells = CountCells(b.crossings.interior);
    size.block_tiles =
        b.crossings.interior.size() - std::ranges::count_if(b.crossings.interior, IsEmpty);
  }
  return size;
}

// The input of one outline of a frame.
struct OutlineTask {
  const ReconstructionParameters& parameters;
  const VirtualPlaneVariant variant;
  const FrameLimits& limits;
  const Frame& frame;
  const State& previous;
  StageObserver* observer;
  bool is_first;             // The first outline checks the frame.
  const Prepared* prepared;  // Null for a frame as given.

  bool HasCopies() const { return prepared != nullptr && prepared->HasCopies(); }
};

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
    const auto sizes = RangeOfSizes(frame, parameters.kernel_radius, *lengths);
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

// Runs the stages field, crossings and rings.
void FindRings(const OutlineTask& task, const Scale& scale, Workspace::Buffers& b) {
  StageObserver* const observer = task.observer;
  InStage(observer, Stage::kField, [&] {
    scale.is_slice ? SampleSlice(b.bins, scale, b.level_set)
                   : SampleField(b.bins, scale, b.level_set);
  });
  InStage(observer, Stage::kCrossings,
          [&] { FindCrossings(b.bins.tiles, b.level_set, b.crossings); });
  InStage(observer, Stage::kRings, [&] {
    TraceRings(b.bins, b.level_set, scale, task.parameters, b.crossings, b.ring_scratch, b.topology,
               task.HasCopies());
  });
}

// Runs the stages from normals to mesh. Errors: INTERNAL if RepairRings or BuildMesh fails, which
// is a bug; their comments explain why no input should cause it.
absl::Status FillOutline(const OutlineTask& task, const Frame& frame, const Scale& scale,
                         Workspace::Buffers& b, Result& result) {
  const ReconstructionParameters& parameters = task.parameters;
  const State& previous = task.previous;
  StageObserver* const observer = task.observer;
  InStage(observer, Stage::kNormals, [&] {
    const PlacementTraits& traits = TraitsOf(parameters.placement);
    b.sampler.Build(b.bins, b.crossings, scale, traits.Reach(scale.kernel_radius),
                    traits.takes_particles);
    // In a periodic box, a body may have changed its image since the last frame.
    const bool is_lifted = task.prepared != nullptr && task.prepared->is_lifted;
    const auto known =
        is_lifted ? std::span<const CellNormal>() : std::span<const CellNormal>(previous.normals);
    EstimateNormals({b.bins, b.crossings, b.topology, b.sampler, parameters}, known,
                    b.normal_scratch, b.planes, b.next_normals);
  });
  const bool percolates = task.HasCopies();
  Percolation percolation;
  if (percolates) {
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
    percolation = {prepared.window, static_cast<std::uint32_t>(prepared.lifted.particles),
                   b.choice.fates, b.choice.bodies};
  }
  const bool is_placed = InStage(observer, Stage::kVertices, [&] {
    b.next_area_offset = previous.area_offset;
    return PlaceVertices({frame, b.bins, b.level_set, b.crossings, b.topology, b.sampler, b.planes,
                          parameters, task.variant, scale, percolates ? &percolation : nullptr},
                         b.next_area_offset, b.vertex_scratch, b.placed, result.rings);
  });
  if (!is_placed) return absl::InternalError("rings cross although every vertex is at its root");
  result.statistics.self_intersections = b.placed.self_intersections;
  if (percolates) RemoveGoneRings(percolation, b.topology, b.placed, result.rings);
  InStage(observer, Stage::kIdentities, [&] {
    ContinueRings(
        {frame, parameters.plane, b.bins, b.crossings, b.topology, b.placed, scale.cell_size,
         PeriodsOf(parameters, frame, scale.cell_size), percolates ? &percolation : nullptr},
        previous.history, b.identity_scratch, b.next_history, result.rings);
  });
  if (percolates) {
    const double spacing = scale.spacing * scale.cell_size;
    if (TraitsOf(parameters.placement).refines) {
      // Rings may have moved away from cells that they pass only outside of the window.
      ExcludeTouchedCells(b.bins.tiles, result.rings.points, result.rings.offsets, b.placed.roots,
                          scale.cell_size, b.crossings.interior);
    }
    if (!CutRings({percolation, b.topology, spacing}, b.ring_cut, b.placed, result.rings,
                  result.statistics.cut_bodies)) {
      return absl::InternalError("rings cannot be cut at the faces of the box");
    }
    ClearOutside(percolation, b.bins.tiles, b.topology.components, scale.cell_size, b.crossings);
  }
  b.attribute_scratch.sorted.clear();
  const auto at_points = [&](std::span<const double> points) -> std::span<const AttributeValues> {
    InterpolateAttributes(frame, b.bins, scale, points, b.attribute_scratch, b.node_attributes);
    return b.node_attributes;
  };
  const AttributeSource attributes = {.frame = frame,
                                      .bins = b.bins,
                                      .at_points = at_points,
                                      .tolerance = parameters.attribute_tolerance};
  const bool has_blocks = HasBlocks(parameters) && !frame.attributes.empty();
  const bool is_filled = InStage(observer, Stage::kMesh, [&] {
    return BuildMesh({b.bins.tiles, b.crossings, b.topology, b.planes, b.placed, result.rings,
                      parameters, scale, has_blocks ? &attributes : nullptr},
                     b.mesh_scratch, result.mesh, result.statistics);
  });
  if (!is_filled) return absl::InternalError("rings cannot be triangulated");
  return absl::OkStatus();
}

// Computes one outline and its next state. Errors: see Reconstruct.
absl::Status ReconstructOutline(const OutlineTask& task, FrameMemory& memory, Workspace::Buffers& b,
                                NextState& next, Result& result) {
  const ReconstructionParameters& parameters = task.parameters;
  StageObserver* const observer = task.observer;
  Frame seen;
  std::optional<Lengths> lengths;
  Scale scale;
  next.is_kept = false;
  absl::Status status = InStage(observer, Stage::kBins, [&] {
    absl::Status checked = task.is_first
                               ? CheckFrame(task.frame, parameters, task.limits, b.distinct_ids)
                               : absl::OkStatus();
    return checked.ok() ? SortParticles(task, b, seen, lengths, scale, result.statistics) : checked;
  });
  if (!status.ok() || !lengths) return status;
  status = memory.ReserveOutline({.particles = seen.ParticleCount(),
                                  .tiles = b.bins.tiles.size(),
                                  .attribute_values = AttributeValuesOf(seen)});
  if (!status.ok()) return status;
  FindRings(task, scale, b);
  FrameSize size = SizeOf(parameters, seen, b);
  if (task.HasCopies()) size.cut_segments = size.segments;
  status = memory.ReserveOutline(size);
  if (!status.ok()) return status;
  status = FillOutline(task, seen, scale, b, result);
  if (!status.ok()) return status;
  if (!seen.attributes.empty()) {
    InStage(observer, Stage::kAttributes, [&] {
      InterpolateAttributes(seen, b.bins, scale, VerticesOf(result.rings, result.mesh),
                            b.attribute_scratch, result.attributes);
    });
  }
  Summarise(b, result);
  if (lengths->is_provisional) {
    ClearIdentities(result.rings);
    return absl::OkStatus();
  }
  next.is_kept = true;
  next.state.cell_size = lengths->cell_size;
  next.state.spacing = lengths->spacing;
  next.state.area_offset = b.next_area_offset;
  std::swap(next.state.normals, b.next_normals);
  std::swap(next.state.history, b.next_history);
  return absl::OkStatus();
}

// Commits the new state of one outline. Buffers are swapped, so that both states keep their memory.
void CommitState(NextState& next, State& state) {
  if (!next.is_kept) return;
  state.cell_size = next.state.cell_size;
  state.spacing = next.state.spacing;
  state.area_offset = next.state.area_offset;
  std::swap(state.normals, next.state.normals);
  std::swap(state.history, next.state.history);
}

// The parameters of a surface in the form of SurfaceReconstructor.
SurfaceParameters SurfaceParametersOf(const ReconstructionParameters& parameters) {
  SurfaceParameters surface;
  switch (parameters.placement) {
    case Placement::kMarchingSquares:
      surface.placement = SurfacePlacement::kMarchingCubes;
      break;
    case Placement::kQef:
      surface.placement = SurfacePlacement::kQef;
      break;
    case Placement::kFarthestParticle:  // Validate refuses it.
    case Placement::kVirtualPlane:
      surface.placement = SurfacePlacement::kVirtualPlane;
      break;
  }
  surface.spacing = *parameters.spacing;
  surface.kernel_radius = parameters.kernel_radius;
  surface.cell_size = parameters.cell_size;
  surface.reference_radius = parameters.reference_radius;
  surface.clean = parameters.clean;
  surface.thinning_distance = parameters.surface.thinning_distance;
  surface.max_drop_particles = parameters.surface.max_drop_particles;
  surface.simplify = parameters.surface.simplify;
  surface.min_component_volume = parameters.surface.min_component_volume;
  surface.min_component_particles = parameters.min_component_particles;
  surface.box = parameters.box;
  return surface;
}

// Fills in the statistics of a frame that has become a surface.
void SummariseSurface(const ReconstructionParameters& parameters, const Frame& frame,
                      Result& result) {
  const Surface& surface = result.surface;
  FrameStatistics& statistics = result.statistics;
  statistics.particles = frame.ParticleCount();
  statistics.tiles = surface.statistics.bricks;
  statistics.dropped_holes = surface.statistics.dropped_cavities;
  statistics.dropped_components = surface.statistics.dropped_components;
  statistics.dropped_spray = surface.statistics.dropped_spray;
  statistics.triangles = surface.TriangleCount();
  statistics.spacing = *parameters.spacing;
  statistics.cell_size = parameters.cell_size * *parameters.spacing;
  for (const ShellMeasures& measures : surface.measures) {
    statistics.area += measures.area;
    statistics.volume += measures.volume;
  }
}

// CORRUPT_STATE if the state belongs to a stream with another output.
absl::Status CheckOutput(const State& state, Output output) {
  const bool is_other = output == Output::kSurface ? state.cell_size.has_value()
                                                   : state.surface.cell_size.has_value();
  if (!is_other) return absl::OkStatus();
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(kReasonCorruptState), "state", "of another output",
                         "must be of a stream with the output " + std::string(Name(output))});
}

}  // namespace

Workspace::Workspace() : buffers_(std::make_unique<Buffers>()) {}
Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

Reconstructor::Reconstructor(const ReconstructionParameters& parameters, const FrameLimits& limits,
                             const VirtualPlaneVariant& variant)
    : parameters_(Resolve(parameters)),
      limits_(limits),
      variant_(std::make_shared<const VirtualPlaneVariant>(variant)) {
  for (const Section& section : parameters.sections) {
    sections_.push_back(Resolve(ParametersOf(parameters, section)));
  }
  if (parameters.output == Output::kSurface) {
    // Validate has accepted the parameters.
    surface_ = std::make_shared<const SurfaceReconstructor>(
        *SurfaceReconstructor::Create(SurfaceParametersOf(parameters_), limits));
  }
}

absl::StatusOr<Reconstructor> Reconstructor::Create(const ReconstructionParameters& parameters,
                                                    const FrameLimits& limits) {
  return CreateVariant(parameters, {}, limits);
}

absl::StatusOr<Reconstructor> CreateVariant(const ReconstructionParameters& parameters,
                                            const VirtualPlaneVariant& variant,
                                            const FrameLimits& limits) {
  if (absl::Status status = Validate(parameters); !status.ok()) return status;
  if (absl::Status status = Validate(limits); !status.ok()) return status;
  return Reconstructor(parameters, limits, variant);
}

absl::Status Reconstructor::Reconstruct(const Frame& frame, State& state, Workspace& workspace,
                                        Result& result, const FrameControl& control) const {
  const CancellationScope scope(control.cancelled);
  Prepare(frame.attributes, parameters_, result);
  absl::Status status;
  try {
    status = ReconstructOrThrow(frame, state, workspace.buffers(), result, control);
  } catch (...) {
    // The exception may have left the buffers in any state.
    workspace = Workspace();
    MakeEmpty(result);
    try {
      throw;
    } catch (const Cancelled&) {
      return absl::CancelledError("the frame was cancelled");
    }
  }
  if (!status.ok()) MakeEmpty(result);
  return status;
}

absl::Status Reconstructor::ReconstructOrThrow(const Frame& given, State& state,
                                               Workspace::Buffers& b, Result& result,
                                               const FrameControl& control) const {
  absl::Status status = CheckOutput(state, parameters_.output);
  if (!status.ok()) return status;
  const bool is_surface = surface_ != nullptr;
  const bool is_prepared = IsPrepared(parameters_);
  b.next_states.resize(std::max(b.next_states.size(), 1 + sections_.size()));
  FrameMemory memory(control.memory);
  const State unseen;
  Frame frame = given;
  Prepared prepared;
  if (is_prepared) {
    status = InStage(control.observer, Stage::kBins, [&] {
      return PrepareFrame({parameters_, limits_, given, state}, memory,
                          {b.distinct_ids, b.spacing, b.noise, b.lift}, frame, prepared);
    });
    if (!status.ok()) return status;
  }
  const auto reconstruct = [&](const ReconstructionParameters& parameters, const State& previous,
                               std::size_t outline, Result& into) {
    const bool is_first = outline == (is_surface ? 1 : 0) && !is_prepared;
    absl::Status outlined =
        ReconstructOutline({parameters, VariantFor(parameters, *variant_), limits_, frame, previous,
                            control.observer, is_first, is_prepared ? &prepared : nullptr},
                           memory, b, b.next_states[outline], into);
    memory.Done();
    return outlined;
  };
  if (!is_surface) status = reconstruct(parameters_, state, 0, result);
  for (std::size_t k = 0; status.ok() && k < sections_.size(); ++k) {
    const State& previous = k < state.sections.size() ? state.sections[k] : unseen;
    status = reconstruct(sections_[k], previous, k + 1, result.sections[k]);
  }
  if (!status.ok()) return status;
  state.sections.reserve(sections_.size());
  if (is_surface) {
    // The last step that can fail, because it commits its state.
    status = surface_->Reconstruct(
        frame, state.surface, b.surface, result.surface,
        {.observer = control.observer, .memory = &memory, .cancelled = control.cancelled});
    if (!status.ok()) return status;
    SummariseSurface(parameters_, given, result);
  } else {
    CommitState(b.next_states[0], state);
  }
  state.sections.resize(sections_.size());
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    CommitState(b.next_states[k + 1], state.sections[k]);
  }
  if (prepared.is_filtered) std::swap(state.noise, b.noise.next);
  if (!parameters_.noise_filter) state.noise = {};
  return absl::OkStatus();
}

}  // namespace partiemc
