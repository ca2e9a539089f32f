// Estimates focal lengths, principal point and distortion from views of a board (Zhang, PAMI 2000),
// for each lens model of common/camera.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/camera/camera_model.h"
#include "tools/calibrate/estimate/board.h"

namespace perdure::calibrate {

using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

struct CornerResidual {
  std::uint64_t frame = 0;
  double time_s = 0.0;  ///< time since the first view
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero(), residual = Eigen::Vector2d::Zero();  ///< px
};

struct IntrinsicsOptions {
  DistortionModel model = DistortionModel::kRadialTangential;
  std::size_t most_views = 60;  ///< the most different views are used
};

struct Intrinsics {
  CameraCalibration camera;                ///< name, size and lens only
  Matrix8d covariance = Matrix8d::Zero();  ///< order: fx, fy, cx, cy, coefficients
  double sigma_px = 0.0;                   ///< standard deviation of a coordinate
  std::size_t views = 0, corners = 0, outliers = 0;
  std::vector<RigidTransform> T_CT;  ///< board in camera, for each used view
  std::vector<CornerResidual> residuals;
};

/// fx, fy, cx, cy and the four distortion coefficients (0 if the lens model has none).
Vector8d lensOf(const CameraCalibration& camera);
void setLens(const Vector8d& lens, CameraCalibration& camera);

/// Pose of the board in the camera frame, z > 0. Empty if the corners do not determine the pose.
std::optional<RigidTransform> boardPose(const CameraModel& camera, const Board& board,
                                        const View& view);

/// `camera`: name and image size. Fails with calibrate_few_views or calibrate_no_convergence.
Result<Intrinsics> estimateIntrinsics(const Board& board, const std::vector<View>& views,
                                      const CameraCalibration& camera,
                                      const IntrinsicsOptions& options);

}  // namespace perdure::calibrate
