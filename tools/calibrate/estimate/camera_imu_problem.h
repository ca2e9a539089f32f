// The least-squares problem that camera_imu.h solves.
#pragma once

#include <ceres/problem.h>

#include <vector>

#include "tools/calibrate/estimate/camera_imu.h"

namespace perdure::calibrate {

/// A view, and which of its corners are inliers. Its time is that of the images' clock, since the
/// first view.
struct Sighting {
  View view;
  double time_s = 0.0;
  std::vector<bool> good;
};

struct Unknowns {
  Spline spline;
  Eigen::Quaterniond q_BC = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_BC = Eigen::Vector3d::Zero();
  double time_offset_s = 0.0;
  Vector8d lens = Vector8d::Zero();
  std::vector<Eigen::Vector3d> gyro_bias, accel_bias;  ///< one node for each kBiasInterval
  Eigen::Vector3d down_T = Eigen::Vector3d::UnitY();   ///< unit, along gravity
};

struct Deviations {
  double px = 0.1, gyro = 1e-3, accel = 1e-2, gyro_walk = 1e-5, accel_walk = 1e-3;
};

class CameraImuProblem {
 public:
  CameraImuProblem(const Board& board, DistortionModel model, double readout_s, double height,
                   const CameraImuOptions& options);

  std::vector<Sighting> sightings;
  std::vector<ImuReading> readings;  ///< readings within the spline
  Unknowns x;
  Deviations sigma;

  /// Initialises the bias nodes over the duration of the spline.
  void setBiases(const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel);
  /// Returns false if Ceres finds no usable solution.
  bool solve(int iterations);
  std::vector<CornerResidual> cornerResiduals() const;
  std::vector<ImuResidual> imuResiduals() const;
  /// Marks corners with a residual above `limit_px` as outliers, and all others as inliers.
  void gateCorners(double limit_px);
  Eigen::Vector3d biasMean(const std::vector<Eigen::Vector3d>& bias) const;

  struct Certainty {
    Matrix15d calibration = Matrix15d::Zero();
    double widened = 1.0;                   ///< see CameraImu::widened
    Eigen::Vector3d gyro_bias, accel_bias;  ///< standard deviations at mid-time
  };
  /// Fails with calibrate_not_observable if the data do not determine all parameters.
  Result<Certainty> certainty();

 private:
  void build(ceres::Problem& problem);
  void addFrames(ceres::Problem& problem);
  void addSamples(ceres::Problem& problem);
  void addBiases(ceres::Problem& problem);
  std::size_t biasAt(double t, double& share) const;
  bool hasDistortion() const { return model_ != DistortionModel::kNone; }
  double delayOf(const Corner& corner) const;
  std::vector<int> clusterOfRows() const;
  std::vector<double*> calibrationBlocks();  ///< same order as in the covariance
  Eigen::Vector2d residualOf(const Sighting& sighting, std::size_t i) const;

  const Board& board_;
  DistortionModel model_;
  double readout_s_, height_;
  CameraImuOptions options_;
};

}  // namespace perdure::calibrate
