// The Python class for watches.
#pragma once

#include <pybind11/pybind11.h>

namespace partiemc::python {

void DefineWatch(pybind11::module_& module);

}  // namespace partiemc::python
