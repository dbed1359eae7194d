// Parameters for research only. Not part of the documented package; used by
// client/evaluation/partiemc_evaluation.
#pragma once

#include <pybind11/pybind11.h>

#include "client/python/arguments.h"
#include "core/internal/research.h"

namespace partiemc::python {

/// Removes `_research` from `arguments`: a dict {"steps": {name: bool}, "constants": {name: float}}
/// of the values that differ from the default. Raises KeyError for an unknown name, TypeError for a
/// value of the wrong type.
VirtualPlaneVariant TakeResearch(Arguments& arguments);

/// Adds `_research()`, which returns the steps and constants with their default values in the same
/// form, and `_count_t_junctions(result)`.
void DefineResearch(pybind11::module_& module);

}  // namespace partiemc::python
