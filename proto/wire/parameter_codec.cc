// Encodes and decodes the parameters of a stream (v1::ReconstructionParameters).
#include <cstdint>
#include <optional>
#include <utility>

#include "wire/codec.h"
#include "wire/violations.h"
#include "wire/wall_codec.h"

namespace partiemc::wire {
namespace {

std::optional<Output> FromWire(v1::Output output) {
  switch (output) {
    case v1::OUTPUT_UNSPECIFIED:
      return ReconstructionParameters{}.output;
    case v1::OUTPUT_OUTLINE:
      return Output::kOutline;
    case v1::OUTPUT_SURFACE:
      return Output::kSurface;
    default:
      return std::nullopt;
  }
}

std::optional<Placement> FromWire(v1::Placement placement) {
  switch (placement) {
    case v1::PLACEMENT_UNSPECIFIED:
      return ReconstructionParameters{}.placement;
    case v1::PLACEMENT_MARCHING_SQUARES:
      return Placement::kMarchingSquares;
    case v1::PLACEMENT_QEF:
      return Placement::kQef;
    case v1::PLACEMENT_FARTHEST_PARTICLE:
      return Placement::kFarthestParticle;
    case v1::PLACEMENT_VIRTUAL_PLANE:
      return Placement::kVirtualPlane;
    default:
      return std::nullopt;
  }
}

std::optional<Fill> FromWire(v1::Fill fill) {
  switch (fill) {
    case v1::FILL_UNSPECIFIED:
      return ReconstructionParameters{}.fill;
    case v1::FILL_NONE:
      return Fill::kNone;
    case v1::FILL_GRID:
      return Fill::kGrid;
    case v1::FILL_GREEDY:
      return Fill::kGreedy;
    case v1::FILL_CONFORMING:
      return Fill::kConforming;
    case v1::FILL_POLYGON:
      return Fill::kPolygon;
    default:
      return std::nullopt;
  }
}

std::optional<SpacingRule> FromWire(v1::SpacingRule rule) {
  switch (rule) {
    case v1::SPACING_RULE_UNSPECIFIED:
      return ReconstructionParameters{}.spacing_rule;
    case v1::SPACING_RULE_FIRST_FRAME:
      return SpacingRule::kFirstFrame;
    case v1::SPACING_RULE_EVERY_FRAME:
      return SpacingRule::kEveryFrame;
    default:
      return std::nullopt;
  }
}

std::optional<Sizes> FromWire(v1::Sizes sizes) {
  switch (sizes) {
    case v1::SIZES_UNSPECIFIED:
      return ReconstructionParameters{}.sizes;
    case v1::SIZES_EQUAL:
      return Sizes::kEqual;
    case v1::SIZES_OWN:
      return Sizes::kOwn;
    default:
      return std::nullopt;
  }
}

std::optional<Boundary> FromWire(v1::Boundary boundary) {
  switch (boundary) {
    case v1::BOUNDARY_UNSPECIFIED:
      return ReconstructionParameters{}.boundary;
    case v1::BOUNDARY_BULK:
      return Boundary::kBulk;
    case v1::BOUNDARY_GRAINS:
      return Boundary::kGrains;
    default:
      return std::nullopt;
  }
}

std::optional<Plane> FromWire(v1::Plane plane) {
  switch (plane) {
    case v1::PLANE_UNSPECIFIED:
      return ReconstructionParameters{}.plane;
    case v1::PLANE_XY:
      return Plane::kXy;
    case v1::PLANE_XZ:
      return Plane::kXz;
    case v1::PLANE_YZ:
      return Plane::kYz;
    default:
      return std::nullopt;
  }
}

SlicePlane FromWire(const v1::SlicePlane& slice) {
  return {.origin = {slice.origin_x(), slice.origin_y(), slice.origin_z()},
          .normal = {slice.normal_x(), slice.normal_y(), slice.normal_z()}};
}

v1::SlicePlane ToWire(const SlicePlane& plane) {
  v1::SlicePlane slice;
  slice.set_origin_x(plane.origin[0]);
  slice.set_origin_y(plane.origin[1]);
  slice.set_origin_z(plane.origin[2]);
  slice.set_normal_x(plane.normal[0]);
  slice.set_normal_y(plane.normal[1]);
  slice.set_normal_z(plane.normal[2]);
  return slice;
}

v1::SpacingRule ToWire(SpacingRule rule) {
  return rule == SpacingRule::kFirstFrame ? v1::SPACING_RULE_FIRST_FRAME
                                          : v1::SPACING_RULE_EVERY_FRAME;
}

v1::Plane ToWire(Plane plane) {
  switch (plane) {
    case Plane::kXy:
      return v1::PLANE_XY;
    case Plane::kXz:
      return v1::PLANE_XZ;
    case Plane::kYz:
      return v1::PLANE_YZ;
  }
  return v1::PLANE_UNSPECIFIED;
}

SurfaceOptions FromWire(const v1::SurfaceOptions& message) {
  SurfaceOptions options;
  if (message.has_thinning_distance()) options.thinning_distance = message.thinning_distance();
  if (message.has_max_drop_particles()) options.max_drop_particles = message.max_drop_particles();
  if (message.has_simplify()) options.simplify = message.simplify();
  if (message.has_min_component_volume()) {
    options.min_component_volume = message.min_component_volume();
  }
  return options;
}

v1::SurfaceOptions ToWire(const SurfaceOptions& options) {
  v1::SurfaceOptions message;
  message.set_thinning_distance(options.thinning_distance);
  message.set_max_drop_particles(options.max_drop_particles);
  message.set_simplify(options.simplify);
  message.set_min_component_volume(options.min_component_volume);
  return message;
}

}  // namespace

v1::Output ToWire(Output output) {
  return output == Output::kSurface ? v1::OUTPUT_SURFACE : v1::OUTPUT_OUTLINE;
}

v1::Placement ToWire(Placement placement) {
  switch (placement) {
    case Placement::kMarchingSquares:
      return v1::PLACEMENT_MARCHING_SQUARES;
    case Placement::kQef:
      return v1::PLACEMENT_QEF;
    case Placement::kFarthestParticle:
      return v1::PLACEMENT_FARTHEST_PARTICLE;
    case Placement::kVirtualPlane:
      return v1::PLACEMENT_VIRTUAL_PLANE;
  }
  return v1::PLACEMENT_UNSPECIFIED;
}

v1::Fill ToWire(Fill fill) {
  switch (fill) {
    case Fill::kNone:
      return v1::FILL_NONE;
    case Fill::kGrid:
      return v1::FILL_GRID;
    case Fill::kGreedy:
      return v1::FILL_GREEDY;
    case Fill::kConforming:
      return v1::FILL_CONFORMING;
    case Fill::kPolygon:
      return v1::FILL_POLYGON;
  }
  return v1::FILL_UNSPECIFIED;
}

absl::StatusOr<ReconstructionParameters> DecodeParameters(
    const v1::ReconstructionParameters& message) {
  const auto output = FromWire(message.output());
  if (!output) return UnknownEnum("parameters.output", message.output());
  const auto placement = FromWire(message.placement());
  if (!placement) return UnknownEnum("parameters.placement", message.placement());
  const auto fill = FromWire(message.fill());
  if (!fill) return UnknownEnum("parameters.fill", message.fill());
  const auto spacing_rule = FromWire(message.spacing_rule());
  if (!spacing_rule) return UnknownEnum("parameters.spacing_rule", message.spacing_rule());
  const auto sizes = FromWire(message.sizes());
  if (!sizes) return UnknownEnum("parameters.sizes", message.sizes());
  const auto boundary = FromWire(message.boundary());
  if (!boundary) return UnknownEnum("parameters.boundary", message.boundary());
  const auto plane = FromWire(message.plane());
  if (!plane) return UnknownEnum("parameters.plane", message.plane());
  auto walls = DecodeWalls(message);
  if (!walls.ok()) return walls.status();
  auto wall_planes = DecodeWallPlanes(message);
  if (!wall_planes.ok()) return wall_planes.status();

  ReconstructionParameters parameters;
  parameters.output = *output;
  parameters.placement = *placement;
  parameters.fill = *fill;
  parameters.spacing_rule = *spacing_rule;
  parameters.sizes = *sizes;
  parameters.boundary = *boundary;
  parameters.plane = *plane;
  parameters.walls = *std::move(walls);
  parameters.wall_planes = *std::move(wall_planes);
  parameters.wall_phases = {message.wall_phases().begin(), message.wall_phases().end()};
  if (message.has_spacing()) parameters.spacing = message.spacing();
  if (message.has_kernel_radius()) parameters.kernel_radius = message.kernel_radius();
  if (message.has_cell_size()) parameters.cell_size = message.cell_size();
  if (message.has_reference_radius()) parameters.reference_radius = message.reference_radius();
  if (message.has_surface_offset()) parameters.surface_offset = message.surface_offset();
  if (message.has_attribute_tolerance()) {
    parameters.attribute_tolerance = message.attribute_tolerance();
  }
  if (message.has_normal_memory()) parameters.normal_memory = message.normal_memory();
  if (message.has_clean()) parameters.clean = message.clean();
  if (message.has_min_component_area()) {
    parameters.min_component_area = message.min_component_area();
  }
  if (message.has_min_component_particles()) {
    parameters.min_component_particles = message.min_component_particles();
  }
  if (message.has_slice()) parameters.slice = FromWire(message.slice());
  if (message.has_isovalue()) parameters.isovalue = message.isovalue();
  for (const v1::Section& from : message.sections()) {
    Section& section = parameters.sections.emplace_back();
    if (from.has_slice()) section.slice = FromWire(from.slice());
    if (from.has_isovalue()) section.isovalue = from.isovalue();
    if (from.has_phase()) section.phase = from.phase();
  }
  if (message.has_phase_attribute()) parameters.phase_attribute = message.phase_attribute();
  if (message.has_surface()) parameters.surface = FromWire(message.surface());
  if (message.has_box()) parameters.box = FromWire(message.box());
  if (message.has_noise_filter()) parameters.noise_filter = message.noise_filter();
  return parameters;
}

void EncodeParameters(const ReconstructionParameters& parameters,
                      v1::ReconstructionParameters& message) {
  message.Clear();
  if (parameters.output == Output::kSurface) {
    message.set_output(v1::OUTPUT_SURFACE);
    *message.mutable_surface() = ToWire(parameters.surface);
  }
  message.set_placement(ToWire(parameters.placement));
  message.set_fill(ToWire(parameters.fill));
  if (parameters.spacing) message.set_spacing(*parameters.spacing);
  message.set_spacing_rule(ToWire(parameters.spacing_rule));
  message.set_kernel_radius(parameters.kernel_radius);
  message.set_cell_size(parameters.cell_size);
  if (parameters.reference_radius) message.set_reference_radius(*parameters.reference_radius);
  message.set_surface_offset(parameters.surface_offset);
  message.set_attribute_tolerance(parameters.attribute_tolerance);
  message.set_normal_memory(parameters.normal_memory);
  if (parameters.clean) message.set_clean(*parameters.clean);
  message.set_plane(ToWire(parameters.plane));
  message.set_min_component_area(parameters.min_component_area);
  message.set_min_component_particles(parameters.min_component_particles);
  if (parameters.slice) *message.mutable_slice() = ToWire(*parameters.slice);
  if (parameters.isovalue) message.set_isovalue(*parameters.isovalue);
  for (const Section& from : parameters.sections) {
    v1::Section& section = *message.add_sections();
    if (from.slice) *section.mutable_slice() = ToWire(*from.slice);
    if (from.isovalue) section.set_isovalue(*from.isovalue);
    if (from.phase) {
      section.set_phase(*from.phase);
      message.set_phase_attribute(parameters.phase_attribute);
    }
  }
  if (parameters.box) *message.mutable_box() = ToWire(*parameters.box);
  if (parameters.noise_filter) message.set_noise_filter(*parameters.noise_filter);
  if (parameters.sizes == Sizes::kOwn) message.set_sizes(v1::SIZES_OWN);
  if (parameters.boundary == Boundary::kGrains) message.set_boundary(v1::BOUNDARY_GRAINS);
  EncodeWalls(parameters.walls, message);
  EncodeWallPlanes(parameters.wall_planes, message);
  for (const std::int32_t phase : parameters.wall_phases) {
    message.add_wall_phases(phase);
    message.set_phase_attribute(parameters.phase_attribute);
  }
}

}  // namespace partiemc::wire
