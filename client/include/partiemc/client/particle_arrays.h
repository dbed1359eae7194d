// Particles in a simulator's own arrays. Each quantity may be anywhere in memory, with any stride.
//
//   stream->SendArrays({.count = n, .x = x, .y = y}, time);                    // arrays apart
//   constexpr std::ptrdiff_t kStride = 3 * sizeof(double);               // x, y, z, x, y, z, ...
//   stream->SendArrays({.count = n, .x = {xyz, kStride}, .y = {xyz + 1, kStride}}, time);
//   stream->SendArrays({.count = n, .x = {&bodies[0].x, sizeof(Body)}, .y = {&bodies[0].y,
//   sizeof(Body)},
//                 .ids = {&bodies[0].tag, sizeof(Body)}}, time);
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include "partiemc/parameters.h"

namespace partiemc::client {

/// A view of one number per particle, with a byte stride. All numbers have the same type, one of
/// `Numbers`. Owns nothing.
template <typename... Numbers>
class StridedView {
 public:
  /// An absent array.
  StridedView() = default;

  /// The number of particle k is `k * stride` bytes after `first`. The stride may be 0 or negative;
  /// numbers need not be aligned.
  template <typename T>
  requires(std::same_as<T, Numbers> || ...)
      StridedView(const T* first, std::ptrdiff_t stride = sizeof(T))
      : first_(first), stride_(stride) {}

  bool empty() const {
    return std::visit([](const auto* first) { return first == nullptr; }, first_);
  }
  std::ptrdiff_t stride() const { return stride_; }
  /// Calls `use` with the typed pointer to particle 0's number.
  template <typename Use>
  decltype(auto) Visit(Use&& use) const {
    return std::visit(std::forward<Use>(use), first_);
  }

 private:
  std::variant<const Numbers*...> first_;
  std::ptrdiff_t stride_ = 0;
};

using Reals = StridedView<float, double>;
using Ids = StridedView<std::uint64_t, std::int64_t, std::uint32_t, std::int32_t>;

/// Same as Attribute, with one view per component. A number has only `x`, a vector of two
/// components `x` and `y`, a vector of three all.
struct AttributeArrays {
  std::string_view name;  ///< As in Attribute.
  Reals x, y = {}, z = {};
};

/// Same as Frame, with one view per quantity. Each view must stay valid until the call that
/// receives it returns. The call copies each number; Stream::SendArrays copies it directly into the
/// message.
struct ParticleArrays {
  std::size_t count = 0;  ///< Number of particles; the length of each view that is given.

  /// World units, finite. With `z`, the particles lie in one plane parallel to
  /// ReconstructionParameters::plane, or fill space for a slice or a surface. Coordinates are sent
  /// as float if all of them are float, otherwise as double.
  Reals x, y, z;

  // All following members are optional, as in Frame. Doubles are rounded to float.
  Reals volumes;
  Ids ids;
  /// The same components as the coordinates, or none.
  Reals velocity_x, velocity_y, velocity_z;
  std::span<const AttributeArrays> attributes = {};
  std::optional<PeriodicBox> box = std::nullopt;  ///< As Frame::box.
};

}  // namespace partiemc::client
