// Memory for data that an estimator needs within one step only. Containers take memory from a block
// that belongs to the thread and is freed as a whole at the end of the step. After the first step,
// the heap is not used.
//
//   void step() {
//     const ScratchScope scope;       // frees all memory taken from here on at its end
//     ScratchVector<double> shares;   // must not outlive the scope
//   }
//
// A container may grow only in the scope in which it was created, not in a nested scope. Without a
// scope, or if the block is full, the heap is used. The heap is also used under AddressSanitizer,
// which detects containers that outlive their scope.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <utility>
#include <vector>

namespace perdure {

/// Uses the block of the current thread. Scopes nest: the inner one ends first.
class ScratchScope {
 public:
  ScratchScope();
  ~ScratchScope();
  ScratchScope(const ScratchScope&) = delete;
  ScratchScope& operator=(const ScratchScope&) = delete;

 private:
  std::size_t mark_;
};

namespace scratch {

/// Returns memory that is aligned for every scalar and for vectors of 32 bytes.
void* take(std::size_t bytes);
/// Frees memory taken from the heap. Other memory is freed at the end of its scope.
void giveBack(void* memory);

}  // namespace scratch

template <class T>
struct ScratchAllocator {
  using value_type = T;
  static_assert(alignof(T) <= 32);

  ScratchAllocator() = default;
  template <class U>
  ScratchAllocator(const ScratchAllocator<U>&) {}  // NOLINT(google-explicit-constructor)

  T* allocate(std::size_t n) { return static_cast<T*>(scratch::take(n * sizeof(T))); }
  void deallocate(T* memory, std::size_t /*n*/) { scratch::giveBack(memory); }

  friend bool operator==(const ScratchAllocator&, const ScratchAllocator&) { return true; }
};

template <class T>
using ScratchVector = std::vector<T, ScratchAllocator<T>>;
template <class Key, class Value>
using ScratchMap =
    std::map<Key, Value, std::less<Key>, ScratchAllocator<std::pair<const Key, Value>>>;

}  // namespace perdure
