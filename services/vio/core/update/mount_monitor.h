// Detects that the rig has turned on the body: a bracket that slips, or a camera that is touched.
// The rotation on the body is a constant of the state, which must not contradict earlier estimates.
// If images jump (images_jumped), either the body or the rig has moved; the filter allows both, and
// its later estimates distinguish them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "common/base/time.h"
#include "services/vio/core/state/state.h"

namespace perdure::vio {

/// Rotation of the first camera on the body, with its covariance in rad² (right error).
struct MountPose {
  Eigen::Quaterniond q_BC = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  static MountPose of(const State& state);
};

class MountMonitor {
 public:
  /// Compares with the rotation before a jump of the images from now on.
  void compareWith(const MountPose& before, TimePoint now);
  /// Returns true once if the rotation contradicts that of up to half a minute before.
  bool judge(const MountPose& now, TimePoint time);
  /// Discards the compared rotation. Call it at a start.
  void forget() { before_.reset(); }
  /// Returns the angle of the newest turn, in rad; nothing if none was found.
  std::optional<double> turn() const { return turn_; }

 private:
  std::optional<MountPose> before_;
  TimePoint since_;
  std::optional<double> turn_;
};

}  // namespace perdure::vio
