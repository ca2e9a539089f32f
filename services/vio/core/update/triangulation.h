// Position of a point from its rays: linear least squares, then Gauss-Newton on the reprojection
// error in inverse depth.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/math/rigid_transform.h"
#include "common/types/odometry.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"
#include "services/vio/core/tracks/tracks.h"

namespace perdure::vio {

struct Ray {
  RigidTransform T_WC;
  Eigen::Vector2d normalised;
  double weight = 1.0;  ///< 1 / σ in the normalised image
};

struct Triangulated {
  Eigen::Vector3d p_W;
  Eigen::Matrix3d covariance;  ///< m², in W, from the pixel noise alone
  double relative_sigma;       ///< σ / depth, from the newest view
  double rms;                  ///< RMS of the weighted residuals
};

/// Triangulates at least two rays, the newest last. Fails with "triangulation_…": views, parallel,
/// depth (behind a camera, or too near), far, or condition. If `scene`, its inverse depth in 1/m,
/// is given, parallel rays get the depth nearest to the scene's that they permit, limited to the
/// largest one.
Result<Triangulated> triangulate(const std::vector<Ray>& rays, const VisionOptions& options,
                                 std::optional<double> scene = {});

std::vector<Ray> raysOf(const Track& track, const State& state, double sigma_px);

/// Returns the cross-covariance with the pose [θ, p] of a point whose position in B is independent
/// of the pose. Its error is −R [p_B]× θ + δp + R δp_B.
Eigen::Matrix<double, 3, 6> crossOfRigid(const Eigen::Vector3d& p_W, const RigidTransform& T_WB,
                                         const Matrix6d& pose_covariance);

}  // namespace perdure::vio
