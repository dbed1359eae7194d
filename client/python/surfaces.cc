#include "client/python/surfaces.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/python/errors.h"
#include "partiemc/arena.h"
#include "partiemc/surface_reconstructor.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

using Positions = py::array_t<double, py::array::c_style | py::array::forcecast>;

constexpr std::pair<const char*, SurfacePlacement> kPlacements[] = {
    {"marching-cubes", SurfacePlacement::kMarchingCubes},
    {"qef", SurfacePlacement::kQef},
    {"virtual-plane", SurfacePlacement::kVirtualPlane}};

SurfacePlacement PlacementOf(const std::string& name) {
  for (const auto& [known, placement] : kPlacements) {
    if (name == known) return placement;
  }
  throw py::value_error("placement: must be marching-cubes, qef or virtual-plane");
}

// Rows of `columns` numbers; a copy.
template <typename T>
py::array_t<T> Rows(const std::vector<T>& numbers, py::ssize_t columns) {
  py::array_t<T> rows({static_cast<py::ssize_t>(numbers.size()) / columns, columns});
  std::copy(numbers.begin(), numbers.end(), rows.mutable_data());
  return rows;
}

py::dict ToDict(const Surface& surface) {
  std::vector<double> volumes, areas;
  std::vector<std::uint64_t> particles;
  for (const ShellMeasures& shell : surface.measures) {
    volumes.push_back(shell.volume);
    areas.push_back(shell.area);
    particles.push_back(shell.particles);
  }
  using namespace py::literals;
  return py::dict("points"_a = Rows(surface.points, 3), "triangles"_a = Rows(surface.triangles, 3),
                  "normals"_a = Rows(surface.normals, 3), "point_offsets"_a = surface.point_offsets,
                  "triangle_offsets"_a = surface.triangle_offsets, "outer_of"_a = surface.outer_of,
                  "volumes"_a = volumes, "areas"_a = areas, "particles"_a = particles);
}

class Surfaces {
 public:
  Surfaces(const std::string& placement, double spacing, double kernel_radius, double cell_size,
           std::optional<double> reference_radius, std::optional<bool> clean,
           double thinning_distance, double simplify, std::uint64_t max_drop_particles,
           std::uint64_t min_component_particles, unsigned threads)
      : arena_(threads) {
    auto reconstructor =
        SurfaceReconstructor::Create({.placement = PlacementOf(placement),
                                      .spacing = spacing,
                                      .kernel_radius = kernel_radius,
                                      .cell_size = cell_size,
                                      .reference_radius = reference_radius,
                                      .clean = clean,
                                      .thinning_distance = thinning_distance,
                                      .max_drop_particles = max_drop_particles,
                                      .simplify = simplify,
                                      .min_component_particles = min_component_particles});
    RaiseUnlessOk(reconstructor.status());
    reconstructor_ = *std::move(reconstructor);
  }

  py::dict Reconstruct(const Positions& positions, bool validate) {
    if (positions.ndim() != 2 || positions.shape(1) != 3)
      throw py::value_error("positions: must have shape (N, 3)");
    const Frame frame{.positions = std::span<const double>(
                          positions.data(), static_cast<std::size_t>(positions.size())),
                      .components = 3};
    Surface surface;
    absl::Status status;
    {
      const py::gil_scoped_release others_may_run;
      arena_.Execute([&] {
        status = reconstructor_->Reconstruct(frame, workspace_, surface);
        if (status.ok() && validate) status = Validate(surface);
      });
    }
    RaiseUnlessOk(status);
    return ToDict(surface);
  }

 private:
  Arena arena_;
  std::optional<SurfaceReconstructor> reconstructor_;
  SurfaceWorkspace workspace_;
};

}  // namespace

void DefineSurfaces(py::module_& module) {
  using namespace py::literals;
  py::class_<Surfaces>(module, "_Surfaces")
      .def(py::init<const std::string&, double, double, double, std::optional<double>,
                    std::optional<bool>, double, double, std::uint64_t, std::uint64_t, unsigned>(),
           py::kw_only(), "placement"_a = "virtual-plane", "spacing"_a = 1.0,
           "kernel_radius"_a = 3.0, "cell_size"_a = 1.0, "reference_radius"_a = std::nullopt,
           "clean"_a = std::nullopt, "thinning_distance"_a = SurfaceParameters{}.thinning_distance,
           "simplify"_a = 0.0, "max_drop_particles"_a = SurfaceParameters{}.max_drop_particles,
           "min_component_particles"_a = 0, "threads"_a = 1)
      .def("reconstruct", &Surfaces::Reconstruct, "positions"_a, py::kw_only(),
           "validate"_a = false);
}

}  // namespace partiemc::python
