// Memory asked for before it is needed.
#pragma once

#include <hwy/cache_control.h>

#include <cstddef>
#include <span>

namespace partiemc {

/// Asks the memory for values that are soon read or written: they come while something else is
/// done. Worth it for arrays that have left the near caches since they were last used, even where
/// they are gone through in their order: not every machine asks for what comes next by itself,
/// virtual ones least of all.
template <typename T>
void PrefetchLines(std::span<const T> values) {
  constexpr std::size_t kLine = 64;
  const auto bytes = std::as_bytes(values);
  for (std::size_t at = 0; at < bytes.size(); at += kLine) hwy::Prefetch(bytes.data() + at);
}

}  // namespace partiemc
