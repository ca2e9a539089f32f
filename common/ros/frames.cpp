#include "common/ros/frames.h"

#include <algorithm>

namespace perdure::ros {
namespace {

Quaternion quaternionOf(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

/// Transforms the optical frame (x right, y down) into the link frame (x forward, y left).
const RigidTransform& opticalInLink() {
  static const RigidTransform T(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d::Zero());
  return T;
}

}  // namespace

std::string linkFrame(const std::string& camera) { return camera + "_link"; }
std::string opticalFrame(const std::string& camera) { return camera + "_optical"; }

Time rosTime(TimePoint time) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = toNanoseconds(time);
  const std::int64_t rest = (ns % kSecond + kSecond) % kSecond;
  return {static_cast<std::int32_t>((ns - rest) / kSecond), static_cast<std::uint32_t>(rest)};
}

Header headerOf(TimePoint time, const std::string& frame) { return {rosTime(time), frame}; }

Point pointOf(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

Pose poseOf(const RigidTransform& T) { return {pointOf(T.p), quaternionOf(T.q)}; }

std::array<double, 36> numbersOf(const Matrix6& matrix) {
  std::array<double, 36> numbers{};
  std::copy_n(matrix.data(), numbers.size(), numbers.begin());
  return numbers;
}

/// The rotation vector is the product of yaw and `up`.
std::array<double, 36> poseCovarianceOf(const ClassBelief& belief, const Eigen::Vector3d& up,
                                        const Eigen::Matrix3d& R) {
  Eigen::Matrix<double, 6, 4> J = Eigen::Matrix<double, 6, 4>::Zero();
  J.topLeftCorner<3, 3>() = R;
  J.block<3, 1>(3, 3) = R * up;
  return numbersOf(J * belief.covariance.topLeftCorner<4, 4>() * J.transpose());
}

TransformStamped transformOf(TimePoint time, const std::string& parent, const std::string& child,
                             const RigidTransform& T) {
  return {headerOf(time, parent), child, {{T.p.x(), T.p.y(), T.p.z()}, quaternionOf(T.q)}};
}

TFMessage movingFrames(TimePoint time, const RigidTransform& T_MW, const RigidTransform& T_WB) {
  return {{transformOf(time, kMapFrame, kOdomFrame, T_MW),
           transformOf(time, kOdomFrame, kBodyFrame, T_WB)}};
}

TFMessage fixedFrames(const Calibration& calibration) {
  TFMessage message;
  message.transforms.push_back(transformOf({}, kBodyFrame, kImuFrame, {}));
  for (const CameraCalibration& camera : calibration.cameras) {
    const RigidTransform T_B_link = camera.T_BC * opticalInLink().inverse();
    message.transforms.push_back(transformOf({}, kBodyFrame, linkFrame(camera.name), T_B_link));
    message.transforms.push_back(
        transformOf({}, linkFrame(camera.name), opticalFrame(camera.name), opticalInLink()));
  }
  return message;
}

}  // namespace perdure::ros
