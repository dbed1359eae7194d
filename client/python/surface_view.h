// Surfaces in space for Python.
#pragma once

#include <pybind11/pybind11.h>

namespace partiemc::python {

void DefineSurface(pybind11::module_& module);

/// The surface of a Result, as a view that keeps the result alive.
pybind11::object SurfaceOf(const pybind11::object& result);

}  // namespace partiemc::python
