// An object's cuboid in W: its corners, its edges, and how it is labelled, as all pictures of live
// scenes have it.
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
/// Of the most probable class. `up_W`: against gravity; the yaw is about it.
Cuboid cuboidOf(const ObjectBelief& object, const Eigen::Vector3d& up_W);

/// In W; bit 0: front, bit 1: left, bit 2: top.
std::array<Eigen::Vector3d, 8> cornersOf(const Cuboid& cuboid);
/// Pairs of corners; the thirteenth marks the front: across its lower half.
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

/// Ends of strokes, two and two: the edges, and one from the middle of the floor to the front's
/// lower edge, which says where it faces. Dashed: short ones with gaps between.
std::vector<Eigen::Vector3d> strokesOf(const Cuboid& cuboid, bool dashed);

/// Something on the map hides it now.
inline bool isHidden(const ObjectBelief& object) {
  return object.visibility == Visibility::kOccluded;
}
inline bool isInSight(const ObjectBelief& object) {
  return object.visibility == Visibility::kVisible || object.visibility == Visibility::kPartial;
}
/// "car 76"
std::string nameOf(const ObjectBelief& object);

}  // namespace perdure
