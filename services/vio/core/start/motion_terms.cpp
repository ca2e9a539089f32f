#include "services/vio/core/start/motion_terms.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "common/math/so3.h"

namespace perdure::vio::motion {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kLeastDepth = 0.1;     // m, initial depth of a point
constexpr double kGreatestDepth = 1e4;  // m, depth given to a point at infinity

void add(MotionWindow& w, const Eigen::VectorXd& dx) {
  const double length = w.gravity_B0.norm();
  w.poses[0].v_B0 += dx.segment<3>(kV0);
  w.gravity_B0 += acrossGravity(w.gravity_B0) * dx.segment<2>(kGravity);
  w.gravity_B0 *= length / w.gravity_B0.norm();
  w.gyro_bias += dx.segment<3>(kGyro);
  w.accel_bias += dx.segment<3>(kAccel);
  w.time_offset_s += dx[kOffset];
  for (std::size_t k = 1; k < w.poses.size(); ++k) {
    const Index at = poseAt(k);
    w.poses[k].R_B0_B *= expSo3(dx.segment<3>(at));
    w.poses[k].p_B0 += dx.segment<3>(at + 3);
    w.poses[k].v_B0 += dx.segment<3>(at + 6);
  }
}

std::vector<Ray> raysOf(const MotionWindow& window) {
  std::vector<Ray> rays;
  for (const WindowPoint& point : window.points) {
    const WindowView& v = point.views.front();
    const WindowPose& pose = window.poses[v.keyframe];
    Ray ray{v.p_BC, pose.R_B0_B * v.R_BC, {}};
    const Vector3d p_C = ray.R_B0_C.transpose() * (point.p_B0 - ray.origin);
    if (p_C.z() > kLeastDepth) {
      ray.abr << p_C.hnormalized(), 1.0 / p_C.z();
    } else {
      ray.abr << v.normalised, 0.0;
    }
    rays.push_back(ray);
  }
  return rays;
}

MotionWindow windowOf(Estimate e) {
  for (std::size_t j = 0; j < e.rays.size(); ++j) {
    const Ray& ray = e.rays[j];
    const double depth = 1.0 / std::max(ray.abr[2], 1.0 / kGreatestDepth);
    const Vector3d bearing(ray.abr[0], ray.abr[1], 1.0);
    e.window.points[j].p_B0 = ray.origin + depth * (ray.R_B0_C * bearing);
  }
  return std::move(e.window);
}

Result<Inertial> inertialOf(const MotionWindow& w, const ImuBuffer& imu, const ImuNoise& noise) {
  Inertial result;
  for (std::size_t i = 1; i < w.poses.size(); ++i) {
    const auto readings = imu.between(w.poses[i - 1].time, w.poses[i].time);
    if (readings.size() < 2) return fail("start_window_short");
    result.increments.push_back(integrate(readings, w.gyro_bias, w.accel_bias, noise));
    if (i == 1) result.rates.push_back(readings.front().gyro - w.gyro_bias);
    result.rates.push_back(readings.back().gyro - w.gyro_bias);
    const Eigen::LDLT<Matrix9> ldlt(result.increments.back().Q.topLeftCorner<9, 9>());
    if (ldlt.info() != Eigen::Success || !ldlt.isPositive())
      return fail("start_imu_noise_singular");
    result.information.push_back(ldlt.solve(Matrix9::Identity()));
    if (!result.information.back().allFinite()) return fail("start_imu_noise_singular");
  }
  return result;
}

std::optional<ViewTerm> viewTerm(const Estimate& e, std::size_t point, const WindowView& v,
                                 const Inertial& inertial, double sigma_px) {
  const WindowPose& pose = e.window.poses[v.keyframe];
  const Vector3d& rate = inertial.rates[v.keyframe];
  const double later_s = e.window.time_offset_s + v.row_s;
  const Matrix3d R = pose.R_B0_B * expSo3(rate * later_s);
  const Vector3d p = pose.p_B0 + pose.v_B0 * later_s;
  const Ray& ray = e.rays[point];
  const double inverse = ray.abr[2];
  // Positions of the point relative to the body and to the camera, times the inverse depth.
  const Vector3d q = R.transpose() * (ray.R_B0_C * Vector3d(ray.abr[0], ray.abr[1], 1.0) +
                                      inverse * (ray.origin - p));
  const Vector3d p_C = v.R_BC.transpose() * (q - inverse * v.p_BC);
  if (!(p_C.z() > 0.01)) return std::nullopt;
  ViewTerm t;
  t.r = v.to_pixels * (p_C.hnormalized() - v.normalised) / sigma_px;
  Eigen::Matrix<double, 2, 3> J;
  J << 1, 0, -p_C.x() / p_C.z(), 0, 1, -p_C.y() / p_C.z();
  const Eigen::Matrix<double, 2, 3> by_q =
      v.to_pixels * J * v.R_BC.transpose() / (p_C.z() * sigma_px);
  Matrix3d by_abr = R.transpose() * ray.R_B0_C;
  by_abr.col(2) = R.transpose() * (ray.origin - p) - v.p_BC;
  t.by_ray = by_q * by_abr;
  t.by_pose << by_q * skew(q), -inverse * by_q * R.transpose();
  t.by_offset = t.by_pose.leftCols<3>() * rate + t.by_pose.rightCols<3>() * pose.v_B0;
  const double deviations = t.r.norm();
  t.weight = deviations <= kHuber ? 1.0 : kHuber / deviations;
  return t;
}

Vector9 inertialResidual(const MotionWindow& w, std::size_t i, const ImuIncrement& x) {
  const WindowPose &a = w.poses[i], &b = w.poses[i + 1];
  const Matrix3d Ra_t = a.R_B0_B.transpose();
  Vector9 r;
  r << logSo3(Eigen::Quaterniond(Matrix3d(x.dq.toRotationMatrix().transpose() * Ra_t * b.R_B0_B))),
      Ra_t * (b.p_B0 - a.p_B0 - a.v_B0 * x.dt - 0.5 * x.dt * x.dt * w.gravity_B0) - x.dp,
      Ra_t * (b.v_B0 - a.v_B0 - w.gravity_B0 * x.dt) - x.dv;
  return r;
}

Eigen::Matrix<double, 9, Eigen::Dynamic> inertialJacobian(const MotionWindow& w, std::size_t i,
                                                          const ImuIncrement& x, Index size) {
  const Matrix3d Ra_t = w.poses[i].R_B0_B.transpose();
  const Vector9 r = inertialResidual(w, i, x);
  Eigen::Matrix<double, 9, Eigen::Dynamic> J =
      Eigen::Matrix<double, 9, Eigen::Dynamic>::Zero(9, size);
  const Index b = poseAt(i + 1);
  J.block<3, 3>(0, b) = Matrix3d::Identity();
  J.block<3, 3>(3, b + 3) = Ra_t;
  J.block<3, 3>(6, b + 6) = Ra_t;
  if (i > 0) {
    const Index a = poseAt(i);
    J.block<3, 3>(0, a) = -w.poses[i + 1].R_B0_B.transpose() * w.poses[i].R_B0_B;
    J.block<3, 3>(3, a) = skew(Vector3d(r.segment<3>(3) + x.dp));
    J.block<3, 3>(6, a) = skew(Vector3d(r.segment<3>(6) + x.dv));
    J.block<3, 3>(3, a + 3) = -Ra_t;
  }
  const Index v = i > 0 ? poseAt(i) + 6 : kV0;
  J.block<3, 3>(3, v) = -Ra_t * x.dt;
  J.block<3, 3>(6, v) = -Ra_t;
  const Eigen::Matrix<double, 3, 2> B = acrossGravity(w.gravity_B0);
  J.block<3, 2>(3, kGravity) = -0.5 * x.dt * x.dt * Ra_t * B;
  J.block<3, 2>(6, kGravity) = -x.dt * Ra_t * B;
  J.block<9, 3>(0, kGyro) = -x.F.block<9, 3>(0, kGyroBias);
  J.block<9, 3>(0, kAccel) = -x.F.block<9, 3>(0, kAccelBias);
  return J;
}

}  // namespace perdure::vio::motion
