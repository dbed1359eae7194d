// Python classes for streams and watches.
#pragma once

#include <pybind11/pybind11.h>

namespace partiemc::python {

void DefineStreams(pybind11::module_& module);

}  // namespace partiemc::python
