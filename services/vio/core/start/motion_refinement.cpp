#include "services/vio/core/start/motion_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "services/vio/core/start/motion_terms.h"

namespace perdure::vio {
namespace {

using namespace motion;
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kGyroBiasPrior = 0.3;  // rad/s, prior deviation of the gyro bias
constexpr int kIterations = 50;
constexpr double kLittleDamping = 1e-3;
constexpr double kLargestStretch = 1.0;  // largest logarithm of the window's scaling by a step
constexpr double kInertialCost = 6.0;    // usual upper limit of inertialCost()
constexpr double kLeastGain = 0.1;       // smallest expected gain of a step, in cost

double huber(double deviations) {
  return deviations <= kHuber ? deviations * deviations : kHuber * (2.0 * deviations - kHuber);
}

/// Returns the prior information on an inverse depth. Without this prior, a window with zero motion
/// and zero depths would fit too.
double nearness(const Options& o) { return o.vision.min_depth_m * o.vision.min_depth_m; }

double priorCost(const MotionWindow& w, const Options& o) {
  return w.gyro_bias.squaredNorm() / (kGyroBiasPrior * kGyroBiasPrior) +
         w.accel_bias.squaredNorm() / (o.start.accel_bias_sigma * o.start.accel_bias_sigma) +
         w.time_offset_s * w.time_offset_s /
             (o.calibration.time_offset_s * o.calibration.time_offset_s);
}

double inertialCost(const Estimate& e, const Inertial& inertial, const Options& o) {
  double cost = priorCost(e.window, o);
  for (std::size_t i = 0; i < inertial.increments.size(); ++i) {
    const Vector9 r = inertialResidual(e.window, i, inertial.increments[i]);
    cost += r.dot(inertial.information[i] * r);
  }
  return cost;
}

double costOf(const Estimate& e, const Inertial& inertial, const Options& o) {
  double cost = inertialCost(e, inertial, o);
  for (std::size_t j = 0; j < e.rays.size(); ++j) {
    cost += e.rays[j].abr[2] * e.rays[j].abr[2] * nearness(o);
    for (const WindowView& v : e.window.points[j].views) {
      const auto term = viewTerm(e, j, v, inertial, o.vision.sigma_px);
      // A point behind a camera has the cost of a large residual, because a later step may move it
      // back.
      cost += term ? huber(term->r.norm()) : huber(1000.0);
    }
  }
  return cost;
}

/// Normal equations with the points eliminated, and the factors that give the points' part of a
/// step.
struct Normal {
  MatrixXd H;  ///< only the lower half is valid
  VectorXd b;
  MatrixXd eliminated;  ///< three rows for each point; their square has been subtracted from H
  struct Point {
    Matrix3d F_inverse;
    Eigen::Matrix<double, 3, Eigen::Dynamic> F_x;
    Vector3d F_b;
  };
  std::vector<Point> points;
};

void addInertial(Normal& n, const MotionWindow& w, std::size_t i, const ImuIncrement& x,
                 const Matrix9& information) {
  const Vector9 r = inertialResidual(w, i, x);
  const Eigen::Matrix<double, 9, Eigen::Dynamic> J = inertialJacobian(w, i, x, n.b.size());
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
  const Eigen::LLT<Matrix3d> llt(F);
  point.F_inverse = llt.solve(Matrix3d::Identity());
  n.eliminated.middleRows<3>(3 * static_cast<Index>(j)) = llt.matrixL().solve(point.F_x);
  n.b -= point.F_x.transpose() * (point.F_inverse * point.F_b);
  n.points.push_back(std::move(point));
}

Normal normalOf(const Estimate& e, const Inertial& inertial, const Options& o, double damping) {
  const Index size = poseAt(e.window.poses.size());
  const auto rows = 3 * static_cast<Index>(e.rays.size());
  Normal n{MatrixXd::Zero(size, size), VectorXd::Zero(size), MatrixXd(rows, size), {}};
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
  n.H.selfadjointView<Eigen::Lower>().rankUpdate(n.eliminated.transpose(), -1.0);
  n.H.diagonal() *= 1.0 + damping;
  return n;
}

/// Returns the component of a step that scales the whole window (positions, points and velocities),
/// as a logarithm.
double stretchOf(const MotionWindow& w, const VectorXd& dx) {
  double along = 0.0, square = 1e-12;
  for (std::size_t k = 1; k < w.poses.size(); ++k) {
    along += w.poses[k].p_B0.dot(dx.segment<3>(poseAt(k) + 3));
    square += w.poses[k].p_B0.squaredNorm();
  }
  return std::clamp(along / square, -kLargestStretch, kLargestStretch);
}

/// Adds a step. Its component along the scale is applied as a factor, which preserves the fit to
/// the images.
void move(Estimate& e, const VectorXd& dx, const Normal& n) {
  const double stretch = stretchOf(e.window, dx), factor = std::exp(stretch);
  VectorXd rest = dx;
  rest.segment<3>(kV0) += (factor - 1.0 - stretch) * e.window.poses[0].v_B0;
  for (std::size_t k = 1; k < e.window.poses.size(); ++k) {
    const Index at = poseAt(k);
    rest.segment<3>(at + 3) += (factor - 1.0 - stretch) * e.window.poses[k].p_B0;
    rest.segment<3>(at + 6) += (factor - 1.0 - stretch) * e.window.poses[k].v_B0;
  }
  add(e.window, rest);
  for (std::size_t j = 0; j < e.rays.size(); ++j) {
    const Normal::Point& p = n.points[j];
    double& inverse_depth = e.rays[j].abr[2];
    const double straight = (1.0 / factor - 1.0 + stretch) * inverse_depth;
    e.rays[j].abr += p.F_inverse * (p.F_b - p.F_x * dx);
    inverse_depth += straight;
  }
}

/// Extracts the covariance of the newest pose and of the window's parameters from that of all
/// errors.
WindowCovariance marginal(const MatrixXd& covariance, std::size_t last) {
  std::vector<Index> at;
  for (Index i = 0; i < 3; ++i) at.push_back(poseAt(last) + i);
  for (Index i = 0; i < 3; ++i) at.push_back(poseAt(last) + 6 + i);
  for (Index i = kGravity; i < kOffset; ++i) at.push_back(i);
  return covariance(at, at);
}

struct Minimum {
  Estimate estimate;
  Inertial inertial;
  double cost = 0.0;
};

Result<Minimum> minimise(Estimate e, const ImuBuffer& imu, const Options& options) {
  auto inertial = inertialOf(e.window, imu, options.imu);
  if (!inertial) return tl::unexpected(inertial.error());
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
      damping *= 0.01;  // the step may be small because of the damping only
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
  return Minimum{std::move(e), std::move(*inertial), cost};
}

/// Returns the root of the views' squared residuals, in deviations, per remaining degree of
/// freedom.
double imageNoise(const Minimum& m, double sigma_px) {
  double sum = 0.0, freedom = -6.0 * static_cast<double>(m.estimate.window.poses.size());
  for (std::size_t j = 0; j < m.estimate.rays.size(); ++j) {
    for (const WindowView& v : m.estimate.window.points[j].views) {
      const auto term = viewTerm(m.estimate, j, v, m.inertial, sigma_px);
      sum += term ? huber(term->r.norm()) : huber(1000.0);
      freedom += 2.0;
    }
    freedom -= 3.0;
  }
  return std::sqrt(sum / std::max(1.0, freedom));
}

Result<RefinedWindow> refinedBy(Minimum m, const Options& options) {
  const Estimate& e = m.estimate;
  std::size_t rows = 9 * m.inertial.increments.size() + 7;
  for (const WindowPoint& p : e.window.points) rows += 2 * p.views.size();
  const double unknowns =
      static_cast<double>(poseAt(e.window.poses.size())) + 3.0 * static_cast<double>(e.rays.size());
  RefinedWindow result;
  result.cost = m.cost;
  result.noise_ratio = std::sqrt(m.cost / std::max(1.0, static_cast<double>(rows) - unknowns));
  const Normal n = normalOf(e, m.inertial, options, 0.0);
  const Eigen::LDLT<MatrixXd> ldlt(n.H);
  if (ldlt.info() != Eigen::Success || !ldlt.isPositive()) return fail("start_unobservable");
  const MatrixXd covariance = ldlt.solve(MatrixXd::Identity(n.H.rows(), n.H.cols()));
  if (!covariance.allFinite() || !(covariance.diagonal().minCoeff() > 0.0)) {
    return fail("start_unobservable");
  }
  // The inertial rows have their own ratio, because they are too few to affect that of two thousand
  // image rows.
  const double inertial_ratio = inertialCost(e, m.inertial, options) / kInertialCost;
  const double scale = std::max({1.0, result.noise_ratio * result.noise_ratio, inertial_ratio});
  result.covariance = scale * marginal(covariance, e.window.poses.size() - 1);
  result.image_noise = imageNoise(m, options.vision.sigma_px);
  result.window = windowOf(std::move(m.estimate));
  return result;
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
  auto minimum = minimise(std::move(e), imu, options);
  if (!minimum) return tl::unexpected(minimum.error());
  return refinedBy(std::move(*minimum), options);
}

}  // namespace perdure::vio
