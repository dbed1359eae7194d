// The number of random inputs of a test.
#pragma once

namespace partiemc::support {

/// Returns `all`, and a tenth of it with sanitizers: they make each try 10 to 20 times as slow.
template <typename Count>
constexpr Count Tries(Count all) {
#ifdef PARTIEMC_SANITIZED
  return all < Count(10) ? Count(1) : Count(all / Count(10));
#else
  return all;
#endif
}

}  // namespace partiemc::support
