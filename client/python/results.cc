#include "client/python/results.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/python/arrays.h"
#include "client/python/outline_view.h"
#include "client/python/parameters.h"
#include "client/python/result_state.h"
#include "client/python/surface_view.h"
#include "partiemc/doubt.h"
#include "partiemc/stage.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

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

}  // namespace

std::size_t CoordinatesOf(const PythonResult& result) { return result.in_space ? 3 : 2; }

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
  DefineOutline(module);
  DefineSurface(module);
  // A view holds a reference to the object that it comes from, so that its memory stays valid.
  py::class_<PythonResult, std::shared_ptr<PythonResult>>(
      module, "Result", "The result of one frame. It can be pickled and copied.")
      .def(py::pickle(&StateOf, &ResultOf))
      // Earlier protocols make an empty object, which pybind11 cannot.
      .def("__reduce_ex__",
           [](const py::object& self, int protocol) -> py::object {
             if (protocol < 2) {
               throw py::type_error(
                   "pickle: a partiemc Result requires protocol 2 or later, "
                   "as by default");
             }
             return py::module_::import("builtins")
                 .attr("object")
                 .attr("__reduce_ex__")(self, protocol);
           })
      .def_property_readonly("rings", &RingsOf, "The outline: Rings.")
      .def_property_readonly("mesh", &MeshOf, "The inside: Mesh; empty with fill='none'.")
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
