#include "services/semantic_filter/core/belief/belief.h"

namespace perdure::semantic_filter {

ObjectId IdBook::idFor(std::uint64_t frame_sequence, std::size_t box) {
  const auto [it, fresh] = given_.try_emplace({frame_sequence, box}, next_);
  if (fresh) ++next_;
  return it->second;
}

void IdBook::forgetBefore(std::uint64_t frame_sequence) {
  given_.erase(given_.begin(), given_.lower_bound({frame_sequence, 0}));
}

}  // namespace perdure::semantic_filter
