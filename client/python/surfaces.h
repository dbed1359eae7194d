// Surfaces in space, for research: client/evaluation measures them. Not part of the documented
// package.
#pragma once

#include <pybind11/pybind11.h>

namespace partiemc::python {

/// Adds `_Surfaces(**parameters)`, whose `reconstruct(positions)` returns a dict of arrays.
void DefineSurfaces(pybind11::module_& module);

}  // namespace partiemc::python
