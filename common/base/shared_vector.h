// A vector whose copies share their elements until one copy is modified (copy on write). If such
// vectors are stored for every frame, only the modified ones need memory. Access through a
// non-const vector counts as modification; use read() for reading. Later vectors of the same thread
// reuse the memory of released elements.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

namespace perdure {

/// Copies that share elements must not be modified by several threads at the same time.
template <class T>
class SharedVector {
 public:
  using value_type = T;
  using Vector = std::vector<T>;
  using iterator = typename Vector::iterator;
  using const_iterator = typename Vector::const_iterator;

  SharedVector() = default;
  SharedVector(std::initializer_list<T> items) : SharedVector(Vector(items)) {}
  SharedVector(Vector items)  // NOLINT(google-explicit-constructor)
      : block_(takeBlock()) {
    block_->items = std::move(items);
  }
  SharedVector(const SharedVector& other) : block_(other.block_) {
    if (block_) block_->owners.fetch_add(1, std::memory_order_relaxed);
  }
  SharedVector(SharedVector&& other) noexcept : block_(std::exchange(other.block_, nullptr)) {}
  SharedVector& operator=(SharedVector other) noexcept {
    std::swap(block_, other.block_);
    return *this;
  }
  ~SharedVector() { leave(); }

  const Vector& read() const {
    static const Vector kEmpty;
    return block_ ? block_->items : kEmpty;
  }
  /// Returns the elements for modification. If they are shared, they are copied first, which
  /// invalidates references to elements. `room` is the capacity of a new or copied vector.
  Vector& write(std::size_t room = 0) {
    if (!block_) {
      block_ = takeBlock();
      block_->items.reserve(room);
    } else if (block_->owners.load(std::memory_order_acquire) > 1) {
      Block* own = takeBlock();
      // Reserves room to grow. Blocks are reused, so they soon have enough capacity.
      own->items.reserve(std::max(room, std::bit_ceil(block_->items.size() + 1)));
      own->items = block_->items;
      leave();
      block_ = own;
    }
    return block_->items;
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
  void clear() { leave(); }

 private:
  struct Block {
    std::atomic<std::size_t> owners{1};
    Vector items;
  };
  using Spare = std::vector<std::unique_ptr<Block>>;
  static constexpr std::size_t kMostSpare = 512;

  /// Returns the spare blocks of the thread; null if they are already destroyed at the end of the
  /// thread.
  static Spare* spare() {
    struct Kept {
      Spare blocks;
      bool* gone;
      ~Kept() { *gone = true; }
    };
    thread_local bool gone = false;
    if (gone) return nullptr;
    thread_local Kept kept{{}, &gone};
    return &kept.blocks;
  }

  static Block* takeBlock() {
    Spare* const blocks = spare();
    if (!blocks || blocks->empty()) return new Block;
    Block* block = blocks->back().release();
    blocks->pop_back();
    block->owners.store(1, std::memory_order_relaxed);
    return block;
  }

  void leave() {
    Block* const block = std::exchange(block_, nullptr);
    if (!block || block->owners.fetch_sub(1, std::memory_order_acq_rel) > 1) return;
    std::unique_ptr<Block> mine(block);
    mine->items.clear();
    Spare* const blocks = spare();
    if (blocks && blocks->size() < kMostSpare) blocks->push_back(std::move(mine));
  }

  Block* block_ = nullptr;
};

}  // namespace perdure
