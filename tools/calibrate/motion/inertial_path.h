// The trajectory of the body as the IMU measures it, without initial velocity and gravity.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::calibrate {

/// State of the body at one time, in the body frame at the start of the trajectory.
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
  /// `samples` must be sorted by time and cover [from, to]; rates are constant between two samples.
  InertialPath(const std::vector<ImuSample>& samples, const Eigen::Vector3d& gyro_bias,
               TimePoint from, TimePoint to);
  /// The state `seconds` after `from`. Outside the interval the last rate is used.
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
