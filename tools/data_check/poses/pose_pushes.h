// Compares the accelerations of poses with the accelerometer.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/replay/dataset.h"
#include "common/replay/files/pose_file.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {

/// Motion around one pose, in W: acceleration by the poses, mean specific force with the weights of
/// a second difference, and R_WB.
struct Push {
  Eigen::Vector3d by_poses, by_imu;
  Eigen::Matrix3d R_WB;
};

/// Whether the samples measure gravity most of the time.
bool measuresGravity(const std::vector<ImuSample>& samples);

/// Pushes from poses `seconds` apart; `gyro` must contain all samples of the recording.
std::vector<Push> pushesOf(const std::vector<replay::StampedPose>& poses,
                           const replay::Recording& recording, const TurnIntegral& gyro,
                           double seconds);

/// Length in m of one unit of the poses, by the accelerometer, with its lower and upper bound.
/// Noise of the poses lowers the lower bound, noise of the accelerometer raises the upper one. Both
/// bounds include two standard deviations of the estimated ratio.
struct Scale {
  double least, metres, most;
  double common;  ///< shared fraction of the accelerations
  std::size_t steps;

  bool fits(double unit) const {
    constexpr double kSystematic = 1.05;  // allows for errors of scale, clocks and smoothing
    return least < kSystematic * unit && most > unit / kSystematic;
  }
};

/// Estimates the scale together with gravity and bias. Returns nothing if pushes are few or
/// uncorrelated.
std::optional<Scale> scaleOf(const std::vector<Push>& pushes);

/// Returns the scale for the step length (0.3 to 2 s) with the highest correlation, or nothing if
/// the accelerometer does not measure gravity most of the time.
std::optional<Scale> bestScale(const std::vector<replay::StampedPose>& poses,
                               const replay::Recording& recording);

/// RMS of the specific force without gravity and bias, m/s², over steps of 1 s; 0 for few poses.
double pushingOfImu(const std::vector<replay::StampedPose>& poses,
                    const replay::Recording& recording);

}  // namespace perdure::tools
