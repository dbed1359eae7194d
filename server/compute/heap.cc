#include "server/compute/heap.h"

#include <fcntl.h>
#include <features.h>
#include <unistd.h>

#include <cstdlib>

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

std::uint64_t ResidentBytes() {
  const int file = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  char text[128];
  const ssize_t size = ::read(file, text, sizeof text - 1);
  ::close(file);
  if (size <= 0) return 0;
  text[size] = 0;
  char* end = nullptr;
  std::strtoull(text, &end, 10);  // Pages: all, then the resident ones.
  return std::strtoull(end, nullptr, 10) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace partiemc::server
