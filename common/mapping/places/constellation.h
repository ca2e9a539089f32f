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
#include "common/mapping/places/placed_object.h"

namespace perdure::mapping {

/// What is seen, and where it may be.
struct PlaceQuery {
  std::vector<PlacedObject> seen;       ///< in the body's level frame B
  std::vector<PlacedObject> map;        ///< in M, around where the body may be
  std::vector<Eigen::Vector2d> driven;  ///< places in M from which the map's objects were seen
  LevelGaussian prior;                  ///< T_MB by odometry and graph
};

/// A way to lay what is seen onto the map.
struct PlaceMatch {
  LevelGaussian T_MB;  ///< without the prior's information
  double score = 0.0;  ///< nats: log-likelihood ratio against chance, and log of the prior's
                       ///< density ratio to its peak
  double next = 0.0;   ///< score of the best other way, or of nothing being on the map
  double cells = 1.0;  ///< distinguishable ways inside the prior
  /// Of map and of what is seen, surely one object.
  std::vector<std::pair<ObjectId, ObjectId>> pairs;
};

/// Returns the best way, whether good enough or not; nothing if no object is surely one of the
/// map's.
std::optional<PlaceMatch> bestMatch(PlaceQuery query, const PlaceParameters& parameters);

}  // namespace perdure::mapping
