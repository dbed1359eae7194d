// Python class that runs the core in this process.
#pragma once

#include <pybind11/pybind11.h>

namespace partiemc::python {

void DefineReconstructor(pybind11::module_& module);

}  // namespace partiemc::python
