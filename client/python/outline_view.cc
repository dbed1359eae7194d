#include "client/python/outline_view.h"

#include <pybind11/numpy.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/python/arguments.h"
#include "client/python/arrays.h"
#include "client/python/errors.h"
#include "client/python/parts.h"
#include "client/python/results.h"
#include "partiemc/gauges.h"
#include "partiemc/result.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

using RingsView = PartOf<Rings>;
using MeshView = PartOf<Mesh>;

py::array RingPoints(const RingsView& rings, const py::object& ring) {
  auto index = As<py::ssize_t>(ring, "ring");
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

// The array of numbers `name`.
ContiguousNumbers NumbersOf(const py::kwargs& given, const char* name) {
  const py::array array = AsArray(given[name], name);
  const auto numbers = ContiguousNumbers::ensure(array);
  if (!numbers) RaiseType(name, "an array of numbers", array);
  return numbers;
}

OwnedDiscs DiscsOf(const py::kwargs& given) {
  const bool by_radius = given.contains("radii");
  if (!given.contains("positions") || by_radius == given.contains("volumes")) {
    Raise(Invalid(kReasonCount, "gauge packing", "wrong arguments",
                  "takes positions, and either radii or volumes"));
  }
  const ContiguousNumbers centres = NumbersOf(given, "positions");
  const ContiguousNumbers sizes = NumbersOf(given, by_radius ? "radii" : "volumes");
  if (centres.ndim() != 2 || centres.shape(1) != 2 || sizes.ndim() != 1 ||
      sizes.shape(0) != centres.shape(0)) {
    Raise(Invalid(kReasonCount, "gauge packing", "arrays of other shapes",
                  "positions must have the shape (N, 2), and radii or volumes (N,)"));
  }
  OwnedDiscs discs{.centres = {centres.data(), centres.data() + centres.size()}};
  for (py::ssize_t k = 0; k < sizes.shape(0); ++k) {
    const double size = sizes.at(k);
    if (!(size >= 0) || !std::isfinite(size)) {
      Raise(Invalid(kReasonOutOfRange,
                    by_radius ? "gauge packing: radii" : "gauge packing: volumes",
                    ShortestNumber(size), "must be finite and at least 0"));
    }
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
    gauge.numbers.push_back(As<double>(numbers[key], std::string(name)));
  }
  return gauge;
}

py::dict Measured(const RingsView& rings, const py::object& kind, const py::kwargs& numbers) {
  const Gauge gauge = GaugeOf(As<std::string>(kind, "kind"), numbers);
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

py::array Heights(const RingsView& rings, const py::object& x) {
  const std::vector<double> heights = HeightsAt(rings.part, As<double>(x, "x"));
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
          "points where it meets a wall, two other phases, or one and the outside.")
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

}  // namespace

py::object RingsOf(const py::object& result) {
  return py::cast(RingsView{result, result.cast<const PythonResult&>().frame.result.rings});
}

py::object MeshOf(const py::object& result) {
  return py::cast(MeshView{result, result.cast<const PythonResult&>().frame.result.mesh});
}

void DefineOutline(py::module_& module) {
  DefineRings(module);
  DefineMesh(module);
}

}  // namespace partiemc::python
