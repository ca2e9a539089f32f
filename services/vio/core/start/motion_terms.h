// Terms of the posterior of a window in motion (motion_refinement.h), and their derivatives by its
// error. Derivation: tools/docs/maths/vio-starts.md.
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

/// Deviations of a view beyond which it counts linearly.
inline constexpr double kHuber = 2.0;

/// Order of the error: what belongs to the window, then [θ, p, v] of all poses but the first.
/// Rotations err on the right, all else is added in B0; gravity by acrossGravity().
inline constexpr Eigen::Index kV0 = 0, kGravity = 3, kGyro = 5, kAccel = 8, kOffset = 11,
                              kPoses = 12;
constexpr Eigen::Index poseAt(std::size_t k) {
  return kPoses + 9 * (static_cast<Eigen::Index>(k) - 1);
}
/// The window with this error added; points stay.
void add(MotionWindow& window, const Eigen::VectorXd& error);

/// A point by bearing and inverse depth from where the camera was at the first pose, in axes of its
/// first view. Far points stay linear, and one that noise puts beyond infinity (inverse depth below
/// 0) is nothing special. All begin at the first pose, so that a window of another scale has the
/// same bearings.
struct Ray {
  Eigen::Vector3d origin;  // in B0, fixed
  Eigen::Matrix3d R_B0_C;  // fixed
  Eigen::Vector3d abr;     // bearing x/z, y/z, and 1/z in 1/m
};

struct Estimate {
  MotionWindow window;
  std::vector<Ray> rays;
};

/// One for each point of the window.
std::vector<Ray> raysOf(const MotionWindow& window);
/// The window with its points where the rays have them.
MotionWindow windowOf(Estimate estimate);

/// What follows from the biases: the increments between neighbours, and the rate at each pose.
struct Inertial {
  std::vector<ImuIncrement> increments;
  std::vector<Matrix9> information;
  std::vector<Eigen::Vector3d> rates;  // of the body in B, rad/s
};

/// Fails with "start_window_short" where samples are missing, with "start_imu_noise_singular" where
/// the noise of the samples is none that can be inverted.
Result<Inertial> inertialOf(const MotionWindow& window, const ImuBuffer& imu,
                            const ImuNoise& noise);

/// Residual of a view in deviations, and its derivatives.
struct ViewTerm {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 3> by_ray;
  Eigen::Matrix<double, 2, 6> by_pose;  ///< θ, p
  Eigen::Vector2d by_offset;
  double weight = 1.0;  ///< Huber's
};

/// Nothing where the point is behind the camera.
std::optional<ViewTerm> viewTerm(const Estimate& estimate, std::size_t point,
                                 const WindowView& view, const Inertial& inertial, double sigma_px);

/// Of poses i and i + 1: [θ, p, v] of the later one less what the samples say, in the earlier body.
Vector9 inertialResidual(const MotionWindow& window, std::size_t i, const ImuIncrement& increment);
/// By an error of so many entries.
Eigen::Matrix<double, 9, Eigen::Dynamic> inertialJacobian(const MotionWindow& window, std::size_t i,
                                                          const ImuIncrement& increment,
                                                          Eigen::Index size);

}  // namespace perdure::vio::motion
