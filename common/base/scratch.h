// Memory for what lives no longer than one step of an estimator: containers take it from a block of
// the thread and give it back all at once, when the step ends. In a steady state nothing of them is
// on the heap.
//
//   void step() {
//     const ScratchScope scope;       // what is taken from here on is free again at its end
//     ScratchVector<double> shares;   // must not outlive the scope
//   }
//
// A container grows in the scope that it was made in, not in one within. Without a scope, or where
// the block is full, the heap serves; so it does under AddressSanitizer, which sees what outlives.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <new>
#include <utility>
#include <vector>

namespace perdure {

/// The block of the present thread. Scopes nest: the inner one ends first.
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

/// Aligned for every scalar and for vectors of 32 bytes.
void* take(std::size_t bytes);
/// Frees what came from the heap; the rest waits for the end of its scope.
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
