#include "client/python/surface_view.h"

#include <pybind11/numpy.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "client/python/arguments.h"
#include "client/python/arrays.h"
#include "client/python/errors.h"
#include "client/python/parts.h"
#include "client/python/results.h"
#include "partiemc/surface.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

using SurfaceView = PartOf<Surface>;

static_assert(offsetof(ShellMeasures, centroid_z) ==
              offsetof(ShellMeasures, centroid_x) + 2 * sizeof(double));

// The triangles of one shell.
py::array ShellTriangles(const SurfaceView& view, const py::object& number) {
  auto index = As<py::ssize_t>(number, "shell");
  const Surface& surface = view.part;
  const auto count = static_cast<py::ssize_t>(surface.ShellCount());
  if (index < 0) index += count;
  if (index < 0 || index >= count) throw py::index_error("there are fewer shells");
  const auto shell = static_cast<std::size_t>(index);
  const std::uint32_t first = surface.triangle_offsets[shell];
  const auto triangles = static_cast<py::ssize_t>(surface.triangle_offsets[shell + 1] - first);
  return View<std::uint32_t>(surface.triangles.data() + 3 * std::size_t{first}, {triangles, 3},
                             {3 * sizeof(std::uint32_t), sizeof(std::uint32_t)}, view.owner);
}

}  // namespace

py::object SurfaceOf(const py::object& result) {
  return py::cast(SurfaceView{result, result.cast<const PythonResult&>().frame.result.surface});
}

void DefineSurface(py::module_& module) {
  using S = const SurfaceView&;
  py::class_<SurfaceView>(
      module, "Surface",
      "Closed triangle surfaces in space, by shell: the outside of a body, or a "
      "cavity in one. surface[k] has the triangles of shell k. All arrays are "
      "read-only views that keep the result alive.")
      .def("__reduce__", Reduce<Surface>("surface"))
      .def("__len__", [](S s) { return s.part.ShellCount(); })
      .def("__getitem__", &ShellTriangles)
      .def_property_readonly(
          "points", [](S s) { return View<double>(s.part.points, 3, s.owner); },
          "(V, 3) float64, world units, by shell.")
      .def_property_readonly(
          "triangles", [](S s) { return View<std::uint32_t>(s.part.triangles, 3, s.owner); },
          "(T, 3) uint32: indices of points, by shell, counter-clockwise seen from outside.")
      .def_property_readonly(
          "normals", [](S s) { return View<float>(s.part.normals, 3, s.owner); },
          "(V, 3) float32: outward unit normals.")
      .def_property_readonly(
          "point_offsets",
          [](S s) { return View<std::uint32_t>(s.part.point_offsets, 1, s.owner); },
          "(S + 1,) uint32: shell k has points[point_offsets[k]:point_offsets[k + 1]].")
      .def_property_readonly(
          "triangle_offsets",
          [](S s) { return View<std::uint32_t>(s.part.triangle_offsets, 1, s.owner); },
          "(S + 1,) uint32: the same for triangles.")
      .def_property_readonly(
          "outer_of", [](S s) { return View<std::int32_t>(s.part.outer_of, 1, s.owner); },
          "(S,) int32: the outer shell of a cavity, -1 for an outer shell.")
      .def_property_readonly(
          "area", [](S s) { return Column<double>(s, &ShellMeasures::area); },
          "(S,) float64, world units squared.")
      .def_property_readonly(
          "volume", [](S s) { return Column<double>(s, &ShellMeasures::volume); },
          "(S,) float64, enclosed, world units cubed; negative for cavities.")
      .def_property_readonly(
          "centroids", [](S s) { return Column<double>(s, &ShellMeasures::centroid_x, 3); },
          "(S, 3) float64, world units: centroid of the volume that each shell encloses.")
      .def_property_readonly(
          "particle_counts",
          [](S s) { return Column<std::uint64_t>(s, &ShellMeasures::particles); },
          "(S,) uint64: particles of the shell's body, 0 for cavities.")
      .def_property_readonly(
          "identities", [](S s) { return Column<std::uint64_t>(s, &ShellMeasures::identity); },
          "(S,) uint64: constant from frame to frame; 0: not tracked.")
      .def_property_readonly(
          "parents", [](S s) { return View<std::uint64_t>(s.part.parents, 1, s.owner); },
          "(Q,) uint64: identities, in the frame before, that shell k continues: "
          "parents[parent_offsets[k]:parent_offsets[k + 1]].")
      .def_property_readonly(
          "parent_offsets",
          [](S s) { return View<std::uint32_t>(s.part.parent_offsets, 1, s.owner); },
          "(S + 1,) uint32; (1,) if shells are not tracked.")
      .def_property_readonly(
          "cuts", [](S s) { return View<std::uint32_t>(s.part.cuts, 1, s.owner); },
          "(K,) uint32, ascending: triangles on walls (wall_planes). `area` does not count them.")
      .def(
          "check",
          [](S s) {
            absl::Status valid;
            {
              const py::gil_scoped_release others_may_run;
              valid = Validate(s.part);
            }
            RaiseUnlessOk(valid);
          },
          "Checks with exact arithmetic that every shell is closed, manifold, oriented and free of "
          "intersections. Raises Error. Takes about as long as the reconstruction.");
}

}  // namespace partiemc::python
