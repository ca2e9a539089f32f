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
  /// Adds landmarks of the current session at the distance travelled `way_m`. `p_WB` is the
  /// position of the body in W. Leaves out landmarks without a descriptor, beyond 60 m, or with an
  /// error above a tenth of their distance.
  void add(const Landmarks& landmarks, const Eigen::Vector3d& p_WB, double way_m);
  /// Returns landmarks observed within the last `back_m` before the distance travelled `way_m`, in
  /// the axes of the anchor at `T_WA`. Returns at most kMostPoints, those with the smallest errors
  /// relative to their distances.
  View viewFrom(const RigidTransform& T_WA, double way_m, double back_m) const;
  std::size_t size() const { return seen_.size(); }
  /// Removes all landmarks. Call it at the start of another session.
  void clear() { seen_.clear(); }

 private:
  struct Seen {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
    double sigma = 0.0;     ///< m
    double relative = 0.0;  ///< sigma as a fraction of the distance from the body
    double way_m = 0.0;     ///< distance travelled at the last observation
    Descriptor descriptor{};
  };
  std::map<std::uint64_t, Seen> seen_;  ///< key: the landmark's id
};

}  // namespace perdure::mapping
