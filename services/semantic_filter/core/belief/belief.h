// Everything that the filter believes, as one plain value: all tracks and what was learned.
// Derivation: tools/docs/maths/state_and_mixture.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/belief/noise_scale.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// What was learned about networks and streets. It survives a change of the world.
struct Learned {
  NoiseScales sides{4000.0};    ///< scales of the variances of box sides
  NoiseScales azimuths{200.0};  ///< scales of the variances of azimuths
  GroundRoughness roughness_scale = {};
};

struct Belief {
  std::vector<Track> tracks;            ///< ordered by id
  std::vector<Track> recently_deleted;  ///< kept for re-identification (core/tracks/reidentify.h)
  Learned learned = {};
  BodyPath path = {};  ///< recent positions of the body
};

}  // namespace perdure::semantic_filter
