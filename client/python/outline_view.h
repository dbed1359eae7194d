// Outlines for Python: rings with their gauges, and meshes.
#pragma once

#include <pybind11/pybind11.h>

namespace partiemc::python {

void DefineOutline(pybind11::module_& module);

/// Rings and mesh of a Result, as views that keep the result alive.
pybind11::object RingsOf(const pybind11::object& result);
pybind11::object MeshOf(const pybind11::object& result);

}  // namespace partiemc::python
