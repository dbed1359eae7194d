#include "client/python/research.h"

#include <pybind11/stl.h>

#include <map>
#include <memory>
#include <string>

#include "client/python/results.h"
#include "partiemc/validate.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

// Sets members of `target` to the values in the dict research[kind]. `named` maps the names to
// members.
template <typename Value, typename Named, typename Target>
void TakeAll(py::dict& research, const char* kind, const Named& named, Target& target) {
  if (!research.contains(kind)) return;
  const auto given = research.attr("pop")(kind).cast<std::map<std::string, Value>>();
  for (const auto& [name, value] : given) {
    bool known = false;
    for (const auto& one : named) {
      if (one.name != name) continue;
      target.*one.value = value;
      known = true;
    }
    if (!known)
      throw py::key_error("_research: none of the " + std::string(kind) + " is '" + name + "'");
  }
}

template <typename Named, typename Target>
py::dict AllOf(const Named& named, const Target& target) {
  py::dict values;
  for (const auto& one : named) values[py::str(std::string(one.name))] = target.*one.value;
  return values;
}

py::dict Defaults() {
  const VirtualPlaneVariant variant;
  using namespace py::literals;
  return py::dict("steps"_a = AllOf(AllSteps(), variant.steps),
                  "constants"_a = AllOf(AllConstants(), variant.constants));
}

}  // namespace

VirtualPlaneVariant TakeResearch(Arguments& arguments) {
  VirtualPlaneVariant variant;
  const auto given = arguments.Take<py::dict>("_research");
  if (!given) return variant;
  py::dict research(given->attr("copy")());
  TakeAll<bool>(research, "steps", AllSteps(), variant.steps);
  TakeAll<double>(research, "constants", AllConstants(), variant.constants);
  if (!research.empty()) throw py::key_error("_research: must be a dict of steps, constants");
  return variant;
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
