#include "common/base/scratch.h"

#include <cstdint>
#include <memory>

namespace perdure {
namespace {

constexpr std::size_t kAlignment = 32, kBytes = std::size_t{8} << 20;

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kHeapOnly = true;
#elif defined(__clang__)
constexpr bool kHeapOnly = __has_feature(address_sanitizer);
#else
constexpr bool kHeapOnly = false;
#endif

struct Free {
  void operator()(std::byte* memory) const {
    ::operator delete (memory, std::align_val_t{kAlignment});
  }
};

/// The memory of a thread's scopes. The system provides its pages only when they are first used.
struct Block {
  std::unique_ptr<std::byte, Free> memory;
  std::size_t used = 0;
  int scopes = 0;

  bool holds(const void* p) const {
    const auto at = reinterpret_cast<std::uintptr_t>(p);
    const auto first = reinterpret_cast<std::uintptr_t>(memory.get());
    return memory && at >= first && at < first + kBytes;
  }
};

std::byte* fromHeap(std::size_t bytes) {
  return static_cast<std::byte*>(::operator new (bytes, std::align_val_t{kAlignment}));
}

thread_local Block t_block;

}  // namespace

ScratchScope::ScratchScope() : mark_(t_block.used) {
  if (!t_block.memory) t_block.memory.reset(fromHeap(kBytes));
  ++t_block.scopes;
}

ScratchScope::~ScratchScope() {
  --t_block.scopes;
  t_block.used = mark_;
}

void* scratch::take(std::size_t bytes) {
  Block& block = t_block;
  const std::size_t size = (bytes + kAlignment - 1) / kAlignment * kAlignment;
  if (kHeapOnly || block.scopes == 0 || size > kBytes - block.used) return fromHeap(bytes);
  void* const memory = block.memory.get() + block.used;
  block.used += size;
  return memory;
}

void scratch::giveBack(void* memory) {
  if (!t_block.holds(memory)) Free{}(static_cast<std::byte*>(memory));
}

}  // namespace perdure
