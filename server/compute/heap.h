// Configures when the C library's heap returns freed memory to the operating system. glibc only.
#pragma once

#include <cstdint>

namespace partiemc::server {

/// Keeps freed memory in the process. A stream allocates and frees the bytes of its frames all the
/// time. Returning the pages to the system each time costs more than copying the bytes. Requires:
/// no thread was started yet.
void KeepFreedMemory();

/// Returns all freed memory to the operating system. Cost: half a millisecond for 13 MiB, during
/// which no other thread can allocate.
void GiveBackFreedMemory();

/// Resident memory of the process in bytes; 0 if unknown. Cost: some microseconds.
std::uint64_t ResidentBytes();

}  // namespace partiemc::server
