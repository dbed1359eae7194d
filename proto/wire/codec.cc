#include "wire/codec.h"

#include <algorithm>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "common/printable.h"
#include "partiemc/status.h"
#include "wire/bytes.h"
#include "wire/wall_codec.h"

namespace partiemc::wire {
namespace {

absl::Status Invalid(std::string_view reason, std::string field, std::string value,
                     std::string rule) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

absl::Status UnknownEnum(std::string field, int value) {
  return Invalid(kReasonUnsupported, std::move(field), absl::StrCat(value),
                 "must be a value that this version knows");
}

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

Coordinates FromWire(v1::CoordinateFormat format) {
  switch (format) {
    case v1::COORDINATE_FORMAT_FLOAT32_RELATIVE:
      return Coordinates::kRelativeFloat32;
    case v1::COORDINATE_FORMAT_COMPACT:
      return Coordinates::kCompact;
    default:
      return Coordinates::kFloat64;
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

// The layout of a particle in a PositionFormat. 0 components: unknown format.
struct PositionLayout {
  int components = 0;
  std::size_t component_bytes = 0;

  std::size_t ParticleBytes() const {
    return static_cast<std::size_t>(components) * component_bytes;
  }
};

PositionLayout LayoutOf(v1::PositionFormat format) {
  switch (format) {
    case v1::POSITION_FORMAT_FLOAT32_2:
      return {2, sizeof(float)};
    case v1::POSITION_FORMAT_FLOAT64_2:
      return {2, sizeof(double)};
    case v1::POSITION_FORMAT_FLOAT32_3:
      return {3, sizeof(float)};
    case v1::POSITION_FORMAT_FLOAT64_3:
      return {3, sizeof(double)};
    default:
      return {};
  }
}

v1::PositionFormat FormatOf(const Frame& frame) {
  const bool is_float = std::holds_alternative<std::span<const float>>(frame.positions);
  if (frame.components == 3) {
    return is_float ? v1::POSITION_FORMAT_FLOAT32_3 : v1::POSITION_FORMAT_FLOAT64_3;
  }
  return is_float ? v1::POSITION_FORMAT_FLOAT32_2 : v1::POSITION_FORMAT_FLOAT64_2;
}

std::size_t ComponentsOf(const v1::NamedScalar& scalar) {
  return std::max<std::size_t>(1, scalar.components());
}

// Checks that `bytes` is empty or has `particle_bytes` for each particle.
absl::Status CheckOptionalArray(std::string field, const std::string& bytes, std::size_t particles,
                                std::size_t particle_bytes) {
  if (bytes.empty() || bytes.size() == particles * particle_bytes) return absl::OkStatus();
  return Invalid(kReasonByteCount, std::move(field), absl::StrCat(bytes.size(), " bytes"),
                 absl::StrCat("must be empty or ", particle_bytes, " bytes for each of ", particles,
                              " particles"));
}

absl::Status CheckOptionalArrays(const v1::ParticleFrame& message, const PositionLayout& layout,
                                 std::size_t particles) {
  if (auto status = CheckOptionalArray("ids", message.ids(), particles, 8); !status.ok()) {
    return status;
  }
  if (auto status = CheckOptionalArray("volumes", message.volumes(), particles, 4); !status.ok()) {
    return status;
  }
  const std::size_t velocity_bytes = static_cast<std::size_t>(layout.components) * sizeof(float);
  if (auto status =
          CheckOptionalArray("velocities", message.velocities(), particles, velocity_bytes);
      !status.ok()) {
    return status;
  }
  for (int i = 0; i < message.scalars_size(); ++i) {
    const v1::NamedScalar& scalar = message.scalars(i);
    if (scalar.components() > 3) {
      return Invalid(kReasonOutOfRange, absl::StrCat("scalars[", i, "].components"),
                     absl::StrCat(scalar.components()), "must be 1, 2 or 3");
    }
    auto status = CheckOptionalArray(absl::StrCat("scalars[", i, "].values"), scalar.values(),
                                     particles, ComponentsOf(scalar) * sizeof(float));
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

// Whether a frame has an attribute. Without particles, its values are empty.
bool IsThere(const v1::NamedScalar& scalar, std::size_t particles) {
  return particles == 0 || !scalar.values().empty();
}

absl::Status ViewAttributes(const v1::ParticleFrame& message, std::span<const std::string> names,
                            AttributeViews& views, Frame& frame) {
  views.carried.clear();
  for (const v1::NamedScalar& scalar : message.scalars()) {
    if (!IsThere(scalar, frame.ParticleCount())) continue;
    views.carried.push_back({.name = scalar.name(),
                             .components = static_cast<int>(ComponentsOf(scalar)),
                             .values = ViewBytes<float>(scalar.values())});
  }
  frame.attributes = views.carried;
  auto status = ChooseAttributes(frame, names, views.chosen);
  frame.attributes = views.chosen;
  return status;
}

absl::Status CheckNames(const v1::Outputs& message) {
  constexpr int kMostNames = 16;
  if (message.attributes_size() == 0) return absl::OkStatus();
  if (!message.rings() && !message.mesh() && !message.surface()) {
    return Invalid(kReasonOutOfRange, "outputs.attributes", Printable(message.attributes(0)),
                   "must come with outputs.rings, outputs.mesh or outputs.surface: they are at "
                   "their vertices");
  }
  if (message.attributes_size() > kMostNames) {
    return Invalid(kReasonOutOfRange, "outputs.attributes",
                   absl::StrCat(message.attributes_size(), " names"),
                   absl::StrCat("must be at most ", kMostNames));
  }
  const std::set<std::string_view> names(message.attributes().begin(), message.attributes().end());
  if (static_cast<int>(names.size()) == message.attributes_size()) return absl::OkStatus();
  return Invalid(kReasonDuplicate, "outputs.attributes",
                 absl::StrCat(message.attributes_size(), " names"), "must all be different");
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

PeriodicBox FromWire(const v1::PeriodicBox& message) {
  PeriodicBox box;
  const auto axis = [](const v1::PeriodicAxis& from) {
    return PeriodicAxis{from.origin(), from.length()};
  };
  if (message.has_x()) box.axes[0] = axis(message.x());
  if (message.has_y()) box.axes[1] = axis(message.y());
  if (message.has_z()) box.axes[2] = axis(message.z());
  box.wraps = message.wraps();
  return box;
}

v1::PeriodicBox ToWire(const PeriodicBox& box) {
  v1::PeriodicBox message;
  const auto set = [](const PeriodicAxis& from, v1::PeriodicAxis& axis) {
    axis.set_origin(from.origin);
    axis.set_length(from.length);
  };
  if (box.axes[0]) set(*box.axes[0], *message.mutable_x());
  if (box.axes[1]) set(*box.axes[1], *message.mutable_y());
  if (box.axes[2]) set(*box.axes[2], *message.mutable_z());
  message.set_wraps(box.wraps);
  return message;
}

v1::Output ToWire(Output output) {
  return output == Output::kSurface ? v1::OUTPUT_SURFACE : v1::OUTPUT_OUTLINE;
}

v1::CoordinateFormat ToWire(Coordinates coordinates) {
  switch (coordinates) {
    case Coordinates::kFloat64:
      return v1::COORDINATE_FORMAT_FLOAT64;
    case Coordinates::kRelativeFloat32:
      return v1::COORDINATE_FORMAT_FLOAT32_RELATIVE;
    case Coordinates::kCompact:
      return v1::COORDINATE_FORMAT_COMPACT;
  }
  return v1::COORDINATE_FORMAT_UNSPECIFIED;
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

absl::StatusOr<Outputs> DecodeOutputs(const v1::Outputs& message, bool present) {
  if (!present) return Outputs{};
  if (auto status = CheckNames(message); !status.ok()) return status;
  if (!v1::CoordinateFormat_IsValid(message.coordinate_format())) {
    return UnknownEnum("outputs.coordinate_format", message.coordinate_format());
  }
  if (message.normals() && !message.rings() && !message.surface()) {
    return Invalid(kReasonOutOfRange, "outputs.normals", "true",
                   "must come with outputs.rings or outputs.surface: normals are at the vertices "
                   "of the rings or of the surface");
  }
  const bool has_points = message.rings() || message.mesh() || message.surface();
  if (message.coordinate_format() != v1::COORDINATE_FORMAT_UNSPECIFIED && !has_points) {
    return Invalid(kReasonOutOfRange, "outputs.coordinate_format",
                   v1::CoordinateFormat_Name(message.coordinate_format()),
                   "must come with outputs.rings, outputs.mesh or outputs.surface: nothing else "
                   "has coordinates");
  }
  return Outputs{.rings = message.rings(),
                 .mesh = message.mesh(),
                 .surface = message.surface(),
                 .normals = message.normals(),
                 .coordinates = FromWire(message.coordinate_format()),
                 .echo_particles = message.echo_particles(),
                 .attributes = {message.attributes().begin(), message.attributes().end()}};
}

void EncodeOutputs(const Outputs& outputs, v1::Outputs& message) {
  message.Clear();
  message.set_rings(outputs.rings);
  message.set_mesh(outputs.mesh);
  message.set_surface(outputs.surface);
  message.set_normals(outputs.normals);
  if (outputs.rings || outputs.mesh || outputs.surface) {
    message.set_coordinate_format(ToWire(outputs.coordinates));
  }
  message.set_echo_particles(outputs.echo_particles);
  for (const std::string& name : outputs.attributes) message.add_attributes(name);
}

absl::StatusOr<Frame> DecodeFrame(const v1::ParticleFrame& message,
                                  std::span<const std::string> names, AttributeViews& views) {
  auto frame = DecodeFrame(message);
  if (!frame.ok() || names.empty()) return frame;
  if (auto status = ViewAttributes(message, names, views, *frame); !status.ok()) return status;
  return frame;
}

absl::StatusOr<Frame> DecodeFrame(const v1::ParticleFrame& message) {
  const PositionLayout layout = LayoutOf(message.position_format());
  if (layout.components == 0) {
    return Invalid(kReasonUnsupported, "position_format", absl::StrCat(message.position_format()),
                   "must be FLOAT32_2, FLOAT64_2, FLOAT32_3 or FLOAT64_3");
  }
  const std::string& positions = message.positions();
  if (positions.size() % layout.ParticleBytes() != 0) {
    return Invalid(kReasonByteCount, "positions", absl::StrCat(positions.size(), " bytes"),
                   absl::StrCat("must be a multiple of ", layout.ParticleBytes(),
                                " bytes, as position_format says"));
  }
  const std::size_t particles = positions.size() / layout.ParticleBytes();
  if (auto status = CheckOptionalArrays(message, layout, particles); !status.ok()) return status;

  Frame frame;
  frame.components = layout.components;
  frame.volumes = ViewBytes<float>(message.volumes());
  frame.ids = ViewBytes<std::uint64_t>(message.ids());
  frame.velocities = ViewBytes<float>(message.velocities());
  frame.time = message.time();
  if (message.has_box()) frame.box = FromWire(message.box());
  if (layout.component_bytes == sizeof(float)) {
    frame.positions = ViewBytes<float>(positions);
  } else {
    frame.positions = ViewBytes<double>(positions);
  }
  return frame;
}

void EncodeFrame(const Frame& frame, v1::ParticleFrame& message) {
  message.set_position_format(FormatOf(frame));
  std::visit([&](auto view) { AssignBytes(view, *message.mutable_positions()); }, frame.positions);
  AssignBytes(frame.volumes, *message.mutable_volumes());
  AssignBytes(frame.ids, *message.mutable_ids());
  AssignBytes(frame.velocities, *message.mutable_velocities());
  auto& scalars = *message.mutable_scalars();
  while (scalars.size() > static_cast<int>(frame.attributes.size())) scalars.RemoveLast();
  while (scalars.size() < static_cast<int>(frame.attributes.size())) scalars.Add();
  for (std::size_t k = 0; k < frame.attributes.size(); ++k) {
    const Attribute& attribute = frame.attributes[k];
    v1::NamedScalar& scalar = scalars[static_cast<int>(k)];
    scalar.set_name(std::string(attribute.name));
    scalar.set_components(attribute.components == 1 ? 0 : attribute.components);
    AssignBytes(attribute.values, *scalar.mutable_values());
  }
  message.set_time(frame.time);
  message.clear_box();
  if (frame.box) *message.mutable_box() = ToWire(*frame.box);
}

void EncodeFrameError(const absl::Status& status, std::uint64_t sequence,
                      std::uint64_t next_sequence, v1::FrameError& message) {
  message.Clear();
  message.set_sequence(sequence);
  message.set_next_sequence(next_sequence);
  message.set_message(std::string(status.message()));
  if (auto violation = FindViolation(status)) {
    message.set_reason(std::move(violation->reason));
    message.set_field(std::move(violation->field));
    message.set_value(std::move(violation->value));
    message.set_rule(std::move(violation->rule));
  } else {
    message.set_reason(absl::StatusCodeToString(status.code()));
  }
}

}  // namespace partiemc::wire
