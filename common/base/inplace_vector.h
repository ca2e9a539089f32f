// A vector of at most N default-constructible elements, stored inside the object without heap
// memory. It implements a part of C++26's std::inplace_vector.
#pragma once

#include <array>
#include <cstddef>

#include "common/base/check.h"

namespace perdure {

template <class T, std::size_t N>
class InplaceVector {
 public:
  using value_type = T;

  InplaceVector() = default;

  /// Appends a copy of `value`. Aborts if the vector already has N elements.
  void push_back(const T& value) {
    check(size_ < N, "an InplaceVector holds no more than its capacity");
    items_[size_++] = value;
  }
  void resize(std::size_t size) {
    check(size <= N, "an InplaceVector holds no more than its capacity");
    size_ = size;
  }
  void clear() { size_ = 0; }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T& operator[](std::size_t i) { return items_[i]; }
  const T& operator[](std::size_t i) const { return items_[i]; }
  T* begin() { return items_.data(); }
  T* end() { return items_.data() + size_; }
  const T* begin() const { return items_.data(); }
  const T* end() const { return items_.data() + size_; }

 private:
  std::array<T, N> items_;
  std::size_t size_ = 0;
};

}  // namespace perdure
