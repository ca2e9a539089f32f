#include "services/semantic_filter/core/measurement/frame.h"

#include <cmath>

namespace perdure::semantic_filter {

constexpr double kNever = 1e9;  // a scale at which a view change does not count

Projector FrameContext::projector() const { return frame_view ? frame_view->projector : view; }

ViewScales biasScales(const BoxParameters& box) {
  return {box.bias_angle, box.bias_log_distance, box.bias_image_angle};
}

ViewScales detectabilityScales(const VisibilityParameters& visibility) {
  return {visibility.detectability_angle, visibility.detectability_log_distance, kNever};
}

ViewWalk viewWalkOf(const FrameContext& frame) {
  const BoxParameters& box = frame.parameters->box;
  const VisibilityParameters& visibility = frame.parameters->visibility;
  ViewWalk walk;
  walk.T_WC = frame.view.T_WC();
  walk.focal = frame.view.camera->fx();
  const BoxNoise noise =
      frame.model ? boxNoise(*frame.model, frame.view.camera->width()) : BoxNoise{};
  walk.lasting = lastingError(box, noise) * std::sqrt(frame.noise_scale.sides.lasting);
  walk.bias = biasScales(box);
  walk.unmapped_occluder = visibility.unmapped_occluder;
  walk.occluder = {visibility.occluder_angle, kNever, kNever};
  walk.hard_to_detect = visibility.hard_to_detect;
  walk.detectability = detectabilityScales(visibility);
  return walk;
}

void advancePoseError(PoseError& error, const Odometry& odometry,
                      const std::optional<RigidTransform>& last_T_WB,
                      const PoseParameters& parameters) {
  // Motion adds no error, so the pose error follows from the reported covariance and transition.
  error.reported = odometry.has_increment && odometry.increment_covariance.isZero(0.0);
  if (error.reported) {
    error.covariance = odometry.covariance.topLeftCorner<6, 6>();
    error.product = (odometry.transition * error.product).eval();
    return;
  }
  if (!last_T_WB) return;
  // The rotation error is expressed in B, which turns relative to W.
  Matrix6d A = Matrix6d::Identity();
  A.topLeftCorner<3, 3>() = odometry.T_WB.R().transpose() * last_T_WB->R();
  Eigen::Matrix<double, 6, 1> q;
  q << Eigen::Vector3d::Constant(parameters.walk_rotation * parameters.walk_rotation),
      Eigen::Vector3d::Constant(parameters.walk_position * parameters.walk_position);
  const double metres = (odometry.T_WB.p - last_T_WB->p).norm();
  error.covariance = (A * error.covariance * A.transpose()).eval();
  error.covariance.diagonal() += metres * q;
  error.product = (A * error.product).eval();
}

}  // namespace perdure::semantic_filter
