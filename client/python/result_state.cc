#include "client/python/result_state.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "client/python/errors.h"
#include "wire/codec.h"
#include "wire/surface_level.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

// The axes of a box as origins and lengths, which keep their bits. Empty without a box.
using BoxState = std::vector<std::optional<std::pair<double, double>>>;

BoxState BoxToState(const std::optional<PeriodicBox>& box) {
  BoxState state;
  if (!box) return state;
  for (const auto& axis : box->axes) {
    auto& entry = state.emplace_back();
    if (axis) entry.emplace(axis->origin, axis->length);
  }
  return state;
}

std::optional<PeriodicBox> BoxFromState(const BoxState& state) {
  if (state.size() != 3) return std::nullopt;
  PeriodicBox box;
  for (std::size_t k = 0; k < 3; ++k) {
    if (state[k]) box.axes[k] = PeriodicAxis{state[k]->first, state[k]->second};
  }
  return box;
}

AttributeValues AttributeFromState(const py::handle& state) {
  const auto [name, components, bytes] =
      state.cast<std::tuple<std::string, int, std::string_view>>();
  if (components < 1 || components > 3 ||
      bytes.size() % (static_cast<std::size_t>(components) * sizeof(float)) != 0) {
    throw py::value_error("pickle: the state of a partiemc Result is damaged");
  }
  AttributeValues attribute{.name = name, .components = components};
  attribute.values.resize(bytes.size() / sizeof(float));
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(attribute.values.data()));
  return attribute;
}

}  // namespace

py::tuple StateOf(PythonResult& result) {
  const auto& sections = SectionsOf(result);  // Moved out of `frame`, so `message` has none.
  const client::FrameResult& frame = result.frame;
  v1::ReconstructedFrame message;
  RaiseUnlessOk(wire::EncodeResult(frame.result, {frame.times.stages_ms, frame.times.total_ms},
                                   {.normals = true}, message));
  message.set_sequence(result.sequence);
  message.set_time(result.time);
  if (result.has_digests) {
    message.set_rings_digest(frame.rings_digest);
    message.set_mesh_digest(frame.mesh_digest);
    message.set_surface_digest(frame.surface_digest);
  }
  if (result.level && message.has_surface()) {
    v1::SurfaceLevel& level = *message.mutable_surface()->mutable_level();
    level.set_error(result.level->error);
    level.set_digest(result.level->digest);
  }
  std::string bytes;
  if (!message.SerializeToString(&bytes)) {
    throw py::value_error("pickle: the result has more than 2 GiB");
  }
  const py::bytes particles(reinterpret_cast<const char*>(result.particles.data()),
                            result.particles.size() * sizeof(double));
  py::list attributes;
  for (const AttributeValues& one : result.particle_attributes) {
    attributes.append(py::make_tuple(one.name, one.components,
                                     py::bytes(reinterpret_cast<const char*>(one.values.data()),
                                               one.values.size() * sizeof(float))));
  }
  return py::make_tuple(py::bytes(bytes), sections, particles, result.dropped, result.gap,
                        result.rejoined, result.in_space, attributes,
                        BoxToState(result.particle_box));
}

std::shared_ptr<PythonResult> ResultOf(const py::tuple& state) {
  // States of older versions have 6 entries (before surfaces), 7 (before particle attributes) or 8
  // (before boxes of frames).
  if (state.size() < 6 || state.size() > 9) {
    throw py::value_error("pickle: not the state of a partiemc Result");
  }
  auto result = std::make_shared<PythonResult>();
  result->in_space = state.size() >= 7 && state[6].cast<bool>();
  if (state.size() >= 9) result->particle_box = BoxFromState(state[8].cast<BoxState>());
  if (state.size() >= 8) {
    for (const py::handle& attribute : state[7]) {
      result->particle_attributes.push_back(AttributeFromState(attribute));
    }
  }
  v1::ReconstructedFrame message;
  const auto particles = state[2].cast<std::string_view>();
  if (!message.ParseFromString(state[0].cast<std::string>()) ||
      (message.has_surface() && !result->in_space) ||
      particles.size() % (CoordinatesOf(*result) * sizeof(double)) != 0) {
    throw py::value_error("pickle: the state of a partiemc Result is damaged");
  }
  wire::ReconstructedFrame decoded;
  RaiseUnlessOk(wire::DecodeResult(message, decoded));
  result->sequence = decoded.sequence;
  result->time = decoded.time;
  result->level = wire::LevelOf(message);
  result->frame.result = std::move(decoded.result);
  result->frame.times = {decoded.times.stages_ms, decoded.times.total_ms};
  result->frame.rings_digest = decoded.rings_digest;
  result->frame.mesh_digest = decoded.mesh_digest;
  result->frame.surface_digest = decoded.surface_digest;
  result->sections = state[1].cast<std::vector<std::shared_ptr<PythonResult>>>();
  result->particles.resize(particles.size() / sizeof(double));
  std::copy(particles.begin(), particles.end(), reinterpret_cast<char*>(result->particles.data()));
  result->dropped = state[3].cast<std::uint64_t>();
  result->gap = state[4].cast<std::uint64_t>();
  result->rejoined = state[5].cast<std::string>();
  return result;
}

}  // namespace partiemc::python
