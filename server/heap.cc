#include "server/heap.h"

#include <features.h>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace partiemc::server {

#ifdef __GLIBC__

void KeepFreedMemory() {
  // Pieces below this come from the heap, larger ones from the system and at once back to it. The
  // largest value that glibc takes.
  constexpr int kMappedBytes = 32 << 20;
  // What the end of the heap may hold unused: some frames of a million particles.
  constexpr int kTopBytes = 64 << 20;
  mallopt(M_MMAP_THRESHOLD, kMappedBytes);
  mallopt(M_TRIM_THRESHOLD, kTopBytes);
  // What one thread has freed serves the next. Warm threads allocate next to nothing, and what is
  // small comes from their own caches, so that they do not wait for each other.
  mallopt(M_ARENA_MAX, 1);
}

void GiveBackFreedMemory() { malloc_trim(0); }

#else

void KeepFreedMemory() {}
void GiveBackFreedMemory() {}

#endif

}  // namespace partiemc::server
