// The heap of the process: when it returns freed memory to the operating system.
#pragma once

#include <cstdint>

namespace partiemc::server {

/// Returns all freed memory to the operating system now; otherwise jemalloc does so within
/// seconds. Other threads may allocate at the same time. Does nothing in programs without jemalloc:
/// tests, and servers with sanitizers.
void GiveBackFreedMemory();

/// Resident memory of the process in bytes; 0 if unknown. Cost: some microseconds.
std::uint64_t ResidentBytes();

}  // namespace partiemc::server
