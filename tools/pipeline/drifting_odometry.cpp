#include "tools/pipeline/drifting_odometry.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::tools {
namespace {

double declaredScale(const DriftConfig& config) {
  return config.scale_sigma > 0.0 ? config.scale_sigma : std::abs(config.scale);
}

/// The derivative of `v` with respect to the angle of a small rotation about the vertical.
Eigen::Vector3d turned(const Eigen::Vector3d& v) { return {-v.y(), v.x(), 0.0}; }

/// Maps [yaw, p] to [θ, p] with θ in W.
Eigen::Matrix<double, 6, 4> intoPose() {
  Eigen::Matrix<double, 6, 4> M = Eigen::Matrix<double, 6, 4>::Zero();
  M(2, 0) = 1.0;
  M.bottomRightCorner<3, 3>().setIdentity();
  return M;
}

/// Maps [θ, p] with θ in W to θ in the body.
Matrix6d intoBody(const RigidTransform& T_WB) {
  Matrix6d D = Matrix6d::Identity();
  D.topLeftCorner<3, 3>() = T_WB.R().transpose();
  return D;
}

/// Covariance of the pose with variance `value` of roll and pitch in W. Their error is constant.
Matrix6d tilt(double value) {
  Matrix6d T = Matrix6d::Zero();
  T(0, 0) = T(1, 1) = value;
  return T;
}

}  // namespace

void describe(DriftConfig& config, config::Fields& fields) {
  using config::atLeast, config::between;
  fields.number("scale", config.scale, between(-0.5, 0.5),
                {"the way is reported longer by this share"});
  fields.number("scale_sigma", config.scale_sigma, between(0, 0.5),
                {"deviation that is declared of it; 0: as large as `scale`"});
  fields.number("yaw_walk", config.yaw_walk, atLeast(0),
                {"random walk of the yaw over the distance", "rad/√m"});
  fields.integer("seed", config.seed, atLeast(0), {"of the walk; --seed sets it too"});
  fields.boolean("own_frame", config.own_frame,
                 {"W begins level at the body, with yaw 0, in the first frame that is used; "
                  "otherwise it is the truth's frame there"});
}

DriftCovariance::DriftCovariance(double sigma_yaw, double sigma_position, double sigma_scale)
    : joint_(Eigen::Matrix<double, 5, 5>::Zero()) {
  joint_.diagonal() << sigma_yaw * sigma_yaw,
      Eigen::Vector3d::Constant(sigma_position * sigma_position), sigma_scale * sigma_scale;
}

void DriftCovariance::advance(const Eigen::Vector3d& step_W, double sigma_yaw) {
  Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
  A.bottomLeftCorner<3, 1>() = turned(step_W);
  Eigen::Vector4d b(0.0, step_W.x(), step_W.y(), step_W.z());
  Eigen::Vector4d least = Eigen::Vector4d::Constant(kLeastStepPosition * kLeastStepPosition);
  least(0) = kLeastStepRotation * kLeastStepRotation + sigma_yaw * sigma_yaw;

  // The scale's linear regression on u: its gain, and the variance that remains.
  const Eigen::Matrix4d P = joint_.topLeftCorner<4, 4>();
  const Eigen::Vector4d with_scale = joint_.topRightCorner<4, 1>();
  const Eigen::Vector4d gain = solveSymmetric(P, with_scale);
  const double open = std::max(0.0, joint_(4, 4) - gain.dot(with_scale));
  transition_ = A + b * gain.transpose();
  noise_ = open * b * b.transpose();
  noise_.diagonal() += least;

  Eigen::Matrix<double, 5, 5> F = Eigen::Matrix<double, 5, 5>::Identity();
  F.topLeftCorner<4, 4>() = A;
  F.topRightCorner<4, 1>() = b;
  joint_ = (F * joint_ * F.transpose()).eval();
  joint_.diagonal().head<4>() += least;
}

DriftingOdometry::DriftingOdometry(replay::PoseFile truth, InstanceId instance,
                                   const WorldId& session, const PoseAccuracy& accuracy,
                                   const DriftConfig& config)
    : truth_(std::move(truth)),
      instance_(instance),
      session_(session),
      accuracy_(accuracy),
      config_(config),
      dice_(sim::seedOf("drift", {static_cast<std::uint64_t>(config.seed)})),
      covariance_(accuracy.sigma_rotation, accuracy.sigma_position, declaredScale(config)) {}

std::optional<Odometry> DriftingOdometry::at(const FrameStamp& stamp) {
  const auto there = truth_.at(stamp.sequence, stamp.time);
  if (!there) return std::nullopt;
  if (last_)
    advance(*there, toSeconds(stamp.time - last_->time));
  else
    begin(*there);
  before_ = std::exchange(last_, stamp);
  return tell(stamp);
}

void DriftingOdometry::begin(const RigidTransform& true_T_WB) {
  true_T_WB_ = T_WB_ = true_T_WB;
  if (!config_.own_frame) return;
  turn_ = -yawOf(true_T_WB.R());
  T_WB_ = RigidTransform(Eigen::Matrix3d(rotationAboutZ(turn_) * true_T_WB.R()),
                         Eigen::Vector3d::Zero());
}

/// Adds the true increment, rotated by the yaw error and multiplied by 1 + scale. Then adds a
/// random step to the yaw error.
void DriftingOdometry::advance(const RigidTransform& true_T_WB, double seconds) {
  const Eigen::Vector3d true_step = true_T_WB.p - true_T_WB_.p;
  const double walk = config_.yaw_walk * std::sqrt(true_step.norm());
  const Eigen::Vector3d step = (1.0 + config_.scale) * (rotationAboutZ(turn_) * true_step);
  const double noise = walk * dice_.normal();
  covariance_.advance(step, walk);
  turn_ = wrapAngle(turn_ + noise);
  T_WB_before_ = T_WB_;
  T_WB_ = RigidTransform(Eigen::Matrix3d(rotationAboutZ(turn_) * true_T_WB.R()),
                         Eigen::Vector3d(T_WB_.p + step));
  if (seconds > 0.0) v_WB_ = rotationAboutZ(noise) * step / seconds;
  true_T_WB_ = true_T_WB;
}

Odometry DriftingOdometry::tell(const FrameStamp& stamp) const {
  Odometry odometry;
  odometry.stamp = stamp;
  odometry.instance = instance_;
  odometry.world = session_;
  odometry.state = OdometryState::kTracking;
  odometry.T_WB = T_WB_;
  odometry.v_WB = v_WB_;
  const Eigen::Matrix<double, 6, 4> M = intoPose();
  const Matrix6d D = intoBody(T_WB_);
  Eigen::Matrix<double, 9, 5> J = Eigen::Matrix<double, 9, 5>::Zero();
  J.topLeftCorner<6, 4>() = D * M;
  J.block<3, 1>(6, 0) = turned(v_WB_);
  J.block<3, 1>(6, 4) = v_WB_;
  odometry.covariance = J * covariance_.joint() * J.transpose();
  odometry.covariance.topLeftCorner<6, 6>() +=
      D * tilt(accuracy_.sigma_rotation * accuracy_.sigma_rotation) * D.transpose();
  odometry.covariance.diagonal().tail<3>().array() +=
      accuracy_.sigma_velocity * accuracy_.sigma_velocity;
  if (!before_) return odometry;
  odometry.has_increment = true;
  odometry.increment_from = before_->sequence;
  odometry.transition = D * (M * covariance_.transition() * M.transpose() + tilt(1.0)) *
                        intoBody(T_WB_before_).transpose();
  odometry.increment_covariance = D * (M * covariance_.noise() * M.transpose()) * D.transpose();
  return odometry;
}

}  // namespace perdure::tools
