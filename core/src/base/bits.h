// Small functions of numbers and indices that are inlined, a hash for tables, and the invalid index
// kNoIndex.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>

#include "base/expansion.h"

namespace partiemc {

inline constexpr std::uint32_t kNoIndex = 0xffffffff;

/// Counts the set bits. Without a processor instruction for it, std::popcount is a library call
/// that costs more than this sum.
constexpr int CountBits(std::uint32_t bits) {
  bits -= bits >> 1 & 0x55555555u;
  bits = (bits & 0x33333333u) + (bits >> 2 & 0x33333333u);
  bits = (bits + (bits >> 4)) & 0x0f0f0f0fu;
  return static_cast<int>(bits * 0x01010101u >> 24);
}

/// Whether more than one bit is set.
constexpr bool HasSeveral(std::uint32_t bits) { return (bits & (bits - 1)) != 0; }

/// Equals std::floor, but -0 becomes 0. Without a processor instruction for it, std::floor is a
/// library call, while this function is inlined.
inline double Floor(double value) {
  constexpr double kMostExact = 2147483648;  // 2^31, so that the conversion is defined.
  if (!(value >= -kMostExact && value < kMostExact)) return std::floor(value);
  const auto whole = static_cast<double>(static_cast<std::int32_t>(value));
  return whole - static_cast<double>(whole > value);  // Without a branch.
}

/// Its address is random if the system loads programs at random addresses.
inline constexpr char kAtRandomAddress = 0;

/// Hashes 128 bits for a hash table whose keys come from an untrusted client. All bits of the hash
/// are usable. Hashes differ from process to process, so a client cannot choose keys that collide.
/// Results must not depend on them.
///
/// The high and the low half of a product are combined, as in wyhash. The seed is an address, as in
/// Abseil's hash, because the core has no source of random numbers.
inline std::uint64_t TableHash(std::uint64_t key, std::uint64_t more = 0) {
  __extension__ using Product = unsigned __int128;
  // Of an address, bits 12 to 39 are random.
  const std::uint64_t seed =
      reinterpret_cast<std::uintptr_t>(&kAtRandomAddress) << 24 ^ 0xc2b2ae3d27d4eb4fu;
  const Product product =
      Product{(key * 0x9e3779b97f4a7c15u) ^ seed} * Product{(more * 0xbf58476d1ce4e5b9u) ^ seed};
  return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
}

/// 2^exponent. Requires: a normal double, from 2^-1022 to 2^1023.
constexpr double PowerOfTwo(int exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
}

/// The cube root. Its bits are the same on every machine, while std::cbrt differs between
/// versions of libm. Correctly rounded, except if the exact root is within 2^-100 of its size
/// from the middle between two doubles. Cubes have exact roots.
inline double CubeRoot(double value) {
  if (value == 0 || !std::isfinite(value)) return value;
  // |value| = scaled * 8^third with `scaled` in [1/8, 1). Products with powers of two are exact.
  int exponent = 0;
  const double fraction = std::frexp(std::abs(value), &exponent);
  const int third = exponent > 0 ? (exponent + 2) / 3 : exponent / 3;
  const double scaled = fraction * PowerOfTwo(exponent - 3 * third);
  // A parabola with a relative error of 2 %, and two steps of Halley's method.
  double root = .3916 + scaled * (.9964 - .3771 * scaled);
  for (int step = 0; step < 2; ++step) {
    const double cube = root * root * root;
    root *= (cube + 2 * scaled) / (2 * cube + scaled);
  }
  // A step of Newton's method, with the residual in twice the precision.
  const Rounded square = TwoProduct(root, root);
  const Rounded cube = TwoProduct(square.value, root);
  const double rest = ((scaled - cube.value) - cube.error) - square.error * root;
  root += rest / (3 * square.value);
  return std::copysign(root * PowerOfTwo(third), value);
}

/// The root of the set of an element in a union-find structure: the element that is its own parent.
/// `parent`: projection of an entry to the parent. Halves the path.
template <typename Entries, typename Parent = std::identity>
std::uint32_t RootOf(Entries& entries, std::uint32_t element, Parent parent = {}) {
  const auto parent_of = [&](std::uint32_t of) -> std::uint32_t& {
    return std::invoke(parent, entries[of]);
  };
  while (parent_of(element) != element) {
    element = parent_of(element) = parent_of(parent_of(element));
  }
  return element;
}

}  // namespace partiemc
