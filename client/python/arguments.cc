#include "client/python/arguments.h"

namespace partiemc::python {

namespace py = pybind11;

void RaiseType(const std::string& name, const char* expected, const py::object& value) {
  const py::object shortened = py::module_::import("partiemc._calls").attr("shorten")(value);
  throw py::type_error("argument '" + name + "' must be " + expected + ", not " +
                       shortened.cast<std::string>());
}

bool IsComplex(const py::object& value) {
  if (PyFloat_CheckExact(value.ptr()) || PyLong_CheckExact(value.ptr())) return false;
  if (PyComplex_Check(value.ptr())) return true;
  const py::object type = py::getattr(value, "dtype", py::none());
  return py::getattr(type, "kind", py::none()).equal(py::str("c"));
}

void Arguments::ExpectNothingElse(const char* function) const {
  for (const auto& [name, value] : given_) {
    throw py::type_error("unknown argument " + py::repr(name).cast<std::string>() + " of " +
                         function + "()");
  }
}

}  // namespace partiemc::python
