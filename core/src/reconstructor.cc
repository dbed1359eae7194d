#include "partiemc/reconstructor.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "base/cancellation.h"
#include "bins/resolution.h"
#include "core/internal/research.h"
#include "frame/frame_view.h"
#include "frame/in_stage.h"
#include "frame_lengths.h"
#include "frame_memory.h"
#include "frame_walls.h"
#include "outline_stages.h"
#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"
#include "periodic/frame_box.h"
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
  // Clear keeps the names of attributes. Removes the names that an earlier surface has left.
  if (!is_surface) result.surface.attributes.clear();
  Name(is_surface ? std::span<const Attribute>() : attributes, result.attributes);
  result.sections.resize(sections);
  for (Result& section : result.sections) Name(attributes, section.attributes);
}

// The parameters of the outline of a Section, not yet resolved.
ReconstructionParameters ParametersOf(ReconstructionParameters parameters, const Section& section) {
  parameters.output = Output::kOutline;
  parameters.sections.clear();
  if (section.slice) parameters.slice = section.slice;
  parameters.isovalue = section.isovalue;
  return parameters;
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
  surface.sizes = parameters.sizes;
  surface.reference_radius = parameters.reference_radius;
  surface.clean = parameters.clean;
  surface.thinning_distance = parameters.surface.thinning_distance;
  surface.max_drop_particles = parameters.surface.max_drop_particles;
  surface.simplify = parameters.surface.simplify;
  surface.min_component_volume = parameters.surface.min_component_volume;
  surface.min_component_particles = parameters.min_component_particles;
  surface.box = parameters.box;
  surface.wall_planes = parameters.wall_planes;
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
  statistics.doubts = surface.statistics.doubts;
  statistics.triangles = surface.TriangleCount();
  statistics.spacing = *parameters.spacing;
  statistics.cell_size = parameters.cell_size * *parameters.spacing;
  for (const ShellMeasures& measures : surface.measures) {
    statistics.area += measures.area;
    statistics.volume += measures.volume;
  }
}

// Errors: CORRUPT_STATE if the state belongs to a stream with another output.
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
  if (!parameters.wall_phases.empty()) {
    walls_ = std::make_shared<const ReconstructionParameters>(WallParametersOf(parameters_));
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
  status = ResolveBox(parameters_.box, frame);
  if (!status.ok()) return status;
  Prepared prepared;
  const bool has_wall_particles = !parameters_.wall_phases.empty();
  if (has_wall_particles || HasPhases(parameters_)) {
    status = CheckFrame(given, parameters_, limits_, b.distinct_ids);
    if (!status.ok()) return status;
  }
  if (has_wall_particles) {
    status = TakeWallParticles(frame, parameters_, state, memory, b, prepared);
    if (!status.ok()) return status;
    frame = b.wall_particles.fluid();
  }
  if (HasPhases(parameters_)) {
    status = TakePhases(frame, parameters_, b.phases, b.attributes);
    if (!status.ok()) return status;
    frame.attributes = b.attributes;
  }
  Prepare(frame.attributes, parameters_, result);
  if (is_prepared) {
    const auto names =
        has_wall_particles ? b.wall_particles.fluid_sources() : std::span<const std::uint32_t>();
    status = InStage(control.observer, Stage::kBins, [&] {
      return PrepareFrame({parameters_, limits_, frame, state, names}, memory,
                          {b.distinct_ids, b.spacing, b.noise, b.lift}, frame, prepared);
    });
    if (!status.ok()) return status;
    if (HasPhases(parameters_)) LabelCopies(prepared.lifted.originals, b.phases);
  }
  FrameWalls walls;
  if (HasWalls(parameters_)) {
    const auto variant = walls_ ? VariantFor(*walls_, *variant_) : VirtualPlaneVariant();
    status = FindFrameWalls(
        {parameters_, walls_.get(), variant, limits_, frame, prepared, control.observer}, memory, b,
        walls);
    if (!status.ok()) return status;
  }
  const auto task_of = [&](const ReconstructionParameters& parameters, const State& previous,
                           std::size_t outline) {
    const bool is_first = outline == (is_surface ? 1 : 0) && !is_prepared &&
                          !HasPhases(parameters_) && !has_wall_particles;
    return OutlineTask{parameters, VariantFor(parameters, *variant_),
                       limits_,    frame,
                       previous,   control.observer,
                       is_first,   is_prepared || has_wall_particles ? &prepared : nullptr,
                       walls};
  };
  const auto reconstruct = [&](const ReconstructionParameters& parameters, const State& previous,
                               std::size_t outline, Result& into) {
    absl::Status outlined = ReconstructOutline(task_of(parameters, previous, outline), memory, b,
                                               b.next_states[outline], into);
    memory.Done();
    return outlined;
  };
  if (!is_surface) status = reconstruct(parameters_, state, 0, result);
  if (has_wall_particles) {
    status = NamingGivenParticle(status, prepared, b.wall_particles.fluid_sources());
  }
  // Phases first: they read buffers of the outline that other sections overwrite.
  PhaseLabel label = kNoPhase;
  for (const bool is_phase : {true, false}) {
    for (std::size_t k = 0; status.ok() && k < sections_.size(); ++k) {
      if (parameters_.sections[k].phase.has_value() != is_phase) continue;
      const State& previous = k < state.sections.size() ? state.sections[k] : unseen;
      status = is_phase ? ReconstructPhase(task_of(parameters_, previous, k + 1), ++label, memory,
                                           b, b.next_states[k + 1], result.sections[k])
                        : reconstruct(sections_[k], previous, k + 1, result.sections[k]);
      if (is_phase) memory.Done();
    }
  }
  if (!status.ok()) return status;
  state.sections.reserve(sections_.size());
  if (is_surface) {
    // This step commits its state, so no later step may fail.
    status = surface_->Reconstruct(
        frame, state.surface, b.surface, result.surface,
        {.observer = control.observer, .memory = &memory, .cancelled = control.cancelled});
    if (!status.ok()) return status;
    // Filtered positions are float64.
    if (prepared.is_filtered && AreCoarse(given, *parameters_.spacing)) {
      result.surface.statistics.doubts.Add(Doubt::kPositionsCoarse);
    }
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
