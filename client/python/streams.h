// Python class for streams of a producer, and functions that query a server.
#pragma once

#include <pybind11/pybind11.h>

namespace partiemc::python {

void DefineStreams(pybind11::module_& module);

}  // namespace partiemc::python
