// What poses and accelerometer say of the same accelerations.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/replay/dataset.h"
#include "common/replay/files/pose_file.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {

/// About one pose, in W: acceleration by the poses, the mean specific force over the same time,
/// weighted as a second difference weighs it, and R_WB.
struct Push {
  Eigen::Vector3d by_poses, by_imu;
  Eigen::Matrix3d R_WB;
};

/// Whether gravity is what it measures most of the time.
bool measuresGravity(const std::vector<ImuSample>& samples);

/// Of poses so far apart; all samples of the recording must be those of `gyro`.
std::vector<Push> pushesOf(const std::vector<replay::StampedPose>& poses,
                           const replay::Recording& recording, const TurnIntegral& gyro,
                           double seconds);

/// What one metre of the poses is by the accelerometer, at least and at most: noise of the poses
/// lessens the one, noise of the accelerometer raises the other, and both have twice the deviation
/// of a ratio of so many steps.
struct Scale {
  double least, metres, most;
  double common;  ///< share of the accelerations that both have
  std::size_t steps;

  bool fits(double unit) const {
    constexpr double kSystematic = 1.05;  // scale of the accelerometer, clocks, smoothed poses
    return least < kSystematic * unit && most > unit / kSystematic;
  }
};

/// Gravity and the bias are free. Nothing where there are few or they have nothing in common.
std::optional<Scale> scaleOf(const std::vector<Push>& pushes);

/// The scale over those steps (of 0.3 to 2 s) that have most in common; nothing where gravity is
/// not what the accelerometer measures most of the time.
std::optional<Scale> bestScale(const std::vector<replay::StampedPose>& poses,
                               const replay::Recording& recording);

/// Root of the mean square of what the accelerometer says beside gravity and bias, m/s², over
/// steps of a second; 0 where there are few.
double pushingOfImu(const std::vector<replay::StampedPose>& poses,
                    const replay::Recording& recording);

}  // namespace perdure::tools
