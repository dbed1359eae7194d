#include "server/compute/heap.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>

extern "C" {

// A function of jemalloc; null in programs that do not link it.
[[gnu::weak]] int mallctl(const char* name, void* old_value, std::size_t* old_size, void* new_value,
                          std::size_t new_size);

// jemalloc's options. The environment variable MALLOC_CONF overrides them.
// - Two arenas only, so that threads reuse memory that other threads have freed.
// - A stream allocates and frees the bytes of its frames all the time, so freed pages stay for two
//   seconds. Then a thread of jemalloc returns them. With glibc, returning the memory of a large
//   frame stopped all threads for up to 15 ms.
// - Small blocks may use any free extent, and large blocks have no separate arena. With jemalloc's
//   defaults, frames of a million particles caused six times the page faults, 6 % of the processor
//   time.
// - Each thread caches only free blocks of up to 4 KiB, which bounds the memory of gRPC's threads
//   in a flood of calls.
[[gnu::visibility("default")]] extern const char* malloc_conf;
const char* malloc_conf =
    "narenas:2,dirty_decay_ms:2000,muzzy_decay_ms:0,background_thread:true,"
    "lg_extent_max_active_fit:20,oversize_threshold:0,tcache_max:4096";

}  // extern "C"

namespace partiemc::server {

void GiveBackFreedMemory() {
  // 4096 stands for all arenas (MALLCTL_ARENAS_ALL).
  if (mallctl != nullptr) mallctl("arena.4096.purge", nullptr, nullptr, nullptr, 0);
}

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
