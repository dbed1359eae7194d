// Encodes and decodes frames of particles, requested outputs and errors of frames.
#include "wire/codec.h"

#include <algorithm>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "common/printable.h"
#include "partiemc/status.h"
#include "wire/bytes.h"
#include "wire/violations.h"

namespace partiemc::wire {
namespace {

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

// Whether a frame has the attribute `scalar`: if it has values, or if the frame has no particles.
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
