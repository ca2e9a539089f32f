// Reprojection of a point of W into the clones that saw it: residual and Jacobians, projection on
// the left null space of the point (Mourikis & Roumeliotis 2007, eq. 24), χ² gates.
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
  Eigen::Matrix<double, 2, 6> pose;       ///< by [θ, p] of T_WB
  Eigen::Matrix<double, 2, 6> extrinsic;  ///< by [θ, p] of T_BC
  Eigen::Matrix<double, 2, 3> point;      ///< by p_W
};

/// The normalised image point of p_W; false when it is not in front of the camera.
bool projectPoint(const RigidTransform& T_WB, const RigidTransform& T_BC,
                  const Eigen::Vector3d& p_W, Eigen::Vector2d& normalised,
                  ProjectionJacobians* J = nullptr);

/// A point seen in one image, whitened: r = pose δT_WB + extrinsic δT_BC + readout δt_r +
/// point δp_W + n, n ~ N(0, I). The camera is where it was when it saw the point's row.
struct View {
  Eigen::Vector2d r;
  ProjectionJacobians J;
  Eigen::Vector2d readout = Eigen::Vector2d::Zero();  ///< by the read-out, s
};

/// The residual is at the clone's estimate and p_W, the Jacobians at its `linear` and p_linear.
/// Nothing where the point is behind the camera.
std::optional<View> viewOf(const State& state, const Clone& clone, std::size_t camera,
                           const ImagePoint& seen, const Eigen::Vector3d& p_W,
                           const Eigen::Vector3d& p_linear, double sigma_px);

/// A point's measurements, whitened: r = H_x δx + H_f δf + n, n ~ N(0, I).
struct PointSystem {
  Eigen::MatrixXd H_x;  ///< columns of `blocks`
  Eigen::MatrixXd H_f;  ///< rows × 3
  Eigen::VectorXd r;
};

/// Blocks of all extrinsics, of the estimated read-outs, and of the clones.
std::vector<Block> calibrationAndClones(const State& state);

/// Where a point of the estimates lies among the poses of linearisation: it moves along with the
/// track's newest clone.
Eigen::Vector3d linearisationPoint(const State& state, const Track& track,
                                   const Eigen::Vector3d& p_W);

/// Stacks all views of `track` whose clones are in the state; H_x has the columns of
/// calibrationAndClones. The residual is at the estimates, the Jacobians at `linear`.
/// Empty r when a view lies behind its camera.
PointSystem stackViews(const Track& track, const State& state, const Eigen::Vector3d& p_W,
                       double sigma_px);

/// Rotates the system so that H_f is upper triangular: its first three rows carry the point, the
/// others do not depend on it.
void separatePoint(PointSystem& system);

/// The last rows only: what the views say about the state alone. Needs separatePoint before.
void dropPoint(PointSystem& system);

/// True when rᵀ S⁻¹ r is below the χ² quantile; S = H P Hᵀ + I.
bool passesGate(const VectorView& r, const MatrixView& S, double probability);

/// The same with S = P + I, where P is costly: it is only asked for when rᵀ r, which bounds
/// rᵀ S⁻¹ r from above, is not below.
bool passesGateWith(const VectorView& r, const std::function<Eigen::MatrixXd()>& P,
                    double probability);

/// Keeps no more rows than columns, by QR, without loss.
void compress(Eigen::MatrixXd& H, Eigen::VectorXd& r);

}  // namespace perdure::vio
