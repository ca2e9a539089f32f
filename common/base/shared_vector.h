// A vector whose copies share their elements until one of them is written to (copy on write): what
// is kept of every frame costs what the frame changed. To ask for an element of one that is not
// const is to write; read() is for those who only look.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

namespace perdure {

/// Copies may not be written to from several threads at once.
template <class T>
class SharedVector {
 public:
  using value_type = T;
  using Vector = std::vector<T>;
  using iterator = typename Vector::iterator;
  using const_iterator = typename Vector::const_iterator;

  SharedVector() = default;
  SharedVector(std::initializer_list<T> items) : items_(std::make_shared<Vector>(items)) {}
  SharedVector(Vector items)  // NOLINT(google-explicit-constructor)
      : items_(std::make_shared<Vector>(std::move(items))) {}

  const Vector& read() const {
    static const Vector kEmpty;
    return items_ ? *items_ : kEmpty;
  }
  /// Its own from now on. References to elements are void once a copy was made.
  Vector& write() {
    if (!items_) {
      items_ = std::make_shared<Vector>();
    } else if (items_.use_count() > 1) {
      items_ = std::make_shared<Vector>(*items_);
    }
    return *items_;
  }

  std::size_t size() const { return read().size(); }
  bool empty() const { return read().empty(); }
  const_iterator begin() const { return read().begin(); }
  const_iterator end() const { return read().end(); }
  const T& operator[](std::size_t i) const { return read()[i]; }
  const T& front() const { return read().front(); }
  const T& back() const { return read().back(); }

  iterator begin() { return write().begin(); }
  iterator end() { return write().end(); }
  T& operator[](std::size_t i) { return write()[i]; }
  T& front() { return write().front(); }
  T& back() { return write().back(); }
  void push_back(T item) { write().push_back(std::move(item)); }
  void assign(std::size_t count, const T& item) { write().assign(count, item); }
  void resize(std::size_t size) { write().resize(size); }
  void clear() { items_.reset(); }

 private:
  std::shared_ptr<Vector> items_;
};

}  // namespace perdure
