// Gives ids to new tracks.
#pragma once

#include <algorithm>
#include <map>
#include <utility>

#include "common/types/objects.h"

namespace perdure::semantic_filter {

/// The same box of the same frame always gets the same id. So a step that is repeated after a late
/// detection does not rename tracks, and no id is used twice.
class IdBook {
 public:
  ObjectId idFor(std::uint64_t frame_sequence, std::size_t box);
  ObjectId next() const { return next_; }
  void atLeast(ObjectId next) { next_ = std::max(next_, next); }
  /// Forgets the frames before this one. They cannot be stepped again.
  void forgetBefore(std::uint64_t frame_sequence);

 private:
  ObjectId next_ = 1;
  std::map<std::pair<std::uint64_t, std::size_t>, ObjectId> given_;
};

}  // namespace perdure::semantic_filter
