// Reprojection of a point of W into the clones that saw it: residuals, Jacobians, the projection on
// the left null space of the point (Mourikis & Roumeliotis 2007, eq. 24), and χ² gates.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"
#include "services/vio/core/tracks/tracks.h"

namespace perdure::vio {

struct ProjectionJacobians {
  Eigen::Matrix<double, 2, 6> pose;       ///< derivative by [θ, p] of T_WB
  Eigen::Matrix<double, 2, 6> extrinsic;  ///< derivative by [θ, p] of T_BC
  Eigen::Matrix<double, 2, 3> point;      ///< derivative by p_W
};

/// Projects p_W to the normalised image. Returns false if p_W is not in front of the camera.
bool projectPoint(const RigidTransform& T_WB, const RigidTransform& T_BC,
                  const Eigen::Vector3d& p_W, Eigen::Vector2d& normalised,
                  ProjectionJacobians* J = nullptr);

/// A point seen in one image, whitened: r = pose δT_WB + extrinsic δT_BC + lens δlens +
/// readout δt_r + point δp_W + n, n ~ N(0, I). The camera pose is that at the exposure of the
/// point's row.
struct View {
  Eigen::Vector2d r;
  ProjectionJacobians J;
  Eigen::Matrix<double, 2, kLensSize> lens;           ///< derivative by the lens error
  Eigen::Vector2d readout = Eigen::Vector2d::Zero();  ///< derivative by the read-out time
};

/// Returns the view of a point. The residual uses the estimated pose and p_W; the Jacobians use the
/// clone's `linear` and p_linear. Returns nothing if the point is not in front of the camera.
std::optional<View> viewOf(const State& state, const Clone& clone, std::size_t camera,
                           const ImagePoint& seen, const Eigen::Vector3d& p_W,
                           const Eigen::Vector3d& p_linear, double sigma_px);

/// Writes the columns of State::camera() into `H`, 2 rows of a Jacobian.
void putCamera(const State& state, std::size_t camera, const View& view,
               Eigen::Ref<Eigen::MatrixXd> H);

/// Returns the point undistorted with the state's present lens.
Eigen::Vector2d normalisedOf(const State& state, const Clone& clone, std::size_t camera,
                             const ImagePoint& seen);

/// Measurements of a point, whitened: r = H_x δx + H_f δf + n, n ~ N(0, I).
struct PointSystem {
  Eigen::MatrixXd H_x;  ///< columns of calibrationAndClones
  Eigen::MatrixXd H_f;  ///< rows × 3
  Eigen::VectorXd r;
};

/// Returns the blocks of all cameras and clones.
std::vector<Block> calibrationAndClones(const State& state);

/// Returns the linearisation point of p_W. It has the same position relative to the track's newest
/// clone, placed by that clone's `linear`.
Eigen::Vector3d linearisationPoint(const State& state, const Track& track,
                                   const Eigen::Vector3d& p_W);

/// Stacks the views of `track` in clones of the state, with the columns of calibrationAndClones().
/// r is empty if the point lies behind a camera.
PointSystem stackViews(const Track& track, const State& state, const Eigen::Vector3d& p_W,
                       double sigma_px);

/// Inverse depth ρ of a point in the first camera at its newest view, with δρ = x δx + f δf.
struct InverseDepth {
  double value = 0.0;
  Eigen::RowVectorXd x;
  Eigen::RowVector3d f = Eigen::RowVector3d::Zero();
};
InverseDepth inverseDepth(const Track& track, const State& state, const Eigen::Vector3d& p_W);

/// Returns the standard deviation of ρ, in 1/m, given the views and the state. P is the covariance
/// of calibrationAndClones(). Call separatePoint() before. The result is not finite if the views
/// give no depth.
double depthSigma(const PointSystem& system, const InverseDepth& depth, const MatrixView& P);

/// Appends the row of a prior: ρ equals the scene's inverse depth within `options.scene_scatter`.
void addScene(PointSystem& system, const InverseDepth& depth, const VisionOptions& options);

/// Makes H_f upper triangular, so that only the first three rows depend on the point.
void separatePoint(PointSystem& system);

/// Removes the rows that depend on the point. Call separatePoint() before.
void dropPoint(PointSystem& system);

/// Returns true if rᵀ S⁻¹ r, with S = H P Hᵀ + I, is below the χ² quantile of `probability`.
bool passesGate(const VectorView& r, const MatrixView& S, double probability);

/// Does the same with S = P() + I. P is called only if rᵀ r, an upper bound of rᵀ S⁻¹ r, reaches
/// the quantile.
bool passesGateWith(const VectorView& r, const std::function<Eigen::MatrixXd()>& P,
                    double probability);

/// Reduces the system by QR to at most as many rows as columns, without loss of information.
void compress(Eigen::MatrixXd& H, Eigen::VectorXd& r);

}  // namespace perdure::vio
