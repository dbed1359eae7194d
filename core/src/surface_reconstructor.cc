// Runs the stages of a surface in order.
#include "partiemc/surface_reconstructor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "attributes/plane_fit.h"
#include "base/cancellation.h"
#include "bins/resolution.h"
#include "frame/calibration.h"
#include "frame/frame_view.h"
#include "frame/in_stage.h"
#include "frame/scale.h"
#include "frame_lengths.h"
#include "partiemc/doubt.h"
#include "partiemc/state.h"
#include "partiemc/status.h"
#include "periodic/frame_box.h"
#include "simplify/simplify.h"
#include "space/bins.h"
#include "space/bodies.h"
#include "space/cleaning.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/mesh.h"
#include "space/spacing_doubt.h"
#include "space/surface_bytes.h"
#include "space_certificate/certificate.h"
#include "space_identities/shell_identities.h"
#include "space_images/body_images.h"
#include "space_vertices/drops.h"
#include "space_vertices/point_attributes.h"
#include "space_vertices/vertices.h"
#include "surface_frame.h"
#include "surface_placement.h"
#include "surface_planes.h"
#include "surface_workspace.h"

namespace partiemc {

namespace {

/// The parameters in the form that the stages require: as for a slice, because both are in space.
ReconstructionParameters InSpace(const SurfaceParameters& parameters) {
  ReconstructionParameters in_space;
  in_space.spacing = parameters.spacing;
  in_space.kernel_radius = parameters.kernel_radius;
  in_space.cell_size = parameters.cell_size;
  in_space.reference_radius = parameters.reference_radius;
  in_space.slice = SlicePlane{};
  in_space.surface = {.thinning_distance = parameters.thinning_distance,
                      .max_drop_particles = parameters.max_drop_particles,
                      .simplify = parameters.simplify,
                      .min_component_volume = parameters.min_component_volume};
  return in_space;
}

ReconstructionParameters Resolved(const SurfaceParameters& parameters) {
  ReconstructionParameters in_space = InSpace(parameters);
  if (!in_space.reference_radius) {
    in_space.reference_radius = CalibratedSurfaceRadius(parameters.kernel_radius);
  }
  in_space.sizes = parameters.sizes;  // Slices exclude own sizes, so Validate must not see them.
  return in_space;
}

// Cleaning fills cavities below this volume, in cubed spacings, because they are no voids of the
// fluid but dents of the level set (core/METHOD.md, "Cleaning").
constexpr double kMinCavityParticles = 2;

/// Finds the bodies. Fills cavities and drops bodies as `parameters` require, and counts both.
SurfaceStatistics FindCleanBodies(const LiftedFrame& lifted, const CopiedBox& copied,
                                  const SurfaceParameters& parameters,
                                  SurfaceWorkspace::Buffers& b) {
  const Frame& frame = lifted.frame;
  SurfaceStatistics statistics;
  const bool is_cleaned =
      parameters.clean.value_or(parameters.placement == SurfacePlacement::kVirtualPlane);
  if (is_cleaned) {
    const double cell = parameters.cell_size;
    const double limit = kMinCavityParticles / (cell * cell * cell);
    const auto most_nodes = static_cast<std::size_t>(std::ceil(limit)) - 1;
    statistics.dropped_cavities =
        space::FillCavities(b.bins.bricks, most_nodes, b.cleaning, b.field);
  }
  const double h = parameters.spacing;
  ThrowIfCancelled();
  space::FindBodies(frame, b.bins, b.field, h, parameters.kernel_radius / parameters.cell_size,
                    b.bodies);
  if (copied.any) {
    space::ChooseImages({.lifted = lifted,
                         .bins = b.bins,
                         .low = copied.complete.low,
                         .high = copied.complete.high,
                         .spacing = h,
                         .cell_size = parameters.cell_size * h,
                         .wraps = lifted.frame.box->wraps},
                        b.body_images, b.bodies);
  }
  // With copies, also drops bodies without particles: ChooseImages cannot recognise their images.
  const space::DroppedBodies dropped =
      space::DropBodies({.drops_empty = is_cleaned || copied.any,
                         .drops_gone = parameters.placement != SurfacePlacement::kVirtualPlane,
                         .least_volume = parameters.min_component_volume * h * h * h,
                         .least_particles = parameters.min_component_particles},
                        b.cleaning, b.bodies, b.field);
  statistics.dropped_components = dropped.empty;
  statistics.dropped_spray = dropped.spray;
  return statistics;
}

/// RESOURCE_EXHAUSTED if the guard refuses the memory of a surface.
absl::Status Reserve(const space::SurfaceSize& size, MemoryGuard* guard) {
  const std::uint64_t bytes = space::SurfaceBytes(size);
  if (guard == nullptr || guard->Reserve(bytes)) return absl::OkStatus();
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonOutOfMemory), "positions",
       absl::StrCat(size.bricks, " bricks of 8 x 8 x 8 nodes"),
       absl::StrCat("must fit into the memory budget, but needs ", (bytes >> 20) + 1,
                    " MiB: reach fewer bricks, or try again later")});
}

/// The number of particles and copies without a body.
std::uint64_t CountAlone(const space::SpaceBins& bins, const space::Bodies& bodies) {
  std::uint64_t alone = 0;
  for (std::uint32_t p = 0; p < bodies.body_of_particle.size(); ++p) {
    alone += bodies.body_of_particle[p] == kNoIndex && !bins.IsMirror(p) ? 1 : 0;
  }
  return alone;
}

/// Sets bodies, samples and attribute values of `size`. `particles`: their number without images.
/// `usual`: the volume of a particle of the spacing.
void AddBodies(const Frame& frame, std::size_t particles, double usual,
               const space::SpaceBins& bins, const space::Bodies& bodies,
               space::SurfaceSize& size) {
  const bool wraps = frame.box && frame.box->wraps;
  std::uint64_t in_bodies = 0;
  for (std::uint32_t index = 0; index < bodies.bodies.size(); ++index) {
    const space::Body& body = bodies.bodies[index];
    if (body.first_image != index || bodies.IsGone(index)) continue;
    in_bodies += body.particles;
    size.samples += std::min<std::uint64_t>(body.particles, kMaxSamples);
  }
  // In a box that wraps, copies without a body may become ellipsoids, too.
  const std::uint64_t alone = wraps ? CountAlone(bins, bodies) : particles - in_bodies;
  size.bodies = bodies.bodies.size() + alone;
  size.lone = alone;
  size.has_large_lone =
      !frame.volumes.empty() && std::ranges::max(frame.volumes) > space::kSmallDropVolume * usual;
  size.samples = frame.ids.empty() ? 0 : size.samples + alone;
  for (const Attribute& attribute : frame.attributes) size.attribute_values += attribute.components;
}

/// CORRUPT_STATE if the state belongs to a lattice with another cell size.
absl::Status CheckCellSize(const SurfaceState& state, double cell_size) {
  if (state.cell_size.value_or(cell_size) == cell_size) return absl::OkStatus();
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonCorruptState), "state.cell_size", ShortestNumber(*state.cell_size),
       absl::StrCat("must be ", ShortestNumber(cell_size), ", the cell size of the parameters")});
}

/// Empties a surface, but keeps the buffers of points and triangles.
void MakeEmpty(Surface& surface) {
  surface.Clear();
  surface.attributes.clear();
}

/// Sets `body_of_shell` of ellipsoids, for FindCutShells.
void NameDrops(SurfaceWorkspace::Buffers& b) {
  for (const space::Drops::Drop& drop : b.drops.drops) {
    if (drop.is_taken) b.mesh.body_of_shell[b.mesh.shell_of[drop.first_vertex]] = drop.body;
  }
}

/// Adds the ellipsoids of particles without a body to the shells that are cut. The ellipsoids of a
/// particle and its copies are images of one body.
void CutLoneDrops(const LiftedFrame& lifted, SurfaceWorkspace::Buffers& b) {
  space::CutShells& cut = b.cut_shells;
  cut.first.assign(lifted.particles, kNoShell);
  for (const bool finds_first : {true, false}) {
    for (const space::Drops::Drop& drop : b.drops.drops) {
      if (!drop.is_taken || drop.body != kNoIndex) continue;
      const std::uint32_t shell = b.mesh.shell_of[drop.first_vertex];
      std::uint32_t& first = cut.first[lifted.OriginalOf(b.bins.source[drop.particle])];
      if (finds_first) {
        first = std::min(first, shell);
        continue;
      }
      cut.any = true;
      cut.is_cut[shell] = space::CutShells::kLoneDrop;
      cut.outer_of[shell] = first;
    }
  }
}

/// The periods of the box in cells; none without a box.
LatticePeriods PeriodsOf(const std::optional<PeriodicBox>& box, double cell_size) {
  LatticePeriods periods;
  if (!box) return periods;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& axis = box->axes[k];
    if (axis) periods.cells[k] = axis->length / cell_size;
  }
  return periods;
}

/// Sets `next` to the history after a frame without particles: no shells, no new identities.
void EndIdentities(const Frame& frame, const ShellHistory& previous, ShellHistory& next) {
  next.identities_given = previous.identities_given;
  next.time.reset();
  next.box.reset();
  if (std::isfinite(frame.time)) next.time = frame.time;
  next.shells.clear();
  next.runs.clear();
  next.samples.clear();
}

}  // namespace

SurfaceWorkspace::SurfaceWorkspace() : buffers_(std::make_unique<Buffers>()) {}
SurfaceWorkspace::~SurfaceWorkspace() = default;
SurfaceWorkspace::SurfaceWorkspace(SurfaceWorkspace&&) noexcept = default;
SurfaceWorkspace& SurfaceWorkspace::operator=(SurfaceWorkspace&&) noexcept = default;

SurfaceReconstructor::SurfaceReconstructor(const SurfaceParameters& parameters,
                                           const FrameLimits& limits)
    : parameters_(parameters), in_space_(Resolved(parameters)), limits_(limits) {}

absl::StatusOr<SurfaceReconstructor> SurfaceReconstructor::Create(
    const SurfaceParameters& parameters, const FrameLimits& limits) {
  if (absl::Status status = Validate(InSpace(parameters)); !status.ok()) return status;
  if (parameters.box) {
    absl::Status status = Validate(*parameters.box, parameters.kernel_radius, parameters.spacing);
    if (!status.ok()) return status;
  }
  if (absl::Status status = CheckWallsOf(parameters); !status.ok()) return status;
  if (absl::Status status = Validate(limits); !status.ok()) return status;
  return SurfaceReconstructor(parameters, limits);
}

absl::Status SurfaceReconstructor::Reconstruct(const Frame& frame, SurfaceState& state,
                                               SurfaceWorkspace& workspace, Surface& surface,
                                               const FrameControl& control) const {
  return ReconstructFrame(frame, &state, workspace, surface, control);
}

absl::Status SurfaceReconstructor::Reconstruct(const Frame& frame, SurfaceWorkspace& workspace,
                                               Surface& surface,
                                               const FrameControl& control) const {
  return ReconstructFrame(frame, nullptr, workspace, surface, control);
}

absl::Status SurfaceReconstructor::ReconstructFrame(const Frame& frame, SurfaceState* state,
                                                    SurfaceWorkspace& workspace, Surface& surface,
                                                    const FrameControl& control) const {
  const CancellationScope scope(control.cancelled);
  surface.Clear();
  ResizeValues(frame.attributes, 0, surface.attributes);
  absl::Status status;
  try {
    status = ReconstructOrThrow(frame, state, workspace.buffers(), surface, control);
  } catch (...) {
    // The buffers may be in any state.
    workspace = SurfaceWorkspace();
    MakeEmpty(surface);
    try {
      throw;
    } catch (const Cancelled&) {
      return absl::CancelledError("the frame was cancelled");
    }
  }
  if (!status.ok()) {
    MakeEmpty(surface);
  } else if (state != nullptr) {
    // Swaps the histories, so that both keep their memory.
    state->cell_size = parameters_.cell_size * parameters_.spacing;
    std::swap(state->history, workspace.buffers().next_history);
  }
  return status;
}

absl::Status SurfaceReconstructor::ReconstructOrThrow(const Frame& given, const SurfaceState* state,
                                                      SurfaceWorkspace::Buffers& b,
                                                      Surface& surface,
                                                      const FrameControl& control) const {
  const double h = parameters_.spacing, cell_size = parameters_.cell_size * h;
  const SurfacePlacement placement = parameters_.placement;
  const space::BrickDirectory& bricks = b.bins.bricks;
  Frame framed = given;
  if (absl::Status status = ResolveBox(parameters_.box, framed); !status.ok()) return status;
  const bool wraps = framed.box && framed.box->wraps;
  SurfaceFrame prepared{.lifted = {.frame = framed}};
  const LiftedFrame& lifted = prepared.lifted;
  const CopiedBox& copied = prepared.copied;
  const Frame& frame = lifted.frame;
  space::SurfaceSize size{.particles = frame.ParticleCount(),
                          .has_windows = placement == SurfacePlacement::kVirtualPlane,
                          .has_state = state != nullptr,
                          .is_simplified = parameters_.simplify > 0,
                          .wall_axes = CountWallAxes(parameters_)};
  const auto in_stage = [&](Stage stage, auto run) {
    return InStage(control.observer, stage, run);
  };
  Scale scale;
  SizeRange sizes;
  Doubts doubts;
  absl::Status status = in_stage(Stage::kBins, [&] {
    absl::Status checked = CheckFrame(given, in_space_, limits_, b.distinct_ids);
    if (checked.ok() && state != nullptr) checked = CheckCellSize(*state, cell_size);
    if (!checked.ok() || frame.ParticleCount() == 0) return checked;
    if (parameters_.sizes == Sizes::kOwn) {
      // Before copies are added, so that errors name a given particle.
      const auto range = RangeOfSizes(given, in_space_, {.spacing = h, .cell_size = cell_size});
      if (!range.ok()) return range.status();
      sizes = *range;
    }
    checked = AddImages({.parameters = parameters_,
                         .given = framed,
                         .sizes = sizes,
                         .reserve =
                             [&](std::uint64_t bytes) {
                               size.lift_bytes = bytes;
                               return Reserve(size, control.memory);
                             }},
                        b.frame, prepared);
    size.particles = frame.ParticleCount();
    if (!checked.ok()) return checked;
    if (3 * lifted.particles < given.ParticleCount()) doubts.Add(Doubt::kWallsHideFluid);
    if (size.particles == 0) return checked;
    size.box_axes = static_cast<std::uint64_t>(std::ranges::count(copied.has_copies, true));
    b.virtual_plane.volumes.before_walls = prepared.before_walls;
    b.virtual_plane.volumes.in_box = prepared.in_box;
    absl::StatusOr<double> lightest = h * h * h;
    if (parameters_.sizes == Sizes::kEqual) {
      lightest = LightestVolume(given, *lightest, doubts);
      if (!lightest.ok()) return lightest.status();
    }
    scale = MakeScale(in_space_, h, cell_size, *lightest, sizes);
    checked = space::FindBricks(frame, scale, limits_, b.bins, prepared.names);
    size.bricks = bricks.size();
    if (scale.has_own_sizes) size.size_classes = b.bins.classes.size();
    if (checked.ok()) checked = Reserve(size, control.memory);
    if (checked.ok()) space::SortParticles(frame, scale, b.bins);
    const auto first = [](bool any, std::size_t index) {
      return any ? static_cast<std::uint32_t>(index) : kNoIndex;
    };
    b.bins.first_image = first(copied.any || prepared.HasMirrors(), lifted.particles);
    b.bins.first_mirror = first(prepared.HasMirrors(), prepared.first_mirror);
    if (!checked.ok()) return checked;
    if (AreCoarse(given, h * sizes.smallest)) doubts.Add(Doubt::kPositionsCoarse);
    if (space::ContradictsSpacing(b.bins, scale)) doubts.Add(Doubt::kSpacingContradicted);
    return checked;
  });
  if (!status.ok()) return status;
  if (frame.ParticleCount() == 0) {
    surface.statistics.doubts = doubts;
    if (state != nullptr) EndIdentities(frame, state->history, b.next_history);
    return absl::OkStatus();
  }
  in_stage(Stage::kField, [&] { space::SampleField(b.bins, scale, b.field); });
  in_stage(Stage::kRings,
           [&] { surface.statistics = FindCleanBodies(lifted, copied, parameters_, b); });
  surface.statistics.doubts = doubts;
  status = in_stage(Stage::kCrossings, [&] {
    space::FindCrossings(bricks, b.field, b.crossings);
    size.edges = b.crossings.edge_count;
    if (placement != SurfacePlacement::kMarchingCubes) size.loops = b.crossings.loop_count;
    AddBodies(frame, lifted.particles, h * h * h, b.bins, b.bodies, size);
    absl::Status reserved = Reserve(size, control.memory);
    if (reserved.ok()) space::ListSteps(bricks, b.crossings);
    return reserved;
  });
  if (!status.ok()) return status;
  in_stage(Stage::kField, [&] { space::EvaluateNodes(b.bins, scale, b.crossings.near, b.field); });
  status = in_stage(Stage::kVertices, [&] {
    b.drops.drops.clear();
    if (placement == SurfacePlacement::kMarchingCubes) {
      PlaceByMarchingCubes(cell_size, b);
      return absl::OkStatus();
    }
    b.drops.is_settled.clear();
    if (placement == SurfacePlacement::kQef) return PlaceMovedVertices(parameters_, scale, b);
    std::vector<std::uint32_t>& body_of = b.virtual_plane.volumes.body_of;
    space::FindBodyOfVertices(bricks, b.field, b.crossings, b.bodies, b.virtual_plane.volumes);
    const space::DropsInput drops{
        frame, b.bins, scale, b.bodies, b.crossings, b.certificate.nodes, body_of, wraps};
    const space::DropLimits limits{.most_particles = parameters_.max_drop_particles,
                                   .least_particles = parameters_.min_component_particles,
                                   .least_volume = parameters_.min_component_volume * h * h * h};
    space::SettleDrops(drops, limits, b.drops);
    for (;;) {
      absl::Status placed = PlaceMovedVertices(parameters_, scale, b);
      if (!placed.ok()) return placed;
      space::NormalsFromTriangles(space::NormalWeights::kSphere, b.positions, b.mesh.triangles,
                                  b.normals);
      const bool are_replaced =
          space::ReplaceDrops(drops, limits, b.drops, b.positions, b.normals, b.mesh.triangles);
      if (are_replaced) {
        if (copied.any) space::RemoveGoneImages(body_of, b.bodies, b.mesh.triangles);
        return placed;
      }
      // A settled body has no ellipsoid, and its surface has not been placed: none is settled now.
      b.drops.is_settled.clear();
    }
  });
  if (!status.ok()) return status;
  in_stage(Stage::kMesh, [&] {
    surface.statistics.bricks = bricks.size();
    space::AssembleSurface({bricks, b.field, b.crossings, b.bodies, b.positions, b.normals, b.thin},
                           b.mesh, surface);
    b.cut_shells.any = false;
    if (copied.any) {
      if (wraps) NameDrops(b);
      space::FindCutShells(b.bodies, b.mesh.body_of_shell, surface, b.cut_shells);
      if (wraps) CutLoneDrops(lifted, b);
    }
    for (const space::Drops::Drop& drop : b.drops.drops) {
      if (!drop.is_taken) continue;
      surface.measures[b.mesh.shell_of[drop.first_vertex]].particles = drop.particles;
    }
  });
  if (state != nullptr) {
    in_stage(Stage::kIdentities, [&] {
      space::ContinueShells(
          {frame, b.bins, b.field, b.crossings, b.bodies, b.drops, b.thin, b.mesh.shell_of,
           cell_size, PeriodsOf(framed.box, cell_size), &b.cut_shells,
           (1 / cell_size) * copied.faces.low, (1 / cell_size) * copied.faces.high,
           MotionOf(parameters_.box, state->history.box, framed.box, cell_size),
           BoxToStore(parameters_.box, framed.box)},
          state->history, b.identities, b.next_history, surface);
    });
  }
  if (parameters_.simplify > 0) {
    in_stage(Stage::kMesh, [&] {
      simplify::Simplify({.error = parameters_.simplify * h, .spacing = h}, surface);
    });
  }
  const double inner_step = InnerStep(parameters_, frame);
  b.plane_cuts.is_done.clear();
  if (copied.any) {
    const bool is_cut = in_stage(Stage::kMesh, [&] {
      return CutAtBox(parameters_, inner_step, copied, b.cut_shells, b.plane_cuts, surface);
    });
    if (!is_cut) return absl::InternalError("a surface cannot be cut at its box");
  }
  if (!parameters_.wall_planes.empty()) {
    const bool is_cut = in_stage(
        Stage::kMesh, [&] { return CutAtWalls(parameters_, inner_step, b.plane_cuts, surface); });
    if (!is_cut) return absl::InternalError("a surface cannot be cut at its walls");
  }
  if (!frame.attributes.empty()) {
    in_stage(Stage::kAttributes, [&] {
      space::InterpolateInSpace(frame, b.bins, scale, surface.points, surface.attributes);
    });
  }
  return absl::OkStatus();
}

}  // namespace partiemc
