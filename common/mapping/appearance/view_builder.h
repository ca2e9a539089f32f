// Collects recent landmarks, for the view of each anchor and for the present view.
#pragma once

#include <cstdint>
#include <map>

#include "common/mapping/appearance/view.h"
#include "common/math/rigid_transform.h"
#include "common/types/odometry.h"

namespace perdure::mapping {

class ViewBuilder {
 public:
  /// Adds landmarks of the current session at the distance travelled `way_m`. Landmarks without a
  /// descriptor, or with an error above a tenth of their distance, are left out.
  void add(const Landmarks& landmarks, const Eigen::Vector3d& p_WB, double way_m);
  /// The landmarks observed on the last `back_m` of the trajectory, in an anchor's axes. At most
  /// kMostPoints, those with the smallest errors.
  View viewFrom(const RigidTransform& T_WA, double way_m, double back_m) const;
  std::size_t size() const { return seen_.size(); }
  /// Call it at the start of another session.
  void clear() { seen_.clear(); }

 private:
  struct Seen {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
    double sigma = 0.0;     ///< m
    double relative = 0.0;  ///< sigma as a fraction of the distance
    double way_m = 0.0;     ///< distance travelled at the last observation
    Descriptor descriptor{};
  };
  std::map<std::uint64_t, Seen> seen_;  ///< key: the landmark's id
};

}  // namespace perdure::mapping
