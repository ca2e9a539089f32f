// Terms of the posterior of a window in motion. Derivation: tools/docs/maths/vio-starts.md.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "services/vio/core/propagation/imu_propagator.h"
#include "services/vio/core/start/motion_refinement.h"

namespace perdure::vio::motion {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

/// The cost of a view is linear if its residual, in deviations, is above this value.
inline constexpr double kHuber = 2.0;

/// Indices in the error: parameters of the window, then [θ, p, v] of each pose except the first.
/// Rotation errors are right multiplied; all other errors are added in B0. The gravity error uses
/// acrossGravity().
inline constexpr Eigen::Index kV0 = 0, kGravity = 3, kGyro = 5, kAccel = 8, kOffset = 11,
                              kPoses = 12;
constexpr Eigen::Index poseAt(std::size_t k) {
  return kPoses + 9 * (static_cast<Eigen::Index>(k) - 1);
}
/// Adds the error to the window. Points do not change.
void add(MotionWindow& window, const Eigen::VectorXd& error);

/// A point by bearing and inverse depth, from the camera position at the first pose, in the axes of
/// its first view. The residuals of far points are thus nearly linear, and noise may make the
/// inverse depth negative. All rays begin at the first pose, so that bearings do not depend on the
/// window's scale.
struct Ray {
  Eigen::Vector3d origin;  // position in B0; fixed
  Eigen::Matrix3d R_B0_C;  // rotation of the camera; fixed
  Eigen::Vector3d abr;     // bearing x/z, y/z, and 1/z in 1/m
};

struct Estimate {
  MotionWindow window;
  std::vector<Ray> rays;
};

std::vector<Ray> raysOf(const MotionWindow& window);
/// Returns the window with its points at the positions given by the rays.
MotionWindow windowOf(Estimate estimate);

/// Quantities that depend on the biases: increments between successive poses, and rates at the
/// poses.
struct Inertial {
  std::vector<ImuIncrement> increments;
  std::vector<Matrix9> information;
  std::vector<Eigen::Vector3d> rates;  // angular rates of the body in B, rad/s
};

/// Fails with "start_window_short" if there are no samples, and with "start_imu_noise_singular" if
/// the covariance of an increment is singular.
Result<Inertial> inertialOf(const MotionWindow& window, const ImuBuffer& imu,
                            const ImuNoise& noise);

struct ViewTerm {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 3> by_ray;
  Eigen::Matrix<double, 2, 6> by_pose;  ///< derivative by [θ, p]
  Eigen::Vector2d by_offset;
  double weight = 1.0;  ///< Huber weight
};

/// Returns the term of a view; nothing if the point is behind the camera.
std::optional<ViewTerm> viewTerm(const Estimate& estimate, std::size_t point,
                                 const WindowView& view, const Inertial& inertial, double sigma_px);

/// Returns the residual [θ, p, v] of pose i + 1 against the increment from pose i, in the body
/// frame of pose i.
Vector9 inertialResidual(const MotionWindow& window, std::size_t i, const ImuIncrement& increment);
/// Returns the Jacobian of inertialResidual(); `size` is the length of the error.
Eigen::Matrix<double, 9, Eigen::Dynamic> inertialJacobian(const MotionWindow& window, std::size_t i,
                                                          const ImuIncrement& increment,
                                                          Eigen::Index size);

}  // namespace perdure::vio::motion
