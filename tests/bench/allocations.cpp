#include "tests/bench/allocations.h"

#include <link.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <new>

namespace perdure::tests {
namespace {

std::atomic<std::uint64_t> g_own{0}, g_opencv{0};

}  // namespace

Allocations allocations() { return {g_own.load(), g_opencv.load()}; }

Allocations allocationsSince(const Allocations& before) {
  const Allocations now = allocations();
  return {now.own - before.own, now.opencv - before.opencv};
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

bool allocationsAreCounted() { return false; }

}  // namespace perdure::tests

#else

bool allocationsAreCounted() { return true; }

namespace {

struct Range {
  std::uintptr_t begin = 0, end = 0;
};
std::array<Range, 64> g_opencv_code;  // ends at the first empty range; empty before main

/// Stores the executable segments of libopencv_*.so.
int noteLibrary(dl_phdr_info* info, std::size_t /*size*/, void* next) {
  auto& at = *static_cast<std::size_t*>(next);
  if (std::strstr(info->dlpi_name, "libopencv") == nullptr) return 0;
  for (int i = 0; i < info->dlpi_phnum && at < g_opencv_code.size(); ++i) {
    const auto& segment = info->dlpi_phdr[i];
    if (segment.p_type != PT_LOAD || (segment.p_flags & PF_X) == 0) continue;
    const std::uintptr_t begin = info->dlpi_addr + segment.p_vaddr;
    g_opencv_code[at++] = {begin, begin + segment.p_memsz};
  }
  return 0;
}

[[maybe_unused]] const bool g_noted = [] {
  std::size_t next = 0;
  dl_iterate_phdr(noteLibrary, &next);
  return true;
}();

void count(const void* caller) {
  const auto at = reinterpret_cast<std::uintptr_t>(caller);
  for (const Range& range : g_opencv_code) {
    if (range.end == 0) break;
    if (at >= range.begin && at < range.end) {
      g_opencv.fetch_add(1, std::memory_order_relaxed);
      return;
    }
  }
  g_own.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace
}  // namespace perdure::tests

// glibc lets a program replace these functions. Its own versions remain under the names below.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t n, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);

void* malloc(std::size_t size) {
  perdure::tests::count(__builtin_return_address(0));
  return __libc_malloc(size);
}

void* calloc(std::size_t n, std::size_t size) {
  perdure::tests::count(__builtin_return_address(0));
  return __libc_calloc(n, size);
}

void* realloc(void* old, std::size_t size) {
  perdure::tests::count(__builtin_return_address(0));
  return __libc_realloc(old, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  perdure::tests::count(__builtin_return_address(0));
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  perdure::tests::count(__builtin_return_address(0));
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  perdure::tests::count(__builtin_return_address(0));
  void* const result = __libc_memalign(alignment, size);
  if (result == nullptr) return ENOMEM;
  *memory = result;
  return 0;
}

void free(void* memory) { __libc_free(memory); }
}

namespace {

void* orThrow(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

// Replaces operator new, so that the counted caller is the requester and not the standard library.
// The nothrow forms call these.
void* operator new(std::size_t size) {
  perdure::tests::count(__builtin_return_address(0));
  return orThrow(__libc_malloc(size));
}
void* operator new[](std::size_t size) {
  perdure::tests::count(__builtin_return_address(0));
  return orThrow(__libc_malloc(size));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  perdure::tests::count(__builtin_return_address(0));
  return orThrow(__libc_memalign(static_cast<std::size_t>(alignment), size));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  perdure::tests::count(__builtin_return_address(0));
  return orThrow(__libc_memalign(static_cast<std::size_t>(alignment), size));
}
void operator delete(void* memory) noexcept { __libc_free(memory); }
void operator delete[](void* memory) noexcept { __libc_free(memory); }
void operator delete(void* memory, std::size_t) noexcept { __libc_free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { __libc_free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { __libc_free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { __libc_free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { __libc_free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  __libc_free(memory);
}

#endif
