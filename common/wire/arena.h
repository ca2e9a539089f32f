// Memory for the sequences of one outgoing message, reused from message to message.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace perdure::wire {

class Arena {
 public:
  /// Zeroed memory for `count` elements of a C type, valid until clear().
  template <class T>
  T* allocate(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    return static_cast<T*>(allocateBytes(count * sizeof(T)));
  }
  void clear();

 private:
  struct Block {
    std::unique_ptr<std::byte[]> bytes;
    std::size_t size = 0;
  };
  void* allocateBytes(std::size_t size);

  std::vector<Block> blocks_;
  std::size_t block_ = 0, used_ = 0;
};

}  // namespace perdure::wire
