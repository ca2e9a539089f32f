// The cuboid of an object in W: its corners, edges and label, as drawn in all pictures of live
// scenes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/math/rigid_transform.h"
#include "common/types/objects.h"

namespace perdure {

struct Cuboid {
  RigidTransform T_WO;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< length, width, height, m
};
/// The cuboid of the most probable class. `up_W` points against gravity; it is the axis of the yaw.
Cuboid cuboidOf(const ObjectBelief& object, const Eigen::Vector3d& up_W);

/// Corners in W. Bit 0 of the index: front; bit 1: left; bit 2: top.
std::array<Eigen::Vector3d, 8> cornersOf(const Cuboid& cuboid);
/// Pairs of corners, one pair per edge.
inline constexpr std::array<std::array<int, 2>, 12> kEdges{{{0, 1},
                                                            {2, 3},
                                                            {4, 5},
                                                            {6, 7},
                                                            {0, 2},
                                                            {1, 3},
                                                            {4, 6},
                                                            {5, 7},
                                                            {0, 4},
                                                            {1, 5},
                                                            {2, 6},
                                                            {3, 7}}};

/// The ends of the strokes, two per stroke. The strokes are the edges and a line from the middle of
/// the floor to the lower edge of the front, which shows the heading. If `dashed`, these lines are
/// divided into short strokes with gaps.
std::vector<Eigen::Vector3d> strokesOf(const Cuboid& cuboid, bool dashed);

/// Returns true if an object on the map occludes the object now.
inline bool isHidden(const ObjectBelief& object) {
  return object.visibility == Visibility::kOccluded;
}
inline bool isInSight(const ObjectBelief& object) {
  return object.visibility == Visibility::kVisible || object.visibility == Visibility::kPartial;
}
/// The label of the object, for example "car 76".
std::string nameOf(const ObjectBelief& object);

}  // namespace perdure
