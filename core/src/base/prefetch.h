// Prefetches memory.
#pragma once

#include <hwy/cache_control.h>

#include <cstddef>
#include <span>

namespace partiemc {

/// Prefetches the cache lines of `values`. Useful for arrays that have left the near caches, even
/// if they are read in sequence: some machines, above all virtual ones, do not prefetch by
/// themselves.
template <typename T>
void PrefetchLines(std::span<const T> values) {
  constexpr std::size_t kLine = 64;
  const auto bytes = std::as_bytes(values);
  for (std::size_t at = 0; at < bytes.size(); at += kLine) hwy::Prefetch(bytes.data() + at);
}

}  // namespace partiemc
