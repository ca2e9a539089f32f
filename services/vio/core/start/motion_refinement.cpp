#include "services/vio/core/start/motion_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "common/math/so3.h"
#include "services/vio/core/propagation/imu_propagator.h"

namespace perdure::vio {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

constexpr double kGyroBiasPrior = 0.3;  // rad/s: what a bias may be before anything is known
constexpr double kHuber = 2.0;          // deviations of a view beyond which it counts linearly
constexpr double kLeastDepth = 0.1;     // m, of a point at the beginning
constexpr int kIterations = 50;
constexpr double kLittleDamping = 1e-3;
constexpr double kLeastGain = 0.1;  // of the cost, below which no step is taken

// Order of the error: what belongs to the window, then [θ, p, v] of all poses but the first.
constexpr Index kV0 = 0, kGravity = 3, kGyro = 5, kAccel = 8, kOffset = 11, kPoses = 12;
constexpr Index poseAt(std::size_t k) { return kPoses + 9 * (static_cast<Index>(k) - 1); }

/// A point by bearing and inverse depth from where it was seen first. Far points stay linear, and
/// one that noise puts beyond infinity (inverse depth below 0) is nothing special.
struct Ray {
  Vector3d origin;  // in B0, fixed
  Matrix3d R_B0_C;  // fixed
  Vector3d abr;     // bearing x/z, y/z, and 1/z in 1/m
};

struct Estimate {
  MotionWindow window;
  std::vector<Ray> rays;
};

std::vector<Ray> raysOf(const MotionWindow& window) {
  std::vector<Ray> rays;
  for (const WindowPoint& point : window.points) {
    const WindowView& v = point.views.front();
    const WindowPose& pose = window.poses[v.keyframe];
    Ray ray{pose.p_B0 + pose.R_B0_B * v.p_BC, pose.R_B0_B * v.R_BC, {}};
    const Vector3d p_C = ray.R_B0_C.transpose() * (point.p_B0 - ray.origin);
    ray.abr << v.normalised, p_C.z() > kLeastDepth ? 1.0 / p_C.z() : 0.0;
    rays.push_back(ray);
  }
  return rays;
}

/// What follows from the biases: the increments between neighbours, and the rate at each pose.
struct Inertial {
  std::vector<ImuIncrement> increments;
  std::vector<Matrix9> information;
  std::vector<Vector3d> rates;  // of the body in B, rad/s
};

std::optional<Inertial> inertialOf(const MotionWindow& w, const ImuBuffer& imu,
                                   const ImuNoise& noise) {
  Inertial result;
  for (std::size_t i = 1; i < w.poses.size(); ++i) {
    const auto readings = imu.between(w.poses[i - 1].time, w.poses[i].time);
    if (readings.size() < 2) return std::nullopt;
    result.increments.push_back(integrate(readings, w.gyro_bias, w.accel_bias, noise));
    if (i == 1) result.rates.push_back(readings.front().gyro - w.gyro_bias);
    result.rates.push_back(readings.back().gyro - w.gyro_bias);
    const Eigen::LDLT<Matrix9> ldlt(result.increments.back().Q.topLeftCorner<9, 9>());
    if (ldlt.info() != Eigen::Success || !ldlt.isPositive()) return std::nullopt;
    result.information.push_back(ldlt.solve(Matrix9::Identity()));
    if (!result.information.back().allFinite()) return std::nullopt;
  }
  return result;
}

double huber(double deviations) {
  return deviations <= kHuber ? deviations * deviations : kHuber * (2.0 * deviations - kHuber);
}

/// Residual of a view in deviations, and its derivatives where they are asked for.
struct ViewTerm {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 3> by_ray;
  Eigen::Matrix<double, 2, 6> by_pose;  // θ, p
  Eigen::Vector2d by_offset;
  double weight = 1.0;
};

std::optional<ViewTerm> viewTerm(const Estimate& e, std::size_t point, const WindowView& v,
                                 const Inertial& inertial, double sigma_px) {
  const WindowPose& pose = e.window.poses[v.keyframe];
  const Vector3d& rate = inertial.rates[v.keyframe];
  const double later_s = e.window.time_offset_s + v.row_s;
  const Matrix3d R = pose.R_B0_B * expSo3(rate * later_s);
  const Vector3d p = pose.p_B0 + pose.v_B0 * later_s;
  const Ray& ray = e.rays[point];
  const double inverse = ray.abr[2];
  // The point relative to the body, and to the camera, times the inverse depth.
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

/// Information on an inverse depth: nothing is nearer than the least depth. Without it images fit
/// as well where all motion and all depths are nothing.
double nearness(const Options& o) { return o.vision.min_depth_m * o.vision.min_depth_m; }

double priorCost(const MotionWindow& w, const Options& o) {
  return w.gyro_bias.squaredNorm() / (kGyroBiasPrior * kGyroBiasPrior) +
         w.accel_bias.squaredNorm() / (o.start.accel_bias_sigma * o.start.accel_bias_sigma) +
         w.time_offset_s * w.time_offset_s /
             (o.calibration.time_offset_s * o.calibration.time_offset_s);
}

double costOf(const Estimate& e, const Inertial& inertial, const Options& o) {
  double cost = priorCost(e.window, o);
  for (std::size_t i = 0; i < inertial.increments.size(); ++i) {
    const Vector9 r = inertialResidual(e.window, i, inertial.increments[i]);
    cost += r.dot(inertial.information[i] * r);
  }
  for (std::size_t j = 0; j < e.rays.size(); ++j) {
    cost += e.rays[j].abr[2] * e.rays[j].abr[2] * nearness(o);
    for (const WindowView& v : e.window.points[j].views) {
      const auto term = viewTerm(e, j, v, inertial, o.vision.sigma_px);
      // A point behind a camera counts as one far off: a step may put it back.
      cost += term ? huber(term->r.norm()) : huber(1000.0);
    }
  }
  return cost;
}

/// The normal equations, points eliminated, and what a step needs to find their part again.
struct Normal {
  MatrixXd H;
  VectorXd b;
  struct Point {
    Matrix3d F_inverse;
    Eigen::Matrix<double, 3, Eigen::Dynamic> F_x;
    Vector3d F_b;
  };
  std::vector<Point> points;
};

void addInertial(Normal& n, const MotionWindow& w, std::size_t i, const ImuIncrement& x,
                 const Matrix9& information) {
  const Matrix3d Ra_t = w.poses[i].R_B0_B.transpose();
  const Vector9 r = inertialResidual(w, i, x);
  Eigen::Matrix<double, 9, Eigen::Dynamic> J =
      Eigen::Matrix<double, 9, Eigen::Dynamic>::Zero(9, n.b.size());
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
  n.H += J.transpose() * information * J;
  n.b -= J.transpose() * (information * r);
}

void addPoint(Normal& n, const Estimate& e, std::size_t j, const Inertial& inertial,
              const Options& o, double damping) {
  Normal::Point point;
  Matrix3d F = Matrix3d::Zero();
  point.F_x.setZero(3, n.b.size());
  point.F_b.setZero();
  F(2, 2) = nearness(o);
  point.F_b[2] = -nearness(o) * e.rays[j].abr[2];
  for (const WindowView& v : e.window.points[j].views) {
    const auto t = viewTerm(e, j, v, inertial, o.vision.sigma_px);
    if (!t) continue;
    F += t->weight * t->by_ray.transpose() * t->by_ray;
    point.F_b -= t->weight * t->by_ray.transpose() * t->r;
    point.F_x.col(kOffset) += t->weight * t->by_ray.transpose() * t->by_offset;
    n.H(kOffset, kOffset) += t->weight * t->by_offset.squaredNorm();
    n.b[kOffset] -= t->weight * t->by_offset.dot(t->r);
    if (v.keyframe == 0) continue;
    const Index at = poseAt(v.keyframe);
    point.F_x.middleCols<6>(at) += t->weight * t->by_ray.transpose() * t->by_pose;
    n.H.block<6, 6>(at, at) += t->weight * t->by_pose.transpose() * t->by_pose;
    const Eigen::Matrix<double, 6, 1> cross = t->weight * t->by_pose.transpose() * t->by_offset;
    n.H.block<6, 1>(at, kOffset) += cross;
    n.H.block<1, 6>(kOffset, at) += cross.transpose();
    n.b.segment<6>(at) -= t->weight * t->by_pose.transpose() * t->r;
  }
  F.diagonal() *= 1.0 + damping;
  point.F_inverse = F.inverse();
  n.H -= point.F_x.transpose() * point.F_inverse * point.F_x;
  n.b -= point.F_x.transpose() * (point.F_inverse * point.F_b);
  n.points.push_back(std::move(point));
}

Normal normalOf(const Estimate& e, const Inertial& inertial, const Options& o, double damping) {
  const Index size = poseAt(e.window.poses.size());
  Normal n{MatrixXd::Zero(size, size), VectorXd::Zero(size), {}};
  for (std::size_t i = 0; i < inertial.increments.size(); ++i) {
    addInertial(n, e.window, i, inertial.increments[i], inertial.information[i]);
  }
  const double gyro = 1.0 / (kGyroBiasPrior * kGyroBiasPrior);
  const double accel = 1.0 / (o.start.accel_bias_sigma * o.start.accel_bias_sigma);
  const double offset = 1.0 / (o.calibration.time_offset_s * o.calibration.time_offset_s);
  n.H.diagonal().segment<3>(kGyro).array() += gyro;
  n.b.segment<3>(kGyro) -= gyro * e.window.gyro_bias;
  n.H.diagonal().segment<3>(kAccel).array() += accel;
  n.b.segment<3>(kAccel) -= accel * e.window.accel_bias;
  n.H(kOffset, kOffset) += offset;
  n.b[kOffset] -= offset * e.window.time_offset_s;
  for (std::size_t j = 0; j < e.rays.size(); ++j) addPoint(n, e, j, inertial, o, damping);
  n.H.diagonal() *= 1.0 + damping;
  return n;
}

void move(Estimate& e, const VectorXd& dx, const Normal& n) {
  MotionWindow& w = e.window;
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
  for (std::size_t j = 0; j < e.rays.size(); ++j) {
    const Normal::Point& p = n.points[j];
    e.rays[j].abr += p.F_inverse * (p.F_b - p.F_x * dx);
  }
}

/// Of what the newest pose and the window say, from the covariance of all.
WindowCovariance marginal(const MatrixXd& covariance, std::size_t last) {
  std::vector<Index> at;
  for (Index i = 0; i < 3; ++i) at.push_back(poseAt(last) + i);
  for (Index i = 0; i < 3; ++i) at.push_back(poseAt(last) + 6 + i);
  for (Index i = kGravity; i < kOffset; ++i) at.push_back(i);
  return covariance(at, at);
}

}  // namespace

Eigen::Matrix<double, 3, 2> acrossGravity(const Vector3d& gravity_B0) {
  const Vector3d g = gravity_B0.normalized();
  Index least = 0;
  g.cwiseAbs().minCoeff(&least);
  const Vector3d a = g.cross(Vector3d::Unit(least)).normalized();
  Eigen::Matrix<double, 3, 2> B;
  B << a, g.cross(a);
  return gravity_B0.norm() * B;
}

Result<RefinedWindow> refine(MotionWindow window, const ImuBuffer& imu, const Options& options) {
  if (window.poses.size() < 2) return fail("start_window_short");
  std::erase_if(window.points, [](const WindowPoint& p) { return p.views.size() < 2; });
  Estimate e{std::move(window), {}};
  e.rays = raysOf(e.window);
  auto inertial = inertialOf(e.window, imu, options.imu);
  if (!inertial) return fail("start_window_short");
  double cost = costOf(e, *inertial, options), damping = 1e-5, growth = 2.0;
  bool settled = false;
  for (int i = 0; i < kIterations && damping < 1e3; ++i) {
    const Normal n = normalOf(e, *inertial, options, damping);
    const Eigen::LDLT<MatrixXd> ldlt(n.H);
    if (ldlt.info() != Eigen::Success) return fail("start_unobservable");
    const VectorXd dx = ldlt.solve(n.b);
    if (!dx.allFinite()) return fail("start_unobservable");
    double expected = dx.dot(n.b);
    for (const Normal::Point& p : n.points) expected += p.F_b.dot(p.F_inverse * p.F_b);
    if (expected < kLeastGain) {
      settled = damping < kLittleDamping;
      if (settled) break;
      damping *= 0.01;  // it may be the damping alone that makes the step small
      growth = 2.0;
      continue;
    }
    Estimate next = e;
    move(next, dx, n);
    auto next_inertial = inertialOf(next.window, imu, options.imu);
    const double next_cost = next_inertial ? costOf(next, *next_inertial, options) : HUGE_VAL;
    if (next_cost <= cost) {
      const double ratio = (cost - next_cost) / expected;
      e = std::move(next);
      inertial = std::move(next_inertial);
      cost = next_cost;
      damping *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3));
      growth = 2.0;
    } else {
      damping *= growth;
      growth *= 2.0;
    }
  }
  if (!settled) return fail("start_inconsistent");
  std::size_t rows = 9 * inertial->increments.size() + 7;
  for (const WindowPoint& p : e.window.points) rows += 2 * p.views.size();
  const double unknowns =
      static_cast<double>(poseAt(e.window.poses.size())) + 3.0 * static_cast<double>(e.rays.size());
  RefinedWindow result;
  result.cost = cost;
  result.noise_ratio = std::sqrt(cost / std::max(1.0, static_cast<double>(rows) - unknowns));
  const Normal n = normalOf(e, *inertial, options, 0.0);
  const Eigen::LDLT<MatrixXd> ldlt(n.H);
  if (ldlt.info() != Eigen::Success || !ldlt.isPositive()) return fail("start_unobservable");
  const MatrixXd covariance = ldlt.solve(MatrixXd::Identity(n.H.rows(), n.H.cols()));
  if (!covariance.allFinite() || !(covariance.diagonal().minCoeff() > 0.0)) {
    return fail("start_unobservable");
  }
  const double scale = std::max(1.0, result.noise_ratio * result.noise_ratio);
  result.covariance = scale * marginal(covariance, e.window.poses.size() - 1);
  result.window = std::move(e.window);
  return result;
}

}  // namespace perdure::vio
