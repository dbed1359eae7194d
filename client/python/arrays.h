// Converts NumPy arrays to views, and results to NumPy arrays.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/client/particle_arrays.h"

namespace partiemc::python {

/// Converts `given` to an array. Raises partiemc.Error (UNSUPPORTED) if this is impossible,
/// TypeError for complex numbers and ValueError for masked entries, because a conversion to numbers
/// would drop imaginary parts and masks. `field` names the argument.
pybind11::array AsArray(const pybind11::object& given, const std::string& field);

/// The numbers of an array as float64 in C order.
using ContiguousNumbers =
    pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// The arrays of a frame, and a view of them. NumPy arrays are used in place with any strides.
/// Lists, and arrays of other number types or byte orders, are converted to float64, which copies
/// them. Requires the GIL, except arrays().
class PythonParticles {
 public:
  /// `positions`: (N, 2), (N, 3), or a tuple of two or three arrays of N coordinates. `volumes`: N.
  /// `ids`: N integers of 32 or 64 bits; others are refused. `velocities`: like positions.
  /// `attributes`: a dict from names to (N,), (N, 2), (N, 3), or tuples. `box`: see BoxOf. None:
  /// absent. Raises partiemc.Error (reasons COUNT, UNSUPPORTED) and the errors of AsArray.
  PythonParticles(const pybind11::object& positions, const pybind11::object& volumes,
                  const pybind11::object& ids, const pybind11::object& velocities,
                  const pybind11::object& attributes,
                  const pybind11::object& box = pybind11::none());
  PythonParticles(const PythonParticles&) = delete;  // Holds views into itself.
  PythonParticles& operator=(const PythonParticles&) = delete;

  const client::ParticleArrays& arrays() const { return arrays_; }

 private:
  // The columns of `given`: two or three views of the same length.
  std::vector<client::Reals> Columns(const pybind11::object& given, const std::string& field);
  void TakeAttributes(const pybind11::dict& given);
  client::Reals Numbers(const pybind11::object& given, const std::string& field);
  client::Ids WholeNumbers(const pybind11::object& given);
  pybind11::array Real(const pybind11::array& given, const std::string& field);
  void ExpectCount(const pybind11::array& array, const std::string& field) const;

  std::vector<pybind11::array> kept_;  // Keeps the memory of the views.
  std::vector<std::string> names_;     // Of attributes_.
  std::vector<client::AttributeArrays> attributes_;
  bool counted_ = false;  // True once an array has set arrays_.count.
  client::ParticleArrays arrays_;
};

/// Returns a read-only array of memory that `owner` keeps alive. `T` is the array's dtype.
template <typename T>
pybind11::array View(const void* first, std::vector<pybind11::ssize_t> shape,
                     std::vector<pybind11::ssize_t> strides, pybind11::handle owner) {
  pybind11::array view(pybind11::dtype::of<T>(), std::move(shape), std::move(strides), first,
                       owner);
  pybind11::detail::array_proxy(view.ptr())->flags &=
      ~pybind11::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

/// Returns a read-only array of a vector's numbers, in rows of `columns` numbers. The array is
/// one-dimensional if `columns` is 1.
template <typename As, typename T>
pybind11::array View(const std::vector<T>& numbers, std::size_t columns, pybind11::handle owner) {
  static_assert(sizeof(As) == sizeof(T));
  const auto rows = static_cast<pybind11::ssize_t>(numbers.size() / columns);
  const auto width = static_cast<pybind11::ssize_t>(columns * sizeof(T));
  if (columns == 1) return View<As>(numbers.data(), {rows}, {width}, owner);
  return View<As>(numbers.data(), {rows, static_cast<pybind11::ssize_t>(columns)},
                  {width, sizeof(T)}, owner);
}

}  // namespace partiemc::python
