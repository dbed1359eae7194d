// Counts calls of malloc and its kin, which this program replaces (glibc only).
#pragma once

#include <cstdint>

namespace partiemc::bench {

struct Allocations {
  std::uint64_t calls = 0;      ///< Of everything but oneTBB.
  std::uint64_t bytes = 0;      ///< That these calls asked for.
  std::uint64_t tbb_calls = 0;  ///< Of oneTBB itself, whose pool of tasks is its own affair.
};

/// Counts on all threads until stopped. One count at a time.
void StartCountingAllocations();
Allocations StopCountingAllocations();

}  // namespace partiemc::bench
