// What research varies and users leave alone. Not part of the documented package:
// client/evaluation/partiemc_evaluation uses it.
#pragma once

#include <pybind11/pybind11.h>

#include "core/internal/research.h"

namespace partiemc::python {

/// Removes `_research` from `arguments`: a dict {"steps": {name: bool}, "constants": {name:
/// float}} of what differs from the default. Raises KeyError for an unknown name, TypeError for a
/// value of another kind.
VirtualPlaneVariant TakeResearch(pybind11::dict& arguments);

/// Adds `_research()`, which returns the steps and constants with their default values in the same
/// form, and `_count_t_junctions(result)`.
void DefineResearch(pybind11::module_& module);

}  // namespace partiemc::python
