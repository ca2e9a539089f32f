#include "common/base/algorithms/stable_sort.h"

#include <algorithm>
#include <numeric>

namespace perdure {
namespace {

template <class Key>
ScratchVector<std::size_t> orderBy(const ScratchVector<Key>& keys) {
  ScratchVector<std::size_t> order(keys.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return keys[a] != keys[b] ? keys[a] < keys[b] : a < b;
  });
  return order;
}

}  // namespace

ScratchVector<std::size_t> stableOrder(const ScratchVector<double>& keys) { return orderBy(keys); }

ScratchVector<std::size_t> stableOrder(const ScratchVector<std::uint64_t>& keys) {
  return orderBy(keys);
}

}  // namespace perdure
