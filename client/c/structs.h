// Copies C structs between callers and libraries of different versions: `size` gives the caller's
// length.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace partiemc::c {

/// Copies the first `size` bytes of `ours` to the caller's struct.
template <typename T>
void Give(T ours, std::size_t size, T* theirs) {
  ours.size = size;
  std::memcpy(static_cast<void*>(theirs), &ours, std::min(size, sizeof ours));
}

/// Copies `theirs`; members beyond its size come from `defaults`.
template <typename T>
T Take(const T* theirs, T defaults) {
  if (theirs != nullptr) {
    std::memcpy(static_cast<void*>(&defaults), theirs, std::min(theirs->size, sizeof defaults));
  }
  return defaults;
}

}  // namespace partiemc::c
