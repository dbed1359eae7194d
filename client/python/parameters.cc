#include "client/python/parameters.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/library/adapters/seconds.h"
#include "client/python/errors.h"
#include "partiemc/client/parameter_names.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

// Removes `name` from the arguments and returns its value. Empty if the argument is absent or None.
template <typename T>
std::optional<T> Take(py::dict& arguments, const char* name) {
  if (!arguments.contains(name)) return std::nullopt;
  const py::object value = arguments.attr("pop")(name);
  if (value.is_none()) return std::nullopt;
  try {
    return value.cast<T>();
  } catch (const py::cast_error&) {
    throw py::type_error(std::string(name) + ": " + py::repr(value).cast<std::string>() +
                         " is of the wrong type");
  }
}

template <typename T>
void TakeInto(py::dict& arguments, const char* name, T& value) {
  if (auto given = Take<T>(arguments, name)) value = *std::move(given);
}

template <typename T>
void TakeInto(py::dict& arguments, const char* name, std::optional<T>& value) {
  if (auto given = Take<T>(arguments, name)) value = *std::move(given);
}

template <typename Value>
void TakeNamed(py::dict& arguments, const char* field, Value& value) {
  if (const auto name = Take<std::string>(arguments, field)) {
    RaiseUnlessOk(client::SetByName(*name, value));
  }
}

// Reads a time in seconds. `time` may be a std::optional.
template <typename Time>
void TakeTime(py::dict& arguments, const char* name, Time& time) {
  const auto seconds = Take<double>(arguments, name);
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

// Removes the argument `slice`: an axis and a coordinate such as ("z", 0.5), or a point and a
// normal.
void TakeSlice(py::dict arguments, std::optional<SlicePlane>& slice) {
  const auto given = Take<py::object>(arguments, "slice");
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
void TakeBox(py::dict& arguments, std::optional<PeriodicBox>& box) {
  const auto given = Take<py::dict>(arguments, "box");
  const bool wraps = Take<bool>(arguments, "wrap").value_or(false);
  if (!given) {
    if (wraps) Raise(Invalid("UNSUPPORTED", "wrap", "True", "requires a periodic box (box=)"));
    return;
  }
  box = BoxOf(*given);
  box->wraps = wraps;
}

// Reads each section: a dict of the values that differ from the parameters of the stream.
void TakeSections(py::dict& arguments, std::vector<Section>& sections) {
  const auto given = Take<std::vector<py::dict>>(arguments, "sections");
  if (!given) return;
  for (std::size_t k = 0; k < given->size(); ++k) {
    py::dict left((*given)[k].attr("copy")());  // Leaves the caller's dict unchanged.
    Section& section = sections.emplace_back();
    TakeSlice(left, section.slice);
    TakeInto(left, "isovalue", section.isovalue);
    TakeInto(left, "phase", section.phase);
    if (left.empty()) continue;
    Raise(Invalid("UNSUPPORTED", "sections[" + std::to_string(k) + "]",
                  py::repr((*given)[k]).cast<std::string>(),
                  "must be a dict of slice, isovalue or phase"));
  }
}

// Reads the points of each wall: x0, y0, x1, y1, ..., or an (n, 2) array.
void TakeWalls(py::dict& arguments, std::vector<Wall>& walls) {
  using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
  const auto given = Take<std::vector<py::object>>(arguments, "walls");
  if (!given) return;
  for (std::size_t k = 0; k < given->size(); ++k) {
    const Numbers points = Numbers::ensure((*given)[k]);  // Null unless it is an array of numbers.
    const bool is_flat = points && points.ndim() == 1;
    if (!is_flat && !(points && points.ndim() == 2 && points.shape(1) == 2)) {
      Raise(Invalid("UNSUPPORTED", "walls[" + std::to_string(k) + "]",
                    py::repr((*given)[k]).cast<std::string>(),
                    "must be the points of a wall: [x0, y0, x1, y1, ...] or an (n, 2) array"));
    }
    walls.push_back({.points = {points.data(), points.data() + points.size()}});
  }
}

// Reads the walls of a surface: {"axis": "z", "position": 0, "side": "above"}.
void TakeWallPlanes(py::dict& arguments, std::vector<WallPlane>& planes) {
  const auto given = Take<std::vector<py::object>>(arguments, "wall_planes");
  if (!given) return;
  for (std::size_t k = 0; k < given->size(); ++k) {
    const std::string field = "wall_planes[" + std::to_string(k) + "]";
    const auto refuse = [&] {
      Raise(Invalid("UNSUPPORTED", field, py::repr((*given)[k]).cast<std::string>(),
                    "must be a dict of axis ('x', 'y' or 'z'), position, and side of the fluid "
                    "('above' or 'below')"));
    };
    if (!py::isinstance<py::dict>((*given)[k])) refuse();
    py::dict dict = (*given)[k].cast<py::dict>().attr("copy")();
    const auto axis = AxisOf(Take<std::string>(dict, "axis").value_or(""));
    const auto position = Take<double>(dict, "position");
    const std::string side = Take<std::string>(dict, "side").value_or("above");
    if (!axis || !position || (side != "above" && side != "below") || !dict.empty()) refuse();
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

ReconstructionParameters TakeParameters(py::dict arguments) {
  ReconstructionParameters parameters;
  TakeNamed(arguments, "output", parameters.output);
  TakeNamed(arguments, "placement", parameters.placement);
  TakeNamed(arguments, "fill", parameters.fill);
  TakeNamed(arguments, "plane", parameters.plane);
  TakeNamed(arguments, "spacing_rule", parameters.spacing_rule);
  TakeNamed(arguments, "sizes", parameters.sizes);
  TakeNamed(arguments, "boundary", parameters.boundary);
  TakeInto(arguments, "spacing", parameters.spacing);
  TakeInto(arguments, "kernel_radius", parameters.kernel_radius);
  TakeInto(arguments, "cell_size", parameters.cell_size);
  TakeInto(arguments, "reference_radius", parameters.reference_radius);
  TakeInto(arguments, "surface_offset", parameters.surface_offset);
  TakeInto(arguments, "attribute_tolerance", parameters.attribute_tolerance);
  TakeInto(arguments, "normal_memory", parameters.normal_memory);
  TakeInto(arguments, "clean", parameters.clean);
  TakeInto(arguments, "min_component_area", parameters.min_component_area);
  TakeInto(arguments, "min_component_particles", parameters.min_component_particles);
  TakeSlice(arguments, parameters.slice);
  TakeInto(arguments, "isovalue", parameters.isovalue);
  TakeSections(arguments, parameters.sections);
  TakeInto(arguments, "phase_attribute", parameters.phase_attribute);
  TakeBox(arguments, parameters.box);
  TakeInto(arguments, "noise_filter", parameters.noise_filter);
  TakeWalls(arguments, parameters.walls);
  TakeWallPlanes(arguments, parameters.wall_planes);
  TakeInto(arguments, "wall_phases", parameters.wall_phases);
  TakeInto(arguments, "thinning_distance", parameters.surface.thinning_distance);
  TakeInto(arguments, "max_drop_particles", parameters.surface.max_drop_particles);
  TakeInto(arguments, "simplify", parameters.surface.simplify);
  TakeInto(arguments, "min_component_volume", parameters.surface.min_component_volume);
  // The core has the same rule. This error also names the function that estimates a spacing.
  if (!parameters.spacing && (parameters.output == Output::kSurface || parameters.slice)) {
    Raise(Invalid(kReasonOutOfRange, "parameters.spacing", "absent",
                  "must be given for surfaces and slices; partiemc.estimate_spacing(positions) "
                  "estimates it from a frame"));
  }
  return parameters;
}

client::Credentials TakeCredentials(py::dict arguments) {
  client::Credentials credentials = client::CredentialsFromEnvironment();
  TakeInto(arguments, "ca_file", credentials.ca_file);
  TakeInto(arguments, "cert_file", credentials.cert_file);
  TakeInto(arguments, "key_file", credentials.key_file);
  if (auto file = Take<std::string>(arguments, "token_file")) {
    credentials.token_file = *std::move(file);
    credentials.token.clear();  // Replaces the token of the environment.
  }
  TakeInto(arguments, "token", credentials.token);
  credentials.tls |= !credentials.ca_file.empty() || !credentials.cert_file.empty();
  TakeInto(arguments, "tls", credentials.tls);
  return credentials;
}

client::StreamOptions TakeStreamOptions(py::dict arguments, bool latest) {
  client::StreamOptions options;
  if (latest) options.reconnect.give_up_after = client::kShortPatience;
  options.parameters = TakeParameters(arguments);
  options.credentials = TakeCredentials(arguments);
  options.outputs.mesh = options.parameters.fill != Fill::kNone;
  TakeInto(arguments, "normals", options.outputs.normals);
  TakeNamed(arguments, "coordinates", options.outputs.coordinates);
  TakeInto(arguments, "echo_particles", options.outputs.echo_particles);
  TakeInto(arguments, "attributes", options.outputs.attributes);
  TakeInto(arguments, "name", options.name);
  TakeInto(arguments, "labels", options.labels);
  TakeInto(arguments, "fallback_addresses", options.fallback_addresses);
  TakeInto(arguments, "checkpoint_interval", options.checkpoint_interval);
  TakeInto(arguments, "max_held_bytes", options.max_held_bytes);
  TakeTime(arguments, "connect_timeout", options.connect_timeout);
  TakeTime(arguments, "deadline", options.deadline);
  TakeTime(arguments, "give_up_after", options.reconnect.give_up_after);
  TakeTime(arguments, "send_timeout", options.send_timeout);
  TakeInto(arguments, "part", options.parts.part);
  TakeInto(arguments, "parts", options.parts.parts);
  TakeInto(arguments, "parts_token", options.parts.token);
  TakeTime(arguments, "part_timeout", options.parts.timeout);
  return options;
}

client::WatcherOptions TakeWatcherOptions(py::dict arguments) {
  client::WatcherOptions options;
  options.credentials = TakeCredentials(arguments);
  if (const auto mode = Take<std::string>(arguments, "mode")) {
    if (*mode == "every") {
      options.mode = client::WatchMode::kEvery;
    } else if (*mode != "latest") {
      Raise(Invalid("UNSUPPORTED", "mode", *mode, "must be latest, every"));
    }
  }
  TakeInto(arguments, "credits", options.credits);
  TakeInto(arguments, "from_sequence", options.from_sequence);
  LevelOfDetail level;
  TakeInto(arguments, "max_error", level.max_error);
  TakeInto(arguments, "max_triangles", level.max_triangles);
  if (level.max_error || level.max_triangles) {
    RaiseUnlessOk(Validate(level));
    options.level_of_detail = level;
  }
  TakeInto(arguments, "fallback_addresses", options.fallback_addresses);
  TakeTime(arguments, "connect_timeout", options.connect_timeout);
  TakeTime(arguments, "deadline", options.deadline);
  TakeTime(arguments, "give_up_after", options.rejoin.give_up_after);
  return options;
}

void ExpectNothingElse(const py::dict& arguments, const char* function) {
  for (const auto& [name, value] : arguments) {
    throw py::type_error(std::string(function) + "() got an unexpected keyword argument '" +
                         py::str(name).cast<std::string>() + "'");
  }
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
