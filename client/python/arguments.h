// Converts arguments of Python functions, and names an argument of the wrong type.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace partiemc::python {

/// Words for the Python values that convert to T. Integers have no specialization.
template <typename T>
inline constexpr const char* kExpected =
    std::is_unsigned_v<T> ? "a whole number of 0 or more" : "a whole number";
template <>
inline constexpr const char* kExpected<bool> = "True or False";
template <>
inline constexpr const char* kExpected<double> = "a number";
template <>
inline constexpr const char* kExpected<std::string> = "a string";
template <>
inline constexpr const char* kExpected<std::vector<std::string>> = "a list of strings";
template <>
inline constexpr const char* kExpected<std::vector<std::int32_t>> = "a list of whole numbers";
template <>
inline constexpr const char* kExpected<std::vector<pybind11::dict>> = "a list of dicts";
template <>
inline constexpr const char* kExpected<std::vector<pybind11::object>> = "a list";
template <>
inline constexpr const char* kExpected<std::map<std::string, std::string>> = "a dict of strings";
template <>
inline constexpr const char* kExpected<pybind11::dict> = "a dict";
template <>
inline constexpr const char* kExpected<pybind11::object> = "an object";

/// Raises TypeError: argument `name` must be `expected`, not `value`. The message has the beginning
/// of a long value.
[[noreturn]] void RaiseType(const std::string& name, const char* expected,
                            const pybind11::object& value);

/// True for a complex number. NumPy would drop its imaginary part.
bool IsComplex(const pybind11::object& value);

/// Converts the argument `name` to a T. Raises TypeError for a value of another type.
template <typename T>
T As(const pybind11::object& value, const std::string& name) {
  if (!std::is_same_v<T, double> || !IsComplex(value)) {
    try {
      return value.cast<T>();
    } catch (const pybind11::cast_error&) {
    } catch (const pybind11::error_already_set& error) {  // Of a conversion to a dict.
      if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError)) throw;
    }
  }
  RaiseType(name, kExpected<T>, value);
}

/// The same for an argument that may be None.
template <typename T>
std::optional<T> AsOptional(const pybind11::object& value, const std::string& name) {
  if (value.is_none()) return std::nullopt;
  return As<T>(value, name);
}

/// The keyword arguments of a call that are not taken yet.
class Arguments {
 public:
  /// Arguments are removed from `given`. Errors name an argument by `prefix` and its name.
  explicit Arguments(pybind11::dict given, std::string prefix = {})
      : given_(std::move(given)), prefix_(std::move(prefix)) {}

  /// Removes the argument `name` and returns its value. Empty if it is absent or None. Raises
  /// TypeError for a value of another type.
  template <typename T>
  std::optional<T> Take(const char* name) {
    taken_.emplace_back(name);
    if (!given_.contains(name)) return std::nullopt;
    return AsOptional<T>(given_.attr("pop")(name), prefix_ + name);
  }

  template <typename T>
  void TakeInto(const char* name, T& value) {
    if (auto given = Take<T>(name)) value = *std::move(given);
  }
  template <typename T>
  void TakeInto(const char* name, std::optional<T>& value) {
    if (auto given = Take<T>(name)) value = *std::move(given);
  }

  bool empty() const { return given_.empty(); }
  /// Raises TypeError if arguments are left.
  void ExpectNothingElse(const char* function) const;
  /// The names that were requested, present or absent.
  const std::vector<std::string>& taken() const { return taken_; }

 private:
  pybind11::dict given_;
  std::string prefix_;
  std::vector<std::string> taken_;
};

/// Names of the arguments that `take` removes from an Arguments.
template <typename TakeAll>
pybind11::list NamesTakenBy(TakeAll take) {
  Arguments none{pybind11::dict()};
  take(none);
  return pybind11::cast(none.taken());
}

}  // namespace partiemc::python
