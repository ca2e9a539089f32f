// Stable sorting by a key that moves each element once. It replaces std::stable_sort, which takes
// long to compile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/base/scratch.h"

namespace perdure {

/// Returns the indices of `keys` in order of increasing key. Equal keys keep their order.
ScratchVector<std::size_t> stableOrder(const ScratchVector<double>& keys);
ScratchVector<std::size_t> stableOrder(const ScratchVector<std::uint64_t>& keys);

/// Sorts `elements` by increasing key. `keyOf` returns the key of an element, a double or a
/// std::uint64_t.
template <class T, class Allocator, class KeyOf>
void stableSortBy(std::vector<T, Allocator>& elements, const KeyOf& keyOf) {
  ScratchVector<decltype(keyOf(std::as_const(elements).front()))> keys;
  keys.reserve(elements.size());
  for (const T& element : elements) keys.push_back(keyOf(element));
  ScratchVector<std::size_t> from = stableOrder(keys);
  // Moves the elements of each cycle of the permutation.
  for (std::size_t first = 0; first < from.size(); ++first) {
    if (from[first] == first) continue;
    T waiting = std::move(elements[first]);
    std::size_t to = first;
    for (std::size_t next = from[to]; next != first; next = from[to]) {
      elements[to] = std::move(elements[next]);
      from[to] = to;
      to = next;
    }
    elements[to] = std::move(waiting);
    from[to] = to;
  }
}

}  // namespace perdure
