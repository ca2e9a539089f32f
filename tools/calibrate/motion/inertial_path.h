// The path of the body as the IMU measures it, except for initial velocity and gravity.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::calibrate {

/// The body at one time, in the frame of the body at the path's start.
struct InertialState {
  Eigen::Quaterniond q;      ///< q_SB
  Eigen::Vector3d rate;      ///< w_SB_B, rad/s
  Eigen::Vector3d position;  ///< twofold integral of the specific force, m
  Eigen::Vector3d velocity;  ///< derivative of the position
  /// A change d of the gyroscope's bias rotates the body by Exp(-by_bias d) on the right.
  Eigen::Matrix3d by_bias;
};

class InertialPath {
 public:
  /// The samples cover [from, to], and are sorted by time; rates are constant between them.
  InertialPath(const std::vector<ImuSample>& samples, const Eigen::Vector3d& gyro_bias,
               TimePoint from, TimePoint to);
  /// `seconds` after `from`. Outside the path the last rate is used.
  InertialState at(double seconds) const;

 private:
  struct Step {
    double from_s;
    InertialState start;
    Eigen::Vector3d force;  ///< mean over the step, in B
  };
  static InertialState moved(const Step& step, double dt);

  std::vector<Step> steps_;
};

}  // namespace perdure::calibrate
