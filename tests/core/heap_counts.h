// Counts operator new, which a program replaces by linking heap_counts.cc.
#pragma once

#include <atomic>
#include <cstddef>

namespace partiemc::support {

/// Calls of operator new. oneTBB takes memory for its tasks by other means, which is not counted.
extern std::atomic<std::size_t> allocations;
/// Bytes in use, and their maximum. A test sets the maximum before it measures.
extern std::atomic<std::size_t> live_bytes, peak_bytes;

}  // namespace partiemc::support
