// Detects that the rig has turned on the body: a bracket that slips, or a camera that is touched.
// Images that jump (images_jumped) have one of two causes: the body moved in a way that the IMU did
// not measure, or the rig did. The filter allows both, and its later estimates distinguish them.
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
  /// Remembers the rotation before a jump. A jump that is still being judged is kept.
  void begin(const MountPose& before, TimePoint now);
  /// Returns true once if the rotation contradicts the one before the jump.
  bool judge(const MountPose& now, TimePoint time);
  /// Ends the judgement of a jump, for a new start.
  void forget() { before_.reset(); }
  /// Returns the angle of the newest turn, in rad; nothing if none was found.
  std::optional<double> turn() const { return turn_; }

 private:
  std::optional<MountPose> before_;
  TimePoint since_;
  std::optional<double> turn_;
};

}  // namespace perdure::vio
