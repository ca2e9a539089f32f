// Collects landmarks of the way of late, for the view of each anchor and for what is seen now.
#pragma once

#include <cstdint>
#include <map>

#include "common/mapping/appearance/view.h"
#include "common/math/rigid_transform.h"
#include "common/types/odometry.h"

namespace perdure::mapping {

class ViewBuilder {
 public:
  /// Landmarks of the session that the way belongs to, at `way_m` of it. Those without a descriptor
  /// and those placed worse than a tenth of their distance are left out.
  void add(const Landmarks& landmarks, const Eigen::Vector3d& p_WB, double way_m);
  /// What was seen on the last `back_m` of the way, in an anchor's axes: of the best placed ones at
  /// most kMostPoints.
  View viewFrom(const RigidTransform& T_WA, double way_m, double back_m) const;
  std::size_t size() const { return seen_.size(); }
  /// Another session begins.
  void clear() { seen_.clear(); }

 private:
  struct Seen {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
    double sigma = 0.0;     ///< m
    double relative = 0.0;  ///< the same as a share of the distance
    double way_m = 0.0;     ///< when it was seen last
    Descriptor descriptor{};
  };
  std::map<std::uint64_t, Seen> seen_;  ///< by the landmark's id
};

}  // namespace perdure::mapping
