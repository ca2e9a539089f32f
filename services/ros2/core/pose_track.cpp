#include "services/ros2/core/pose_track.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "common/math/so3.h"

namespace perdure::ros2 {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
constexpr std::size_t kKnots = 1024, kFrames = 64;
constexpr Duration kLongestGap = std::chrono::milliseconds(500);
constexpr double kUnknownVariance = 1e6;  ///< ROS filters write such values for unknown variances

Eigen::Vector3d vectorOf(const ros::Vector3& v) { return {v.x, v.y, v.z}; }

/// Returns the covariance of a message; `otherwise` if it is zero or marked as unknown. Axes with
/// unknown variances get the variances of `otherwise`.
Result<Matrix6> covarianceOf(const std::array<double, 36>& numbers, const Matrix6& otherwise) {
  Matrix6 given = Eigen::Map<const Matrix6>(numbers.data());
  if (!given.allFinite())
    return fail("covariance", "the covariance has values that are not finite");
  if (given.diagonal().maxCoeff() <= 0.0 || numbers[0] == -1.0) return otherwise;
  for (Eigen::Index i = 0; i < 6; ++i) {
    if (given(i, i) < kUnknownVariance) continue;
    given.row(i).setZero();
    given.col(i).setZero();
    given(i, i) = otherwise(i, i);
  }
  const double most = given.diagonal().maxCoeff(), least = given.diagonal().minCoeff();
  const Matrix6 even = (given + given.transpose()) / 2;
  const double smallest = Eigen::SelfAdjointEigenSolver<Matrix6>(even).eigenvalues().minCoeff();
  if (least < 0.0 || smallest < -1e-6 * most)
    return fail("covariance", "the covariance of its pose is none: not positive");
  return even;
}

}  // namespace

Result<void> PoseTrack::onOdometry(const ros::Odometry& message, TimePoint time,
                                   const RigidTransform& T_child_body) {
  const auto& p = message.pose.pose.position;
  const auto& q = message.pose.pose.orientation;
  const Eigen::Vector3d v = vectorOf(message.twist.twist.linear),
                        w = vectorOf(message.twist.twist.angular);
  const std::array<double, 7> numbers{p.x, p.y, p.z, q.x, q.y, q.z, q.w};
  if (!std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); }) || !v.allFinite() ||
      !w.allFinite()) {
    return fail("not_finite", "odometry has values that are not finite; it is left out");
  }
  const double norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  if (!(std::abs(norm - 1.0) < 0.02)) {
    return fail("no_rotation",
                "the orientation of odometry is no rotation: its quaternion is "
                "not of length 1");
  }
  Matrix6 configured = Matrix6::Zero();
  configured.diagonal().head<3>().setConstant(options_.sigma_position * options_.sigma_position);
  configured.diagonal().tail<3>().setConstant(options_.sigma_rotation * options_.sigma_rotation);
  const auto covariance = covarianceOf(message.pose.covariance, configured);
  if (!covariance) return tl::unexpected(covariance.error());
  const RigidTransform T_W_child(Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized(),
                                 {p.x, p.y, p.z});
  Odometry one;
  one.state = OdometryState::kTracking;
  one.T_WB = T_W_child * T_child_body;
  // The velocity of the body includes its rotation about the child frame.
  one.v_WB = T_W_child.q * (v + w.cross(T_child_body.p));
  // Transforms errors [p, θ in W] of the child frame to errors [θ in the body, p] of the body.
  const Eigen::Matrix3d R = one.T_WB.R();
  Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Zero();
  J.block<3, 3>(0, 3) = R.transpose();
  J.block<3, 3>(3, 0).setIdentity();
  J.block<3, 3>(3, 3) = -skew(T_W_child.q * T_child_body.p);
  one.covariance.topLeftCorner<6, 6>() = J * *covariance * J.transpose();
  one.covariance.diagonal().array() += 1e-12;
  constexpr double kSigmaSpeed = 0.2;  // m/s; the value is not critical
  one.covariance.bottomRightCorner<3, 3>().diagonal().array() += kSigmaSpeed * kSigmaSpeed;

  Result<void> said;
  if (!knots_.empty()) {
    const Knot& last = knots_.back();
    const double dt = toSeconds(time - last.time);
    const Eigen::Vector3d led = last.odometry.T_WB.p + last.odometry.v_WB * dt;
    if (dt <= 0.0) {
      ++world_.epoch;
      knots_.clear();
    } else if ((one.T_WB.p - led).norm() > options_.jump_m + 2.0 * dt * last.odometry.v_WB.norm()) {
      ++world_.epoch;
      said = fail("jumped",
                  "odometry jumped, which it must not (REP-105: odom is continuous); a "
                  "new frame of reference begins. Does the topic give poses in map?");
    }
  }
  one.world = world_;
  knots_.push_back({time, world_, one});
  if (knots_.size() > kKnots) knots_.pop_front();
  return said;
}

Result<void> PoseTrack::onFrame(const FrameStamp& stamp) {
  frames_.push_back(stamp);
  if (frames_.size() <= kFrames) return {};
  frames_.pop_front();
  ++untold_;
  return fail("late",
              "frames wait for odometry that does not come; start the node that "
              "publishes it, or fix its stamps");
}

std::optional<Odometry> PoseTrack::at(TimePoint time) const {
  const auto after = std::ranges::lower_bound(knots_, time, {}, &Knot::time);
  if (after == knots_.end()) return std::nullopt;
  if (after->time == time) return after->odometry;
  if (after == knots_.begin()) return std::nullopt;
  const Knot& a = *(after - 1);
  const Knot& b = *after;
  if (a.world != b.world || b.time - a.time > kLongestGap) return std::nullopt;
  const double share = toSeconds(time - a.time) / toSeconds(b.time - a.time);
  Odometry one = share < 0.5 ? a.odometry : b.odometry;
  one.T_WB = {a.odometry.T_WB.q.slerp(share, b.odometry.T_WB.q),
              a.odometry.T_WB.p + share * (b.odometry.T_WB.p - a.odometry.T_WB.p)};
  one.v_WB = a.odometry.v_WB + share * (b.odometry.v_WB - a.odometry.v_WB);
  return one;
}

std::vector<Odometry> PoseTrack::take() {
  std::vector<Odometry> told;
  while (!frames_.empty() && !knots_.empty() && frames_.front().time <= knots_.back().time) {
    if (auto one = at(frames_.front().time)) {
      one->stamp = frames_.front();
      told.push_back(*one);
    } else {
      ++untold_;
    }
    frames_.pop_front();
  }
  return told;
}

}  // namespace perdure::ros2
