// Arrays of numbers in `bytes` fields: little-endian, tightly packed.
#pragma once

#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace partiemc::wire {

static_assert(std::endian::native == std::endian::little,
              "the wire is little-endian; arrays are copied and viewed without conversion");

/// Replaces `bytes` by the numbers in `values`. Reuses its buffer.
template <typename T>
void AssignBytes(std::span<const T> values, std::string& bytes) {
  if (values.empty()) {
    bytes.clear();
  } else {
    bytes.assign(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
}

/// A view of `bytes` as numbers. Requires: the size is a multiple of sizeof(T). The alignment
/// suffices, because the strings of libstdc++ begin at multiples of 8.
template <typename T>
std::span<const T> ViewBytes(const std::string& bytes) {
  assert(reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(T) == 0);
  return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
}

/// Replaces `values` by the numbers in `bytes`. Requires: the size of `bytes` is a multiple of
/// sizeof(T).
template <typename T>
void CopyBytes(const std::string& bytes, std::vector<T>& values) {
  values.resize(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
}

}  // namespace partiemc::wire
