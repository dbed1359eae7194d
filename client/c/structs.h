// Structs of C that may have been compiled with a shorter or a longer version of themselves.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace partiemc::c {

/// Writes as much of `ours` as a caller has whose struct is `size` bytes long.
template <typename T>
void Give(T ours, std::size_t size, T* theirs) {
  ours.size = size;
  std::memcpy(static_cast<void*>(theirs), &ours, std::min(size, sizeof ours));
}

/// `theirs` with what it lacks at `defaults`.
template <typename T>
T Take(const T* theirs, T defaults) {
  if (theirs != nullptr) {
    std::memcpy(static_cast<void*>(&defaults), theirs, std::min(theirs->size, sizeof defaults));
  }
  return defaults;
}

}  // namespace partiemc::c
