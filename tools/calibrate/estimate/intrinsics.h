// Focal lengths, principal point and distortion from views of a board: least squares over the
// views' poses and the lens (Zhang, "A Flexible New Technique for Camera Calibration", PAMI 2000),
// with any of the lenses of common/camera.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/camera/camera_model.h"
#include "tools/calibrate/estimate/views.h"

namespace perdure::calibrate {

using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

/// A corner against where the estimate puts it.
struct CornerResidual {
  std::uint64_t frame = 0;
  double time_s = 0.0;  ///< since the first view
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero(), residual = Eigen::Vector2d::Zero();  ///< px
};

struct IntrinsicsOptions {
  DistortionModel model = DistortionModel::kRadialTangential;
  std::size_t most_views = 60;  ///< the most different ones are taken
};

struct Intrinsics {
  CameraCalibration camera;                ///< name, size and lens only
  Matrix8d covariance = Matrix8d::Zero();  ///< of fx fy cx cy and the coefficients
  double sigma_px = 0.0;                   ///< of a corner's coordinate, from the residuals
  std::size_t views = 0, corners = 0, outliers = 0;
  std::vector<RigidTransform> T_CT;  ///< board in camera, of each view that was used
  std::vector<CornerResidual> residuals;
};

/// fx fy cx cy, and the coefficients (0 where the lens has none).
Vector8d lensOf(const CameraCalibration& camera);
void setLens(const Vector8d& lens, CameraCalibration& camera);

/// The board in the camera, z > 0. Nothing where the corners do not tell.
std::optional<RigidTransform> boardPose(const CameraModel& camera, const Board& board,
                                        const View& view);

/// `camera` gives name and size of the images. Fails with calibrate_few_views or
/// calibrate_no_convergence; the detail says the mend.
Result<Intrinsics> estimateIntrinsics(const Board& board, const std::vector<View>& views,
                                      const CameraCalibration& camera,
                                      const IntrinsicsOptions& options);

}  // namespace perdure::calibrate
