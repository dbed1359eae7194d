// Helpers for Rings, Mesh and Surface in Python: views of members of a result.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <vector>

#include "client/python/arrays.h"

namespace partiemc::python {

/// A member of a result, such as its rings. `owner` is the Python object that keeps it alive.
template <typename Part>
struct PartOf {
  pybind11::object owner;
  const Part& part;
};

/// The number `member` of the measures of all rings or shells, as a strided view of shape (count,).
/// With `columns`, its shape is (count, columns): the other columns are the numbers that follow
/// `member` in memory.
template <typename As, typename T, typename Measures, typename Part>
pybind11::array Column(const PartOf<Part>& of, T Measures::*member, pybind11::ssize_t columns = 0) {
  const std::vector<Measures>& measures = of.part.measures;
  const void* first = measures.empty() ? nullptr : &(measures.front().*member);
  const auto count = static_cast<pybind11::ssize_t>(measures.size());
  constexpr pybind11::ssize_t kStride = sizeof(Measures);
  if (columns == 0) return View<As>(first, {count}, {kStride}, of.owner);
  return View<As>(first, {count, columns}, {kStride, sizeof(T)}, of.owner);
}

/// Pickles a member of a result as a reference: the result, and the name of its attribute.
template <typename Part>
auto Reduce(const char* attribute) {
  return [attribute](const PartOf<Part>& view) {
    namespace py = pybind11;
    return py::make_tuple(py::module_::import("builtins").attr("getattr"),
                          py::make_tuple(view.owner, attribute));
  };
}

}  // namespace partiemc::python
