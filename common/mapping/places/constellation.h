// Place recognition by constellations: where the body is in the map, from how the objects around it
// lie to each other. Gravity is known, so position and yaw are sought. Pairs of objects propose
// ways to lay what is seen onto the map, and single ones where the yaw is known. The likelihood of
// all that is seen decides, together with what the odometry knows before. Derivation:
// tools/docs/maths/constellation.md.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/ids.h"
#include "common/mapping/frames/level_pose.h"
#include "common/mapping/parameters.h"

namespace perdure::mapping {

/// Probability of a class, by a number that the caller gives to its name.
struct ClassShare {
  std::uint32_t name = 0;
  double probability = 0.0;
};

/// An object at rest in some level frame.
struct PlacedObject {
  ObjectId id = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();               ///< centre, m
  double yaw = 0.0;                                          ///< rad, known modulo 180°
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();  ///< of [p, yaw], m and rad
  std::vector<ClassShare> pmf;
};
/// The object of frame B in frame A. The transform's own error is not added.
PlacedObject transformed(const LevelPose& T_AB, PlacedObject object);

/// Normal equations of T_MB from objects of known identity.
struct MatchEquations {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d pull = Eigen::Vector4d::Zero();
  double chi2 = 0.0, weights = 0.0;

  /// `seen` in B, `known` in M; x: T_MB at which it is linear. `blur` (m) is added to the
  /// deviation of the place.
  void add(const PlacedObject& seen, const PlacedObject& known, const LevelPose& x,
           double weight = 1.0, double blur = 0.0);
  Eigen::Vector4d step() const;
  /// Is widened where errors are larger than assumed.
  Eigen::Matrix4d covariance() const;
};

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
