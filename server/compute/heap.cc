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
  // glibc takes blocks below this size from the heap. It maps and unmaps larger blocks each time,
  // which is slow. This is the largest value that glibc accepts.
  constexpr int kMappedBytes = 32 << 20;
  // Bytes at the end of the heap that may stay free before glibc returns them to the system. They
  // suffice for some frames of a million particles.
  constexpr int kTopBytes = 64 << 20;
  mallopt(M_MMAP_THRESHOLD, kMappedBytes);
  mallopt(M_TRIM_THRESHOLD, kTopBytes);
  // All threads share one malloc arena, so that another thread can reuse memory that one thread has
  // freed. Threads rarely contend for the arena: a worker with warm buffers allocates little, and
  // glibc caches small blocks for each thread.
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
  std::strtoull(text, &end, 10);  // The first number counts all pages, the second resident ones.
  return std::strtoull(end, nullptr, 10) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace partiemc::server
