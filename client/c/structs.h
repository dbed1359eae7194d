// Copies C structs between a program and a library of different versions. The member `size` of a
// struct is its length in the program's version.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace partiemc::c {

/// Copies the library's struct `ours`, with its member `size` set, to the program's struct
/// `theirs`. Writes at most `size` bytes.
template <typename T>
void Give(T ours, std::size_t size, T* theirs) {
  ours.size = size;
  std::memcpy(static_cast<void*>(theirs), &ours, std::min(size, sizeof ours));
}

/// Returns a copy of the program's struct `theirs`. Members beyond theirs->size have the values of
/// `defaults`; if `theirs` is null, all members have.
template <typename T>
T Take(const T* theirs, T defaults) {
  if (theirs != nullptr) {
    std::memcpy(static_cast<void*>(&defaults), theirs, std::min(theirs->size, sizeof defaults));
  }
  return defaults;
}

}  // namespace partiemc::c
