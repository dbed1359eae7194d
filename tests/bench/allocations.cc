#include "bench/allocations.h"

#include <link.h>
#include <malloc.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <new>

// glibc's names for the functions that this file replaces. Its free serves both.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace partiemc::bench {
namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> calls{0}, bytes{0}, tbb_calls{0};

// Where the code of oneTBB's library lies. Looked up before counting starts.
std::uintptr_t tbb_begin = 0, tbb_end = 0;

int FindTbb(dl_phdr_info* library, std::size_t, void*) {
  if (std::strstr(library->dlpi_name, "libtbb.so") == nullptr) return 0;
  for (int k = 0; k < library->dlpi_phnum; ++k) {
    const auto& segment = library->dlpi_phdr[k];
    if (segment.p_type != PT_LOAD || (segment.p_flags & PF_X) == 0) continue;
    tbb_begin = library->dlpi_addr + segment.p_vaddr;
    tbb_end = tbb_begin + segment.p_memsz;
  }
  return 1;
}

void Count(const void* caller, std::size_t size) {
  if (!counting.load(std::memory_order_relaxed)) return;
  const auto address = reinterpret_cast<std::uintptr_t>(caller);
  if (address >= tbb_begin && address < tbb_end) {
    tbb_calls.fetch_add(1, std::memory_order_relaxed);
  } else {
    calls.fetch_add(1, std::memory_order_relaxed);
    bytes.fetch_add(size, std::memory_order_relaxed);
  }
}

}  // namespace

void StartCountingAllocations() {
  dl_iterate_phdr(FindTbb, nullptr);
  calls = bytes = tbb_calls = 0;
  counting = true;
}

Allocations StopCountingAllocations() {
  counting = false;
  return {calls, bytes, tbb_calls};
}

}  // namespace partiemc::bench

using partiemc::bench::Count;

extern "C" {

void* malloc(std::size_t size) {
  Count(__builtin_return_address(0), size);
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  Count(__builtin_return_address(0), count * size);
  return __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) {
  Count(__builtin_return_address(0), size);
  return __libc_realloc(memory, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  Count(__builtin_return_address(0), size);
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  Count(__builtin_return_address(0), size);
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  Count(__builtin_return_address(0), size);
  void* const allocated = __libc_memalign(alignment, size);
  if (allocated == nullptr) return ENOMEM;
  *memory = allocated;
  return 0;
}

}  // extern "C"

// The library's own would call malloc from inside of it, and hide who asked.
void* operator new(std::size_t size) {
  Count(__builtin_return_address(0), size);
  if (void* const memory = __libc_malloc(size)) return memory;
  throw std::bad_alloc();
}

void* operator new(std::size_t size, std::align_val_t alignment) {
  Count(__builtin_return_address(0), size);
  if (void* const memory = __libc_memalign(static_cast<std::size_t>(alignment), size)) {
    return memory;
  }
  throw std::bad_alloc();
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
