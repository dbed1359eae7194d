#include "client/python/parameters.h"

#include <pybind11/numpy.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/library/adapters/seconds.h"
#include "client/python/arrays.h"
#include "client/python/errors.h"
#include "partiemc/client/parameter_names.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

template <typename Value>
void TakeNamed(Arguments& arguments, const char* field, Value& value) {
  if (const auto name = arguments.Take<std::string>(field)) {
    RaiseUnlessOk(client::SetByName(*name, value));
  }
}

// Reads a time in seconds. `time` may be a std::optional.
template <typename Time>
void TakeTime(Arguments& arguments, const char* name, Time& time) {
  const auto seconds = arguments.Take<double>(name);
  if (!seconds) return;
  if (!(*seconds >= 0)) {
    Raise(Invalid(kReasonOutOfRange, name, ShortestNumber(*seconds), "must be 0 or more seconds"));
  }
  time = client::ToMilliseconds(*seconds);
}

// The index of the axis "x", "y" or "z"; empty for other texts.
std::optional<std::size_t> AxisOf(std::string_view name) {
  const std::size_t axis = std::string_view("xyz").find(name);
  if (name.size() != 1 || axis == std::string_view::npos) return std::nullopt;
  return axis;
}

// Takes `slice` out of `arguments` and sets `slice`, or leaves it unchanged without this argument.
// The argument is an axis and a coordinate, such as ("z", 0.5), or a point and a normal.
void TakeSlice(Arguments& arguments, std::optional<SlicePlane>& slice) {
  const auto given = arguments.Take<py::object>("slice");
  if (!given) return;
  const auto refuse = [&] {
    Raise(Invalid("UNSUPPORTED", "slice", py::repr(*given).cast<std::string>(),
                  "must be (axis, coordinate), (\"z\", 0.5) say, or two triples: a point of the "
                  "plane, and its normal"));
  };
  try {
    const auto pair = given->cast<std::pair<py::object, py::object>>();
    slice.emplace();
    if (py::isinstance<py::str>(pair.first)) {
      const auto axis = AxisOf(pair.first.cast<std::string>());
      if (!axis) return refuse();
      slice->normal = {};
      slice->origin[*axis] = pair.second.cast<double>();
      // The normal points along -y, so that results have the axes x and z in this order.
      slice->normal[*axis] = *axis == 1 ? -1 : 1;
    } else {
      slice->origin = pair.first.cast<std::array<double, 3>>();
      slice->normal = pair.second.cast<std::array<double, 3>>();
    }
  } catch (const py::cast_error&) {
    refuse();
  }
}

// Removes the arguments `box`, a dict of axes with their lower and upper bounds, such as
// {"x": (0, 10), "y": (0, 10)}, and `wrap`.
void TakeBox(Arguments& arguments, std::optional<PeriodicBox>& box) {
  const auto given = arguments.Take<py::dict>("box");
  const bool wraps = arguments.Take<bool>("wrap").value_or(false);
  if (!given) {
    if (wraps) Raise(Invalid("UNSUPPORTED", "wrap", "True", "requires a periodic box (box=)"));
    return;
  }
  box = BoxOf(*given);
  box->wraps = wraps;
}

// Reads each section: a dict of the values that differ from the parameters of the stream.
void TakeSections(Arguments& arguments, std::vector<Section>& sections) {
  const auto given = arguments.Take<std::vector<py::dict>>("sections");
  if (!given) return;
  for (std::size_t k = 0; k < given->size(); ++k) {
    // A copy leaves the caller's dict unchanged.
    Arguments left((*given)[k].attr("copy")(), "sections[" + std::to_string(k) + "].");
    Section& section = sections.emplace_back();
    TakeSlice(left, section.slice);
    left.TakeInto("isovalue", section.isovalue);
    left.TakeInto("phase", section.phase);
    if (left.empty()) continue;
    Raise(Invalid("UNSUPPORTED", "sections[" + std::to_string(k) + "]",
                  py::repr((*given)[k]).cast<std::string>(),
                  "must be a dict of slice, isovalue or phase"));
  }
}

// Reads the points of each wall: x0, y0, x1, y1, ..., or an (n, 2) array.
void TakeWalls(Arguments& arguments, std::vector<Wall>& walls) {
  const auto given = arguments.Take<std::vector<py::object>>("walls");
  if (!given) return;
  for (std::size_t k = 0; k < given->size(); ++k) {
    const std::string field = "walls[" + std::to_string(k) + "]";
    const auto points =
        ContiguousNumbers::ensure(AsArray((*given)[k], field));  // Null: no numbers.
    const bool is_flat = points && points.ndim() == 1;
    if (!is_flat && !(points && points.ndim() == 2 && points.shape(1) == 2)) {
      Raise(Invalid("UNSUPPORTED", field, py::repr((*given)[k]).cast<std::string>(),
                    "must be the points of a wall: [x0, y0, x1, y1, ...] or an (n, 2) array"));
    }
    walls.push_back({.points = {points.data(), points.data() + points.size()}});
  }
}

// Reads the walls of a surface: {"axis": "z", "position": 0, "side": "above"}.
void TakeWallPlanes(Arguments& arguments, std::vector<WallPlane>& planes) {
  const auto given = arguments.Take<std::vector<py::object>>("wall_planes");
  if (!given) return;
  for (std::size_t k = 0; k < given->size(); ++k) {
    const std::string field = "wall_planes[" + std::to_string(k) + "]";
    const auto refuse = [&] {
      Raise(Invalid("UNSUPPORTED", field, py::repr((*given)[k]).cast<std::string>(),
                    "must be a dict of axis ('x', 'y' or 'z'), position, and side of the fluid "
                    "('above' or 'below')"));
    };
    if (!py::isinstance<py::dict>((*given)[k])) refuse();
    Arguments left((*given)[k].attr("copy")(), field + ".");
    const auto axis = AxisOf(left.Take<std::string>("axis").value_or(""));
    const auto position = left.Take<double>("position");
    const std::string side = left.Take<std::string>("side").value_or("above");
    if (!axis || !position || (side != "above" && side != "below") || !left.empty()) refuse();
    planes.push_back({static_cast<int>(*axis), *position, side == "above"});
  }
}

py::object ToPython(const std::optional<SlicePlane>& slice) {
  if (!slice) return py::none();
  const auto triple = [](const std::array<double, 3>& v) {
    return py::make_tuple(v[0], v[1], v[2]);
  };
  return py::make_tuple(triple(slice->origin), triple(slice->normal));
}

}  // namespace

PeriodicBox BoxOf(const py::dict& given) {
  PeriodicBox box;
  for (const auto& [key, value] : given) {
    std::optional<std::size_t> axis;
    std::pair<double, double> bounds;
    try {
      bounds = value.cast<std::pair<double, double>>();
      axis = AxisOf(key.cast<std::string>());
    } catch (const py::cast_error&) {
    }
    if (!axis) {
      Raise(Invalid("UNSUPPORTED", "box", py::repr(given).cast<std::string>(),
                    "must be a dict of periodic axes with their bounds, {\"x\": (0, 10)} say"));
    }
    box.axes[*axis] = PeriodicAxis{bounds.first, bounds.second - bounds.first};
  }
  return box;
}

py::object ToPython(const std::optional<PeriodicBox>& box) {
  if (!box) return py::none();
  py::dict dict;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& axis = box->axes[k];
    if (!axis) continue;
    dict[py::str(std::string(1, "xyz"[k]))] =
        py::make_tuple(axis->origin, axis->origin + axis->length);
  }
  return dict;
}

ReconstructionParameters TakeParameters(Arguments& arguments) {
  ReconstructionParameters parameters;
  TakeNamed(arguments, "output", parameters.output);
  TakeNamed(arguments, "placement", parameters.placement);
  TakeNamed(arguments, "fill", parameters.fill);
  TakeNamed(arguments, "plane", parameters.plane);
  TakeNamed(arguments, "spacing_rule", parameters.spacing_rule);
  TakeNamed(arguments, "sizes", parameters.sizes);
  TakeNamed(arguments, "boundary", parameters.boundary);
  arguments.TakeInto("spacing", parameters.spacing);
  arguments.TakeInto("kernel_radius", parameters.kernel_radius);
  arguments.TakeInto("cell_size", parameters.cell_size);
  arguments.TakeInto("reference_radius", parameters.reference_radius);
  arguments.TakeInto("surface_offset", parameters.surface_offset);
  arguments.TakeInto("attribute_tolerance", parameters.attribute_tolerance);
  arguments.TakeInto("normal_memory", parameters.normal_memory);
  arguments.TakeInto("clean", parameters.clean);
  arguments.TakeInto("min_component_area", parameters.min_component_area);
  arguments.TakeInto("min_component_particles", parameters.min_component_particles);
  TakeSlice(arguments, parameters.slice);
  arguments.TakeInto("isovalue", parameters.isovalue);
  TakeSections(arguments, parameters.sections);
  arguments.TakeInto("phase_attribute", parameters.phase_attribute);
  TakeBox(arguments, parameters.box);
  arguments.TakeInto("noise_filter", parameters.noise_filter);
  TakeWalls(arguments, parameters.walls);
  TakeWallPlanes(arguments, parameters.wall_planes);
  arguments.TakeInto("wall_phases", parameters.wall_phases);
  arguments.TakeInto("thinning_distance", parameters.surface.thinning_distance);
  arguments.TakeInto("max_drop_particles", parameters.surface.max_drop_particles);
  arguments.TakeInto("simplify", parameters.surface.simplify);
  arguments.TakeInto("min_component_volume", parameters.surface.min_component_volume);
  // The core has the same rule. This error also names the function that estimates a spacing.
  if (!parameters.spacing && (parameters.output == Output::kSurface || parameters.slice)) {
    Raise(Invalid(kReasonOutOfRange, "parameters.spacing", "absent",
                  "must be given for surfaces and slices; partiemc.estimate_spacing(positions) "
                  "estimates it from a frame"));
  }
  return parameters;
}

client::Credentials TakeCredentials(Arguments& arguments) {
  client::Credentials credentials = client::CredentialsFromEnvironment();
  arguments.TakeInto("ca_file", credentials.ca_file);
  arguments.TakeInto("cert_file", credentials.cert_file);
  arguments.TakeInto("key_file", credentials.key_file);
  if (auto file = arguments.Take<std::string>("token_file")) {
    credentials.token_file = *std::move(file);
    credentials.token.clear();  // Replaces the token of the environment.
  }
  arguments.TakeInto("token", credentials.token);
  credentials.tls |= !credentials.ca_file.empty() || !credentials.cert_file.empty();
  arguments.TakeInto("tls", credentials.tls);
  return credentials;
}

client::StreamOptions TakeStreamOptions(Arguments& arguments, bool latest) {
  client::StreamOptions options;
  if (latest) options.reconnect.give_up_after = client::kShortPatience;
  options.parameters = TakeParameters(arguments);
  options.credentials = TakeCredentials(arguments);
  options.outputs.mesh = options.parameters.fill != Fill::kNone;
  arguments.TakeInto("normals", options.outputs.normals);
  TakeNamed(arguments, "coordinates", options.outputs.coordinates);
  arguments.TakeInto("echo_particles", options.outputs.echo_particles);
  arguments.TakeInto("attributes", options.outputs.attributes);
  arguments.TakeInto("name", options.name);
  arguments.TakeInto("labels", options.labels);
  arguments.TakeInto("fallback_addresses", options.fallback_addresses);
  arguments.TakeInto("checkpoint_interval", options.checkpoint_interval);
  arguments.TakeInto("max_held_bytes", options.max_held_bytes);
  TakeTime(arguments, "connect_timeout", options.connect_timeout);
  TakeTime(arguments, "deadline", options.deadline);
  TakeTime(arguments, "give_up_after", options.reconnect.give_up_after);
  TakeTime(arguments, "send_timeout", options.send_timeout);
  arguments.TakeInto("part", options.parts.part);
  arguments.TakeInto("parts", options.parts.parts);
  arguments.TakeInto("parts_token", options.parts.token);
  TakeTime(arguments, "part_timeout", options.parts.timeout);
  return options;
}

client::WatcherOptions TakeWatcherOptions(Arguments& arguments) {
  client::WatcherOptions options;
  options.credentials = TakeCredentials(arguments);
  if (const auto mode = arguments.Take<std::string>("mode")) {
    if (*mode == "every") {
      options.mode = client::WatchMode::kEvery;
    } else if (*mode != "latest") {
      Raise(Invalid("UNSUPPORTED", "mode", *mode, "must be latest, every"));
    }
  }
  arguments.TakeInto("credits", options.credits);
  arguments.TakeInto("from_sequence", options.from_sequence);
  LevelOfDetail level;
  arguments.TakeInto("max_error", level.max_error);
  arguments.TakeInto("max_triangles", level.max_triangles);
  if (level.max_error || level.max_triangles) {
    RaiseUnlessOk(Validate(level));
    options.level_of_detail = level;
  }
  arguments.TakeInto("fallback_addresses", options.fallback_addresses);
  TakeTime(arguments, "connect_timeout", options.connect_timeout);
  TakeTime(arguments, "deadline", options.deadline);
  TakeTime(arguments, "give_up_after", options.rejoin.give_up_after);
  return options;
}

py::dict ToDict(const ReconstructionParameters& parameters) {
  py::list sections;
  for (const Section& section : parameters.sections) {
    py::dict dict;
    dict["slice"] = ToPython(section.slice);
    dict["isovalue"] = section.isovalue;
    if (section.phase) dict["phase"] = section.phase;
    sections.append(dict);
  }
  py::list walls;
  for (const Wall& wall : parameters.walls) walls.append(wall.points);
  py::list wall_planes;
  for (const WallPlane& wall : parameters.wall_planes) {
    py::dict dict;
    dict["axis"] = std::string(1, "xyz"[wall.axis]);
    dict["position"] = wall.position;
    dict["side"] = wall.is_fluid_above ? "above" : "below";
    wall_planes.append(dict);
  }
  const auto named = [](auto value) { return std::string(Name(value)); };
  using namespace py::literals;
  py::dict dict("output"_a = named(parameters.output), "placement"_a = named(parameters.placement),
                "fill"_a = named(parameters.fill), "plane"_a = named(parameters.plane),
                "spacing_rule"_a = named(parameters.spacing_rule), "spacing"_a = parameters.spacing,
                "kernel_radius"_a = parameters.kernel_radius, "cell_size"_a = parameters.cell_size,
                "reference_radius"_a = parameters.reference_radius,
                "surface_offset"_a = parameters.surface_offset,
                "attribute_tolerance"_a = parameters.attribute_tolerance,
                "normal_memory"_a = parameters.normal_memory, "clean"_a = parameters.clean,
                "min_component_area"_a = parameters.min_component_area,
                "min_component_particles"_a = parameters.min_component_particles,
                "slice"_a = ToPython(parameters.slice), "isovalue"_a = parameters.isovalue,
                "sections"_a = sections, "box"_a = ToPython(parameters.box),
                "wrap"_a = parameters.box && parameters.box->wraps,
                "noise_filter"_a = parameters.noise_filter, "walls"_a = walls,
                "wall_phases"_a = parameters.wall_phases, "wall_planes"_a = wall_planes,
                "phase_attribute"_a = parameters.phase_attribute,
                "sizes"_a = named(parameters.sizes), "boundary"_a = named(parameters.boundary));
  if (parameters.output == Output::kSurface) {
    dict["thinning_distance"] = parameters.surface.thinning_distance;
    dict["max_drop_particles"] = parameters.surface.max_drop_particles;
    dict["simplify"] = parameters.surface.simplify;
    dict["min_component_volume"] = parameters.surface.min_component_volume;
  }
  return dict;
}

}  // namespace partiemc::python
