#include "common/wire/arena.h"

#include <algorithm>
#include <cstring>

namespace perdure::wire {

void* Arena::allocateBytes(std::size_t size) {
  constexpr std::size_t kAlignment = alignof(std::max_align_t);
  constexpr std::size_t kSmallestBlock = 64 << 10;
  size = (size + kAlignment - 1) / kAlignment * kAlignment;
  while (block_ < blocks_.size() && used_ + size > blocks_[block_].size) {
    ++block_;
    used_ = 0;
  }
  if (block_ == blocks_.size()) {
    const std::size_t room = std::max(size, kSmallestBlock);
    blocks_.push_back({std::make_unique<std::byte[]>(room), room});
  }
  std::byte* place = blocks_[block_].bytes.get() + used_;
  used_ += size;
  std::memset(place, 0, size);
  return place;
}

void Arena::clear() {
  block_ = 0;
  used_ = 0;
}

}  // namespace perdure::wire
