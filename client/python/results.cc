#include "client/python/results.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "client/python/arrays.h"
#include "client/python/errors.h"
#include "client/python/parameters.h"
#include "client/python/parts.h"
#include "client/python/surface_view.h"
#include "partiemc/doubt.h"
#include "partiemc/gauges.h"
#include "partiemc/stage.h"
#include "wire/codec.h"
#include "wire/surface_level.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

using RingsView = PartOf<Rings>;
using MeshView = PartOf<Mesh>;

py::array RingPoints(const RingsView& rings, py::ssize_t index) {
  const auto count = static_cast<py::ssize_t>(rings.part.RingCount());
  if (index < 0) index += count;
  if (index < 0 || index >= count) throw py::index_error("there are fewer rings");
  const auto points = rings.part.RingPoints(static_cast<std::size_t>(index));
  return View<double>(points.data(), {static_cast<py::ssize_t>(points.size() / 2), 2},
                      {2 * sizeof(double), sizeof(double)}, rings.owner);
}

py::array RingOffsets(const RingsView& rings) {
  static constexpr std::uint32_t kNoRings = 0;  // Messages with a surface have no offsets of rings.
  if (rings.part.offsets.empty()) {
    return View<std::uint32_t>(&kNoRings, {1}, {sizeof kNoRings}, rings.owner);
  }
  return View<std::uint32_t>(rings.part.offsets, 1, rings.owner);
}

// The discs of the gauge "packing", from keyword arguments.
struct OwnedDiscs {
  std::vector<double> centres;
  std::vector<float> areas;
};

bool IsDiscArgument(std::string_view name) {
  return name == "positions" || name == "radii" || name == "volumes";
}

template <typename T>
using Numbers = py::array_t<T, py::array::c_style | py::array::forcecast>;

OwnedDiscs DiscsOf(const py::kwargs& given) {
  const bool by_radius = given.contains("radii");
  if (!given.contains("positions") || by_radius == given.contains("volumes")) {
    Raise(Invalid(kReasonCount, "gauge packing", "wrong arguments",
                  "takes positions, and either radii or volumes"));
  }
  const auto centres = given["positions"].cast<Numbers<double>>();
  const auto sizes = given[by_radius ? "radii" : "volumes"].cast<Numbers<double>>();
  if (centres.ndim() != 2 || centres.shape(1) != 2 || sizes.ndim() != 1 ||
      sizes.shape(0) != centres.shape(0)) {
    Raise(Invalid(kReasonCount, "gauge packing", "arrays of other shapes",
                  "positions must have the shape (N, 2), and radii or volumes (N,)"));
  }
  OwnedDiscs discs{.centres = {centres.data(), centres.data() + centres.size()}};
  for (py::ssize_t k = 0; k < sizes.shape(0); ++k) {
    const double size = sizes.at(k);
    discs.areas.push_back(static_cast<float>(by_radius ? std::numbers::pi * size * size : size));
  }
  return discs;
}

// Converts keyword arguments to a gauge. Raises partiemc.Error.
Gauge GaugeOf(const std::string& kind, const py::kwargs& numbers) {
  const std::span<const GaugeTraits> all = AllGauges();
  const auto traits = std::ranges::find(all, kind, &GaugeTraits::name);
  std::string rule = "must be one of";
  if (traits == all.end()) {
    for (const GaugeTraits& one : all)
      rule.append(&one == all.data() ? " " : ", ").append(one.name);
    Raise(Invalid(kReasonOutOfRange, "kind", kind, rule));
  }
  Gauge gauge{.name = kind, .kind = traits->kind};
  rule = traits->numbers.empty() ? "takes no numbers" : "takes";
  for (const std::string_view name : traits->numbers) {
    rule.append(name == traits->numbers.front() ? " " : ", ").append(name);
  }
  for (const auto& [name, number] : numbers) {
    if (gauge.kind == GaugeKind::kPacking && IsDiscArgument(name.cast<std::string>())) continue;
    if (std::ranges::count(traits->numbers, name.cast<std::string>()) == 0) {
      Raise(Invalid(kReasonOutOfRange, "gauge " + kind, name.cast<std::string>(), rule));
    }
  }
  for (const std::string_view name : traits->numbers) {
    const py::str key{std::string(name)};
    if (!numbers.contains(key)) {
      Raise(Invalid(kReasonCount, "gauge " + kind, "no " + std::string(name), rule));
    }
    gauge.numbers.push_back(numbers[key].cast<double>());
  }
  return gauge;
}

py::dict Measured(const RingsView& rings, const std::string& kind, const py::kwargs& numbers) {
  const Gauge gauge = GaugeOf(kind, numbers);
  RaiseUnlessOk(Check(gauge));
  const OwnedDiscs discs = gauge.kind == GaugeKind::kPacking ? DiscsOf(numbers) : OwnedDiscs();
  const std::vector<double> values = Measure(
      gauge, rings.owner.cast<const PythonResult&>().frame.result, {discs.centres, discs.areas});
  py::dict named;
  for (std::size_t k = 0; k < values.size(); ++k) {
    named[py::str(std::string(TraitsOf(gauge.kind).values[k]))] = values[k];
  }
  return named;
}

py::array Heights(const RingsView& rings, double x) {
  const std::vector<double> heights = HeightsAt(rings.part, x);
  // With a count instead of a shape, pybind11 before 2.12 gives wrong strides to NumPy 2.
  return py::array_t<double>(std::vector{static_cast<py::ssize_t>(heights.size())}, heights.data());
}

static_assert(offsetof(RingMeasures, centroid_y) ==
              offsetof(RingMeasures, centroid_x) + sizeof(double));

void DefineRings(py::module_& module) {
  using R = const RingsView&;
  py::class_<RingsView>(module, "Rings",
                        "Closed polylines as flat points and offsets, as in contourpy. All arrays "
                        "are read-only views that keep the result alive. rings[k] is the (P, 2) "
                        "array of ring k. Pickled and copied with its result.")
      .def("__reduce__", Reduce<Rings>("rings"))
      .def("__len__", [](R r) { return r.part.RingCount(); })
      .def("__getitem__", &RingPoints)
      .def_property_readonly(
          "points", [](R r) { return View<double>(r.part.points, 2, r.owner); },
          "(P, 2) float64, world units. The inside lies on the left: outer rings run "
          "counter-clockwise, holes clockwise. The first point is not repeated at the end.")
      .def_property_readonly("offsets", &RingOffsets,
                             "(R + 1,) uint32: ring k has points[offsets[k]:offsets[k + 1]].")
      .def_property_readonly(
          "outer_of", [](R r) { return View<std::int32_t>(r.part.outer_of, 1, r.owner); },
          "(R,) int32: the outer ring of a hole, -1 for an outer ring.")
      .def_property_readonly(
          "normals", [](R r) { return View<float>(r.part.normals, 2, r.owner); },
          "(P, 2) float32, outward unit normals; (0, 2) if the stream has no normals.")
      .def_property_readonly(
          "area", [](R r) { return Column<double>(r, &RingMeasures::area); },
          "(R,) float64, world units squared; negative for holes.")
      .def_property_readonly(
          "perimeter", [](R r) { return Column<double>(r, &RingMeasures::perimeter); },
          "(R,) float64, world units.")
      .def_property_readonly(
          "centroids", [](R r) { return Column<double>(r, &RingMeasures::centroid_x, 2); },
          "(R, 2) float64, world units: centroid of the area that each ring encloses.")
      .def_property_readonly(
          "particle_counts",
          [](R r) { return Column<std::uint64_t>(r, &RingMeasures::particle_count); },
          "(R,) uint64: particles of the ring's component, 0 for holes.")
      .def_property_readonly(
          "cuts", [](R r) { return View<std::uint32_t>(r.part.cuts, 1, r.owner); },
          "(C,) uint32, ascending: points whose segment to the next point of the ring lies on a "
          "face "
          "of the periodic box, where a body was cut. `perimeter` does not count these segments.")
      .def_property_readonly(
          "wetted", [](R r) { return View<std::uint32_t>(r.part.wetted, 1, r.owner); },
          "(W,) uint32, ascending: points whose segment to the next point of the ring lies on a "
          "wall.")
      .def_property_readonly(
          "contacts", [](R r) { return View<std::uint32_t>(r.part.contacts, 1, r.owner); },
          "(K,) uint32, ascending. Of a body: points where its outline meets a wall. Of a phase: "
          "points where it meets two other phases, or one and the outside.")
      .def_property_readonly(
          "contact_angles", [](R r) { return View<float>(r.part.contact_angles, 1, r.owner); },
          "(K,) float32, radians: the angle of the fluid at each contact, between the wall and the "
          "outline, or of the phase.")
      .def_property_readonly(
          "identities", [](R r) { return Column<std::uint64_t>(r, &RingMeasures::identity); },
          "(R,) uint64: constant from frame to frame; 0: not tracked.")
      .def_property_readonly(
          "parents", [](R r) { return View<std::uint64_t>(r.part.parents, 1, r.owner); },
          "(Q,) uint64: identities, in the frame before, that ring k continues: "
          "parents[parent_offsets[k]:parent_offsets[k + 1]].")
      .def_property_readonly(
          "parent_offsets",
          [](R r) { return View<std::uint32_t>(r.part.parent_offsets, 1, r.owner); },
          "(R + 1,) uint32; (1,) if rings are not tracked.")
      .def(
          "gauge", &Measured, py::arg("kind"),
          "A measurement of the outline as a dict of numbers, NaN where the outline has no such "
          "point. Lengths are in world units, angles in degrees. gauge('height', x=): highest, "
          "lowest, crossings. gauge('front', dx=, dy=): position, x, y of the farthest point. "
          "gauge('wetted', x0=, y0=, x1=, y1=): length of the segment inside. gauge('box', min_x=, "
          "min_y=, max_x=, max_y=): area and centroid x, y inside the box. gauge('contact', x=, "
          "y=, dx=, dy=, reach=): start_angle, end_angle, start, end of the largest body on a "
          "wall. "
          "gauge('repose'): left_angle, right_angle of the largest body. gauge('packing', min_x=, "
          "min_y=, max_x=, max_y=, positions=, radii= or volumes=): fraction, discs, area in the "
          "box.")
      .def("heights_at", &Heights, py::arg("x"),
           "(C,) float64: heights at which the outline crosses the vertical line at x, ascending; "
           "the inside is between heights 0 and 1, 2 and 3, and so on.");
}

void DefineMesh(py::module_& module) {
  using M = const MeshView&;
  py::class_<MeshView>(module, "Mesh",
                       "Triangles that cover the inside. All arrays are read-only views that keep "
                       "the result alive. Pickled and copied with its result.")
      .def("__reduce__", Reduce<Mesh>("mesh"))
      .def("__len__", [](M m) { return m.part.TriangleCount(); })
      .def_property_readonly(
          "points", [](M m) { return View<double>(m.part.points, 2, m.owner); },
          "(V, 2) float64, world units. The first are rings.points, bit for bit.")
      .def_property_readonly(
          "triangles", [](M m) { return View<std::uint32_t>(m.part.triangles, 3, m.owner); },
          "(T, 3) uint32: counter-clockwise indices of points.")
      .def_property_readonly(
          "classes", [](M m) { return View<std::uint8_t>(m.part.classes, 1, m.owner); },
          "(T,) uint8: 0 in the band along the rings, 1 inside.");
}

py::dict ByName(const std::vector<AttributeValues>& attributes, const py::object& owner) {
  py::dict by_name;
  for (const AttributeValues& one : attributes) {
    by_name[py::str(one.name)] =
        View<float>(one.values, static_cast<std::size_t>(one.components), owner);
  }
  return by_name;
}

py::dict AttributesOf(const py::object& self) {
  const PythonResult& from = self.cast<const PythonResult&>();
  const Result& result = from.frame.result;
  return ByName(from.in_space ? result.surface.attributes : result.attributes, self);
}

// Number of coordinates of each of the result's particles.
std::size_t CoordinatesOf(const PythonResult& result) { return result.in_space ? 3 : 2; }

template <typename T>
auto Statistic(T FrameStatistics::*member) {
  return [member](const PythonResult& r) { return r.frame.result.statistics.*member; };
}

py::dict TimesOf(const PythonResult& result) {
  py::dict times;
  for (std::size_t k = 0; k < kStageCount; ++k) {
    times[py::str(std::string(kStageNames[k]))] = result.frame.times.stages_ms[k];
  }
  times["total"] = result.frame.times.total_ms;
  return times;
}

const client::FrameResult& WithDigests(PythonResult& result) {
  if (!std::exchange(result.has_digests, true)) {
    result.frame.rings_digest = DigestRings(result.frame.result.rings);
    result.frame.mesh_digest = DigestMesh(result.frame.result.mesh);
    result.frame.surface_digest = DigestSurface(result.frame.result.surface);
  }
  return result.frame;
}

std::vector<std::string> DoubtsOf(const PythonResult& result) {
  std::vector<std::string> names;
  for (const Doubt doubt : kAllDoubts) {
    if (result.frame.result.statistics.doubts.Has(doubt)) names.emplace_back(Name(doubt));
  }
  return names;
}

const std::vector<std::shared_ptr<PythonResult>>& SectionsOf(PythonResult& result) {
  std::vector<Result>& from = result.frame.result.sections;
  if (result.sections.empty()) {
    for (std::size_t k = 0; k < from.size(); ++k) {
      auto section = std::make_shared<PythonResult>();
      section->sequence = result.sequence;
      section->time = result.time;
      section->frame.result = std::move(from[k]);
      section->has_digests = k < result.frame.section_digests.size();
      if (section->has_digests) {
        section->frame.rings_digest = result.frame.section_digests[k].rings;
        section->frame.mesh_digest = result.frame.section_digests[k].mesh;
        section->frame.surface_digest = DigestSurface(section->frame.result.surface);  // Empty.
      }
      result.sections.push_back(std::move(section));
    }
  }
  return result.sections;
}

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

// Returns the state that pickle stores: the result as a message of the protocol, and the values
// that the message cannot hold.
py::tuple ToState(PythonResult& result) {
  const auto& sections = SectionsOf(result);  // Moved out of the frame, so encoded empty there.
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

std::shared_ptr<PythonResult> FromState(const py::tuple& state) {
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

}  // namespace

void WarnOfDoubts(const std::shared_ptr<PythonResult>& result, Doubts& warned) {
  const Doubts doubts = result->frame.result.statistics.doubts;
  for (const Doubt doubt : kAllDoubts) {
    if (!doubts.Has(doubt) || warned.Has(doubt)) continue;
    warned.Add(doubt);
    const std::string text = std::string(Name(doubt)) + ": " + std::string(Explanation(doubt));
    py::module_::import("partiemc._errors").attr("warn")(text, result);
  }
}

std::shared_ptr<PythonResult> ResultPool::Take() {
  const auto give_back = [pool = shared_from_this()](PythonResult* result) {
    const MutexLock lock(pool->mutex_);
    if (pool->kept_.size() < kMostKept) pool->kept_.push_back(std::move(result->frame));
    delete result;
  };
  std::shared_ptr<PythonResult> result(new PythonResult, give_back);
  const MutexLock lock(mutex_);
  if (!kept_.empty()) {
    result->frame = std::move(kept_.back());
    kept_.pop_back();
  }
  return result;
}

void DefineResults(py::module_& module) {
  DefineRings(module);
  DefineMesh(module);
  DefineSurface(module);
  // A view holds a reference to the object that it comes from, so that its memory stays valid.
  py::class_<PythonResult, std::shared_ptr<PythonResult>>(
      module, "Result", "The result of one frame. It can be pickled and copied.")
      .def(py::pickle(&ToState, &FromState))
      .def_property_readonly(
          "rings",
          [](py::object self) {
            return RingsView{self, self.cast<const PythonResult&>().frame.result.rings};
          },
          "The outline: Rings.")
      .def_property_readonly(
          "mesh",
          [](py::object self) {
            return MeshView{self, self.cast<const PythonResult&>().frame.result.mesh};
          },
          "The inside: Mesh; empty with fill='none'.")
      .def_property_readonly("surface", &SurfaceOf,
                             "With output='surface': closed surfaces, a Surface; else empty.")
      .def_property_readonly(
          "attributes", [](const py::object& self) { return AttributesOf(self); },
          "Attributes at the vertices, a dict of float32 arrays: (V,), or (V, 2) or (V, 3) for "
          "vectors. V is len(surface.points) with output='surface', else len(mesh.points), which "
          "begin with rings.points; without a mesh len(rings.points).")
      .def_property_readonly(
          "sections", &SectionsOf,
          "Additional outlines of the frame: a list of Result in the order of `sections`.")
      .def_readonly("sequence", &PythonResult::sequence,
                    "The frame's number: 1, 2, ... in a stream; 0 for partiemc.reconstruct.")
      .def_readonly("time", &PythonResult::time, "Simulation time of the frame.")
      .def_property_readonly("area", Statistic(&FrameStatistics::area),
                             "Sum of the rings' signed areas, or of the areas of surfaces, world "
                             "units squared.")
      .def_property_readonly("volume", Statistic(&FrameStatistics::volume),
                             "Volume inside surfaces, world units cubed; 0 for outlines.")
      .def_property_readonly("perimeter", Statistic(&FrameStatistics::perimeter),
                             "Sum of the rings' perimeters, world units.")
      .def_property_readonly("spacing", Statistic(&FrameStatistics::spacing),
                             "Particle spacing used in this frame, world units.")
      .def_property_readonly("cell_size", Statistic(&FrameStatistics::cell_size),
                             "Cell size of the lattice, world units.")
      .def_property_readonly("particle_count", Statistic(&FrameStatistics::particles))
      .def_property_readonly("doubts", &DoubtsOf,
                             "Names of suspicious properties of the input, such as "
                             "'spacing-provisional'; the first of each is a PartiemcWarning.")
      .def_property_readonly("times", &TimesOf, "Milliseconds of each stage, and 'total'.")
      .def_property_readonly(
          "rings_digest", [](PythonResult& r) { return WithDigests(r).rings_digest; },
          "64-bit digest of the rings: equal digests mean equal bits.")
      .def_property_readonly(
          "mesh_digest", [](PythonResult& r) { return WithDigests(r).mesh_digest; },
          "64-bit digest of the mesh.")
      .def_property_readonly(
          "surface_digest", [](PythonResult& r) { return WithDigests(r).surface_digest; },
          "64-bit digest of the surface.")
      .def_property_readonly(
          "particles",
          [](py::object self) {
            const PythonResult& result = self.cast<const PythonResult&>();
            return View<double>(result.particles, CoordinatesOf(result), self);
          },
          "(N, 2) float64, or (N, 3) with output='surface': particles of a watched frame; N is 0 "
          "unless its producer echoes them.")
      .def_property_readonly(
          "particle_attributes",
          [](const py::object& self) {
            return ByName(self.cast<const PythonResult&>().particle_attributes, self);
          },
          "Attributes of `particles`, by name: (N,) or (N, k) float32. Empty unless the producer "
          "sends attributes and echoes its particles.")
      .def_property_readonly(
          "particle_box", [](const PythonResult& r) { return ToPython(r.particle_box); },
          "Watched frames: the periodic box that the producer sent with the frame, as the argument "
          "`box` of Stream.send. None without one, and unless the producer echoes its particles.")
      .def_property_readonly(
          "level_error",
          [](const PythonResult& r) {
            return r.level ? std::optional(r.level->error) : std::nullopt;
          },
          "Frames watched with max_error or max_triangles: the limit of the root mean square "
          "distance between `surface` and the exact surface, in spacings; 0 if no point was "
          "removed. None for an exact surface.")
      .def_property_readonly(
          "level_digest",
          [](const PythonResult& r) {
            return r.level ? std::optional(r.level->digest) : std::nullopt;
          },
          "64-bit digest of `surface` if it is a level of detail, else None. `surface_digest` is "
          "the digest of the exact surface.")
      .def_readonly("dropped", &PythonResult::dropped,
                    "Watched frames: number of frames dropped since the previous one.")
      .def_readonly("gap", &PythonResult::gap,
                    "Watched frames: sequence numbers missed while the watch was lost.")
      .def_readonly("rejoined", &PythonResult::rejoined,
                    "First frame after a loss of the watch: one line with place and cause.");
}

}  // namespace partiemc::python
