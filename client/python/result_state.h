// The state of a Result that pickle stores.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "client/python/results.h"

namespace partiemc::python {

/// The result as a message of the protocol, and the values that the message cannot hold. Raises
/// ValueError if the message has more than 2 GiB.
pybind11::tuple StateOf(PythonResult& result);

/// The result of a state, also of an older version. Raises ValueError or partiemc.Error for damaged
/// states.
std::shared_ptr<PythonResult> ResultOf(const pybind11::tuple& state);

}  // namespace partiemc::python
