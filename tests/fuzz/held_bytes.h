// Bytes of the heap in use, so that a target can detect growth.
#pragma once

#include <malloc.h>

#include <cstddef>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define PARTIEMC_HEAP_OF_SANITIZER
#endif
#endif
#ifdef PARTIEMC_HEAP_OF_SANITIZER
#include <sanitizer/allocator_interface.h>
#endif

namespace partiemc::fuzz {

inline std::size_t HeldBytes() {
#ifdef PARTIEMC_HEAP_OF_SANITIZER
  return __sanitizer_get_current_allocated_bytes();
#else
  const auto heap = mallinfo2();
  return heap.uordblks + heap.hblkhd;
#endif
}

}  // namespace partiemc::fuzz
