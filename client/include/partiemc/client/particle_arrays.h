// Particles as a simulator holds them: each quantity anywhere in its memory, any stride.
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
#include <span>
#include <string_view>
#include <utility>
#include <variant>

namespace partiemc::client {

/// One number for each particle, of one of the `Numbers`. Owns nothing.
template <typename... Numbers>
class StridedView {
 public:
  /// None.
  StridedView() = default;

  /// Particle k's lies `k * stride` bytes after `first`; the stride may be 0 or negative, and no
  /// number needs to be aligned.
  template <typename T>
  requires(std::same_as<T, Numbers> || ...)
      StridedView(const T* first, std::ptrdiff_t stride = sizeof(T))
      : first_(first), stride_(stride) {}

  bool empty() const {
    return std::visit([](const auto* first) { return first == nullptr; }, first_);
  }
  std::ptrdiff_t stride() const { return stride_; }
  /// Calls `use` with the pointer to particle 0's number.
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

/// One of Frame::attributes: a number, or a vector of two or three.
struct AttributeArrays {
  std::string_view name;  ///< As of Attribute.
  Reals x, y = {}, z = {};
};

/// What Frame is for interleaved arrays. Views must outlive the call that they are given to only;
/// it copies each number once, to where it is sent from.
struct ParticleArrays {
  std::size_t count = 0;  ///< Particles; each view that is given has so many numbers.

  /// World units, finite. With `z`, all particles must lie in one plane parallel to the one that
  /// ReconstructionParameters::plane names. They travel as float where all are float, else as
  /// double.
  Reals x, y, z;

  // Each as in Frame, and may be left out. Doubles are rounded to float.
  Reals volumes;
  Ids ids;  ///< Negative ones count as those above 2^63.
  /// As many of them as of coordinates, or none.
  Reals velocity_x, velocity_y, velocity_z;
  /// Rounded to float.
  std::span<const AttributeArrays> attributes = {};
};

}  // namespace partiemc::client
