// Memory for the sequences of one outgoing message, reused for the next message.
#pragma once

#include <cstddef>
#include <cstring>
#include <memory_resource>

namespace perdure::wire {

class Arena {
 public:
  /// Returns zeroed memory for `count` elements of a C type. It is valid until clear().
  template <class T>
  T* allocate(std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    void* const place = memory_.allocate(count * sizeof(T), alignof(std::max_align_t));
    std::memset(place, 0, count * sizeof(T));
    return static_cast<T*>(place);
  }
  void clear() { memory_.release(); }

 private:
  std::pmr::unsynchronized_pool_resource blocks_;  ///< reuses released blocks
  std::pmr::monotonic_buffer_resource memory_{64 << 10, &blocks_};
};

}  // namespace perdure::wire
