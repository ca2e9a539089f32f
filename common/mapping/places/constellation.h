// Place recognition by constellations: estimates the pose of the body in the map from the
// arrangement of the objects around it. Gravity is known, so only position and yaw are estimated.
// Pairs of objects propose poses; single objects do so if the yaw is known. The likelihood of all
// observed objects and the prior by odometry select the pose. Derivation:
// tools/docs/maths/constellation.md.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "common/mapping/parameters.h"
#include "common/mapping/places/map_index.h"
#include "common/mapping/places/placed_object.h"

namespace perdure::mapping {

/// A candidate pose of the body on the map.
struct PlaceMatch {
  LevelGaussian T_MB;  ///< estimate without the prior's information
  double score = 0.0;  ///< log-likelihood ratio against chance plus log of the prior, nats
  double next = 0.0;   ///< score of the second best pose, or of the hypothesis that no observed
                       ///< object is on the map, whichever is larger
  double cells = 1.0;  ///< number of distinguishable poses inside the prior
  /// Ids of map objects, each with the id of the observed object that is certainly the same.
  std::vector<std::pair<ObjectId, ObjectId>> pairs;
  std::size_t points = 0;  ///< number of landmarks that match and agree, if landmarks were used
};

/// Returns the best pose, even if its score is low; nothing if no observed object certainly matches
/// one of the map. `seen` is in the body's level frame B. `prior` is that of T_MB; if the body may
/// be anywhere, it is as wide as the map.
std::optional<PlaceMatch> bestMatch(std::vector<PlacedObject> seen, const MapIndex& map,
                                    const LevelGaussian& prior, const PlaceParameters& parameters);

}  // namespace perdure::mapping
