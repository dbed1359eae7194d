#include "client/python/research.h"

#include <pybind11/stl.h>

#include <array>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "client/python/results.h"
#include "partiemc/validate.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

struct NamedStep {
  std::string_view name;
  bool VirtualPlaneSteps::*flag;
};
constexpr std::array<NamedStep, 6> kSteps = {{
    {"edge-vertices", &VirtualPlaneSteps::edge_vertices},
    {"normals", &VirtualPlaneSteps::normals},
    {"curvature", &VirtualPlaneSteps::curvature},
    {"support", &VirtualPlaneSteps::support},
    {"smoothing", &VirtualPlaneSteps::smoothing},
    {"area", &VirtualPlaneSteps::area},
}};

bool& Find(VirtualPlaneSteps& steps, const std::string& name) {
  for (const NamedStep& step : kSteps) {
    if (step.name == name) return steps.*step.flag;
  }
  throw py::key_error("_research: no step is called '" + name + "'");
}

double& Find(VirtualPlaneConstants& constants, const std::string& name) {
  for (const NamedConstant& constant : AllConstants()) {
    if (constant.name == name) return constants.*constant.value;
  }
  throw py::key_error("_research: no constant is called '" + name + "'");
}

template <typename Value, typename Target>
void TakeAll(py::dict& research, const char* kind, Target& target) {
  if (!research.contains(kind)) return;
  const auto given = research.attr("pop")(kind).cast<std::map<std::string, Value>>();
  for (const auto& [name, value] : given) Find(target, name) = value;
}

py::dict Defaults() {
  const ReconstructionParameters parameters;
  py::dict steps, constants;
  for (const NamedStep& step : kSteps) {
    steps[py::str(std::string(step.name))] = parameters.steps.*step.flag;
  }
  for (const NamedConstant& constant : AllConstants()) {
    constants[py::str(std::string(constant.name))] = parameters.constants.*constant.value;
  }
  using namespace py::literals;
  return py::dict("steps"_a = steps, "constants"_a = constants);
}

}  // namespace

void TakeResearch(py::dict& arguments, ReconstructionParameters& parameters) {
  if (!arguments.contains("_research")) return;
  py::dict research(arguments.attr("pop")("_research").attr("copy")());
  TakeAll<bool>(research, "steps", parameters.steps);
  TakeAll<double>(research, "constants", parameters.constants);
  if (!research.empty()) throw py::key_error("_research: must be a dict of steps, constants");
}

void DefineResearch(py::module_& module) {
  module.def("_research", &Defaults, "Steps and constants of virtual-plane, with their defaults.");
  module.def(
      "_count_t_junctions",
      [](const std::shared_ptr<PythonResult>& result) {
        return CountTJunctions(result->frame.result);
      },
      "The number of vertices that lie inside a side of a triangle or ring.");
}

}  // namespace partiemc::python
