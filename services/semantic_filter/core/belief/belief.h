// All that the filter believes, as one plain value.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/belief/noise_scale.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// What is true of the networks and of the streets, whatever the world: it outlives a world.
struct Learned {
  NoiseScales sides{4000.0};    ///< of boxes
  NoiseScales azimuths{200.0};  ///< each of another thing
  GroundRoughness roughness_scale = {};
};

struct Belief {
  std::vector<Track> tracks;  ///< in order of id
  std::vector<Track>
      recently_deleted;  ///< given up lately, for when they are found again (core/moved.h)
  Learned learned = {};
  BodyPath path = {};  ///< of the body
};

}  // namespace perdure::semantic_filter
