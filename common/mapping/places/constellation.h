// Place recognition by constellations: where the body is in the map, from how the objects around it
// lie to each other. Gravity is known, so position and yaw are sought. Pairs of objects propose
// ways to lay what is seen onto the map, and single ones where the yaw is known. The likelihood of
// all that is seen decides, together with what the odometry knows before. Derivation:
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

/// A way to lay what is seen onto the map.
struct PlaceMatch {
  LevelGaussian T_MB;  ///< without the prior's information
  double score = 0.0;  ///< nats: log-likelihood ratio against chance, and log of the prior's
                       ///< density ratio to its peak
  double next = 0.0;   ///< score of the best other way, or of nothing being on the map
  double cells = 1.0;  ///< distinguishable ways inside the prior
  /// Of map and of what is seen, surely one object.
  std::vector<std::pair<ObjectId, ObjectId>> pairs;
  std::size_t points = 0;  ///< landmarks that look alike and agree, where these say it
};

/// Returns the best way, whether good enough or not; nothing if no object is surely one of the
/// map's. `seen` in the body's level frame B; `prior`: T_MB as it is known before. Where nothing is
/// known it is as wide as the map.
std::optional<PlaceMatch> bestMatch(std::vector<PlacedObject> seen, const MapIndex& map,
                                    const LevelGaussian& prior, const PlaceParameters& parameters);

}  // namespace perdure::mapping
