#include "client/python/errors.h"

#include <utility>

namespace partiemc::python {
namespace {

namespace py = pybind11;

[[noreturn]] void RaiseError(const std::string& code, const std::string& message,
                             const Violation& violation, std::uint64_t sequence) {
  const py::object type = py::module_::import("partiemc._errors").attr("Error");
  const py::object error = type(message, code, violation.reason, violation.field, violation.value,
                                violation.rule, sequence);
  PyErr_SetObject(type.ptr(), error.ptr());
  throw py::error_already_set();
}

}  // namespace

void Raise(const absl::Status& status) {
  RaiseError(absl::StatusCodeToString(status.code()), std::string(status.message()),
             FindViolation(status).value_or(Violation{}), 0);
}

void Raise(const std::string& message, const Violation& violation, std::uint64_t sequence) {
  RaiseError("INVALID_ARGUMENT", message, violation, sequence);
}

absl::Status Invalid(std::string_view reason, std::string field, std::string value,
                     std::string rule) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

}  // namespace partiemc::python
