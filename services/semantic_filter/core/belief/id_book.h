// Which ids are given to new tracks.
#pragma once

#include <algorithm>
#include <map>
#include <utility>

#include "common/types/objects.h"

namespace perdure::semantic_filter {

/// Gives ids to initiateTracks. The same box of the same frame always gets the same id, so that
/// stepping again after a late detection does not rename tracks, and no id is ever used twice.
class IdBook {
 public:
  ObjectId idFor(std::uint64_t frame_sequence, std::size_t box);
  ObjectId next() const { return next_; }
  void atLeast(ObjectId next) { next_ = std::max(next_, next); }
  /// Forgets frames before this one; they cannot be stepped again.
  void forgetBefore(std::uint64_t frame_sequence);

 private:
  ObjectId next_ = 1;
  std::map<std::pair<std::uint64_t, std::size_t>, ObjectId> given_;
};

}  // namespace perdure::semantic_filter
