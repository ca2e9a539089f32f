#include "services/vio/core/start/motion_path.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>

#include "services/vio/core/start/motion_refinement.h"

namespace perdure::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Unknowns = Eigen::Matrix<double, 5, 1>;  // v0, and the turn of gravity across itself (rad)
using Matrix5 = Eigen::Matrix<double, 5, 5>;

constexpr int kPasses = 6;
constexpr double kTurnOfGravity = 0.15;  // rad, deviation; a mean acceleration of 1.5 m/s²
constexpr double kMostParallax = 5.0;
constexpr double kTail = 9.0;  // residuals above three deviations count little

/// Motion of the camera between the keyframes of a pair: known + by_x · x.
struct PairMotion {
  Vector3d known;
  Eigen::Matrix<double, 3, 5> by_x;
};

PairMotion motionOf(const PathFrame& a, const PathFrame& b, const Vector3d& gravity) {
  const double half = 0.5 * (b.t * b.t - a.t * a.t);
  PairMotion m;
  m.known = b.dp - a.dp + b.lever - a.lever + half * gravity;
  m.by_x << (b.t - a.t) * Matrix3d::Identity(), half * acrossGravity(gravity);
  return m;
}

struct Rows {
  Matrix5 N = Matrix5::Zero();
  Unknowns y = Unknowns::Zero();
  double cost = 0.0;
};

/// Adds the rows n · motion = 0 of a pair, in deviations of a ray, weighted robustly. Before the
/// first solution (x = 0) a row's weight is that of its largest possible residual.
void addPair(Rows& rows, const PathPair& pair, const PairMotion& m, const Unknowns& x,
             double least_m, double sigma) {
  const Vector3d motion = m.known + m.by_x * x;
  const double scale = 1.0 / (sigma * std::max(motion.norm(), least_m));
  for (const auto& [first, second] : pair.rays) {
    const Vector3d n = first.cross(second);
    const double r = x.isZero(0.0) ? n.norm() / sigma : scale * n.dot(motion);
    const double near = 1.0 / (1.0 + r * r / kTail), weight = x.isZero(0.0) ? near : near * near;
    const Unknowns a = scale * m.by_x.transpose() * n;
    rows.N += weight * a * a.transpose();
    rows.cost += r * r * near;
    rows.y -= weight * scale * n.dot(m.known) * a;
  }
}

/// Returns the solution with |v0| = speed. The turn of gravity is eliminated.
Unknowns solve(const Rows& rows, double speed) {
  const Eigen::Matrix2d G = rows.N.bottomRightCorner<2, 2>() +
                            Eigen::Matrix2d::Identity() / (kTurnOfGravity * kTurnOfGravity);
  const Eigen::Matrix<double, 2, 3> C = rows.N.bottomLeftCorner<2, 3>();
  const Eigen::Matrix2d G_inverse = G.inverse();
  Unknowns x;
  x.head<3>() =
      solveOnSphere(rows.N.topLeftCorner<3, 3>() - C.transpose() * G_inverse * C,
                    rows.y.head<3>() - C.transpose() * G_inverse * rows.y.tail<2>(), speed);
  x.tail<2>() = G_inverse * (rows.y.tail<2>() - C * x.head<3>());
  return x;
}

/// Returns the sum of the points' parallaxes, in deviations up to kMostParallax; those of points
/// behind the first camera are negative.
double inFront(const PathPair& pair, const Vector3d& motion, double sigma) {
  double sum = 0.0;
  for (const auto& [first, second] : pair.rays) {
    const Vector3d across = motion.cross(second).normalized();
    sum += std::clamp(across.dot(first.cross(second)) / sigma, -kMostParallax, kMostParallax);
  }
  return sum;
}

}  // namespace

Path pathWithSpeed(double speed, const std::vector<PathFrame>& frames,
                   const std::vector<PathPair>& pairs, const Vector3d& gravity, double sigma) {
  std::vector<PairMotion> motions;
  for (const PathPair& p : pairs) {
    motions.push_back(motionOf(frames[p.from], frames[p.to], gravity));
  }
  Unknowns x = Unknowns::Zero();
  const auto rowsAt = [&](const Unknowns& at) {
    Rows rows;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double dt = frames[pairs[i].to].t - frames[pairs[i].from].t;
      addPair(rows, pairs[i], motions[i], at, 0.5 * speed * dt, sigma);
    }
    return rows;
  };
  for (int pass = 0; pass < kPasses; ++pass) x = solve(rowsAt(x), speed);
  // The planes do not tell forwards from backwards; the depths do.
  double in_front = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    in_front += inFront(pairs[i], motions[i].known + motions[i].by_x * x, sigma);
  }
  if (in_front < 0.0) x.head<3>() *= -1.0;
  const double turn = x.tail<2>().squaredNorm() / (kTurnOfGravity * kTurnOfGravity);
  const Vector3d turned = gravity + acrossGravity(gravity) * x.tail<2>();
  return {x.head<3>(), turned.normalized() * gravity.norm(), rowsAt(x).cost + turn};
}

Vector3d solveOnSphere(const Matrix3d& M, const Vector3d& d, double length) {
  // Stationary points satisfy (M + λ I) g = d. The minimum has λ above the negated smallest
  // eigenvalue, an interval on which |g(λ)| falls from infinity to zero.
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(M);
  const Vector3d e = eigen.eigenvalues(), c = eigen.eigenvectors().transpose() * d;
  const auto g = [&](double lambda) -> Vector3d {
    return (c.array() / (e.array() + lambda).max(1e-300)).matrix();
  };
  const double scale = std::max(e[2], d.norm() / length);
  double low = -e[0] + 1e-12 * scale, high = -e[0] + scale;
  while (g(high).norm() > length) high = -e[0] + 2.0 * (high + e[0]);
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (g(middle).norm() > length ? low : high) = middle;
  }
  const Vector3d solution = eigen.eigenvectors() * g(high);
  return solution * (length / std::max(solution.norm(), 1e-12));
}

}  // namespace perdure::vio
