// The belief of the filter as one plain value: all tracks and the learned parameters.
// Derivation: tools/docs/maths/state_and_mixture.md.
#pragma once

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "common/types/objects.h"
#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/belief/learned.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// Learned parameters of networks, ground and classes. They are kept when a new `world` begins.
struct Learned {
  SideVariances sides;
  NoiseScales azimuths{200.0};  ///< scales of the variances of azimuths
  GroundRoughness roughness_scale = {};
  MoverShares movers = {};
  BoxExtents extents = {};
  DetectionSizes sizes = {};
};

struct Belief {
  std::vector<Track> tracks;            ///< ordered by id
  std::vector<Track> recently_deleted;  ///< kept for re-identification (core/tracks/reidentify.h)
  /// Tracks of the map that were fused, each with the track of the same object that remained. They
  /// are not fused a second time.
  std::map<TrackId, TrackId> fused = {};
  Learned learned = {};
  BodyPath path = {};  ///< recent positions of the body
};

/// Gives ids to new tracks. A box of a frame always gets the same id, so a repeated step does not
/// rename tracks.
class IdBook {
 public:
  ObjectId idFor(std::uint64_t frame_sequence, std::size_t box) {
    const auto [it, fresh] = given_.try_emplace({frame_sequence, box}, next_);
    if (fresh) ++next_;
    return it->second;
  }
  ObjectId next() const { return next_; }
  void atLeast(ObjectId next) { next_ = std::max(next_, next); }
  /// Forgets the frames before this one. They cannot be stepped again.
  void forgetBefore(std::uint64_t frame_sequence) {
    given_.erase(given_.begin(), given_.lower_bound({frame_sequence, 0}));
  }

 private:
  ObjectId next_ = 1;
  std::map<std::pair<std::uint64_t, std::size_t>, ObjectId> given_;
};

}  // namespace perdure::semantic_filter
