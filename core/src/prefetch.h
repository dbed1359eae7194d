#pragma once

#include <hwy/cache_control.h>

#include <cstddef>
#include <span>

namespace partiemc {

/// Asks the memory for values that are soon read or written: they come while something else is
/// done.
template <typename T>
void PrefetchLines(std::span<const T> values) {
  constexpr std::size_t kPerLine = 64 / sizeof(T);
  for (std::size_t k = 0; k < values.size(); k += kPerLine) hwy::Prefetch(values.data() + k);
}

}  // namespace partiemc
