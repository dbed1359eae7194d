#include "client/python/arrays.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/python/errors.h"
#include "client/python/parameters.h"
#include "partiemc/status.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

std::string ShapeOf(const py::array& array) {
  std::string shape = "shape (";
  for (py::ssize_t k = 0; k < array.ndim(); ++k) {
    absl::StrAppend(&shape, k == 0 ? "" : ", ", array.shape(k));
  }
  return shape + ")";
}

[[noreturn]] void RaiseCount(const std::string& field, std::string value, std::string rule) {
  Raise(Invalid(kReasonCount, field, std::move(value), std::move(rule)));
}

[[noreturn]] void RaiseNoNumbers(const std::string& field, const py::object& type) {
  Raise(Invalid("UNSUPPORTED", field, py::str(type), "must be an array of numbers"));
}

// Raises ValueError if `given` is a masked array (numpy.ma) with masked entries.
void ExpectNoMask(py::handle given, const std::string& field) {
  if (!py::isinstance<py::array>(given) || !py::hasattr(given, "compressed")) return;
  const auto masked =
      py::module_::import("numpy").attr("ma").attr("count_masked")(given).cast<std::size_t>();
  if (masked == 0) return;
  throw py::value_error(absl::StrCat(
      "argument '", field, "' has ", masked, " masked entries: select the entries without a mask ",
      "first, for the same particles in all arrays of a frame (numpy.ma.getmaskarray)"));
}

// True if `type` is T in this machine's byte order, under any of NumPy's names. Reads the attribute
// `itemsize`: pybind11 before 2.12 reads it at the place that it had before NumPy 2.
template <typename T>
bool Is(const py::dtype& type) {
  return type.kind() == py::dtype::of<T>().kind() &&
         type.attr("itemsize").cast<std::size_t>() == sizeof(T) &&
         type.attr("isnative").cast<bool>();
}

// A view of the array's numbers from `first` on, in the array's type.
client::Reals RealsOf(const py::array& array, const void* first, py::ssize_t stride) {
  if (Is<float>(array.dtype())) return {static_cast<const float*>(first), stride};
  return {static_cast<const double*>(first), stride};
}

bool IsTuple(const py::object& given) {
  if (!py::isinstance<py::tuple>(given)) return false;
  for (const py::handle one : given) {
    if (!py::isinstance<py::array>(one)) return false;
  }
  return true;
}

}  // namespace

py::array AsArray(const py::object& given, const std::string& field) {
  ExpectNoMask(given, field);
  if (py::isinstance<py::list>(given) || py::isinstance<py::tuple>(given)) {
    for (const py::handle one : given) ExpectNoMask(one, field);
  }
  py::array array = py::array::ensure(given);
  if (!array) RaiseNoNumbers(field, py::object(py::type::of(given).attr("__name__")));
  if (array.dtype().kind() == 'c') {
    throw py::type_error("argument '" + field + "' has complex numbers: pass real numbers, such " +
                         "as their real parts (array.real)");
  }
  return array;
}

PythonParticles::PythonParticles(const py::object& positions, const py::object& volumes,
                                 const py::object& ids, const py::object& velocities,
                                 const py::object& attributes, const py::object& box) {
  const auto place = Columns(positions, "positions");
  arrays_.x = place[0];
  arrays_.y = place[1];
  if (place.size() == 3) arrays_.z = place[2];
  if (!volumes.is_none()) arrays_.volumes = Numbers(volumes, "volumes");
  if (!ids.is_none()) arrays_.ids = WholeNumbers(ids);
  if (!attributes.is_none()) {
    if (!py::isinstance<py::dict>(attributes)) {
      Raise(Invalid("UNSUPPORTED", "attributes", py::str(py::type::of(attributes).attr("__name__")),
                    "must be a dict of names and arrays"));
    }
    TakeAttributes(attributes);
  }
  if (!box.is_none()) {
    if (!py::isinstance<py::dict>(box)) {
      Raise(Invalid("UNSUPPORTED", "box", py::str(py::type::of(box).attr("__name__")),
                    "must be a dict of periodic axes with their bounds"));
    }
    arrays_.box = BoxOf(box);
  }
  if (velocities.is_none()) return;
  const auto velocity = Columns(velocities, "velocities");
  if (velocity.size() != place.size()) {
    RaiseCount("velocities", absl::StrCat(velocity.size(), " columns"),
               absl::StrCat("must be as many as of positions, ", place.size()));
  }
  arrays_.velocity_x = velocity[0];
  arrays_.velocity_y = velocity[1];
  if (velocity.size() == 3) arrays_.velocity_z = velocity[2];
}

void PythonParticles::TakeAttributes(const py::dict& given) {
  names_.reserve(given.size());  // Keeps views into the names valid.
  for (const auto& [key, value] : given) {
    const auto values = py::reinterpret_borrow<py::object>(value);
    if (!py::isinstance<py::str>(key)) {
      Raise(Invalid("UNSUPPORTED", "attributes", py::str(key), "must have names that are strings"));
    }
    client::AttributeArrays attribute{.name = names_.emplace_back(py::str(key)), .x = {}};
    const std::string field = "attributes['" + names_.back() + "']";
    const bool is_scalar = !IsTuple(values) && AsArray(values, field).ndim() == 1;
    const auto columns = is_scalar ? std::vector{Numbers(values, field)} : Columns(values, field);
    attribute.x = columns[0];
    if (columns.size() > 1) attribute.y = columns[1];
    if (columns.size() > 2) attribute.z = columns[2];
    attributes_.push_back(attribute);
  }
  arrays_.attributes = attributes_;
}

// Converts `given` to float or double in this machine's byte order, unless it already has one of
// these types.
py::array PythonParticles::Real(const py::array& given, const std::string& field) {
  py::array array = given;
  if (!Is<float>(array.dtype()) && !Is<double>(array.dtype())) {
    array = py::array_t<double, py::array::forcecast>::ensure(given);
    if (!array) RaiseNoNumbers(field, py::object(given.dtype()));
  }
  kept_.push_back(array);
  return array;
}

void PythonParticles::ExpectCount(const py::array& array, const std::string& field) const {
  if (counted_ && static_cast<std::size_t>(array.shape(0)) != arrays_.count) {
    RaiseCount(field, ShapeOf(array), absl::StrCat("must have ", arrays_.count, " rows"));
  }
}

std::vector<client::Reals> PythonParticles::Columns(const py::object& given,
                                                    const std::string& field) {
  std::vector<client::Reals> columns;
  if (IsTuple(given)) {
    for (const py::handle one : given) {
      columns.push_back(Numbers(py::reinterpret_borrow<py::object>(one), field));
    }
    if (columns.size() != 2 && columns.size() != 3) {
      RaiseCount(field, absl::StrCat(columns.size(), " arrays"), "must be two or three");
    }
    return columns;
  }
  const py::array any = AsArray(given, field);
  if (any.ndim() != 2 || (any.shape(1) != 2 && any.shape(1) != 3)) {
    RaiseCount(field, ShapeOf(any), "must be (N, 2) or (N, 3), or a tuple of arrays of N each");
  }
  ExpectCount(any, field);
  const py::array array = Real(any, field);
  arrays_.count = static_cast<std::size_t>(array.shape(0));
  counted_ = true;
  for (py::ssize_t k = 0; k < array.shape(1); ++k) {
    columns.push_back(RealsOf(array, static_cast<const char*>(array.data()) + k * array.strides(1),
                              array.strides(0)));
  }
  return columns;
}

client::Reals PythonParticles::Numbers(const py::object& given, const std::string& field) {
  const py::array any = AsArray(given, field);
  if (any.ndim() != 1) RaiseCount(field, ShapeOf(any), "must have one dimension");
  ExpectCount(any, field);
  const py::array array = Real(any, field);
  arrays_.count = static_cast<std::size_t>(array.shape(0));
  counted_ = true;
  return RealsOf(array, array.data(), array.strides(0));
}

client::Ids PythonParticles::WholeNumbers(const py::object& given) {
  const py::array array = AsArray(given, "ids");
  if (array.ndim() != 1) RaiseCount("ids", ShapeOf(array), "must have one dimension");
  ExpectCount(array, "ids");
  kept_.push_back(array);
  const py::dtype type = array.dtype();
  const auto stride = array.strides(0);
  std::optional<client::Ids> ids;
  const auto take = [&]<typename T>(T) {
    if (Is<T>(type)) ids = client::Ids(static_cast<const T*>(array.data()), stride);
  };
  take(std::int64_t{});
  take(std::uint64_t{});
  take(std::int32_t{});
  take(std::uint32_t{});
  if (ids) return *ids;
  Raise(Invalid("UNSUPPORTED", "ids", py::str(py::object(type)),
                "must be integers of 32 or 64 bits"));
}

}  // namespace partiemc::python
