#include "services/vio/core/update/triangulation.h"

#include <Eigen/Dense>
#include <cmath>

#include "common/math/so3.h"
#include "services/vio/core/update/visual.h"

namespace perdure::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kIterations = 6;

Vector3d nearestToRays(const std::vector<Ray>& rays, double& condition) {
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (const Ray& ray : rays) {
    const Vector3d d = (ray.T_WC.q * ray.normalised.homogeneous()).normalized();
    const Matrix3d M = Matrix3d::Identity() - d * d.transpose();
    A += M;
    b += M * ray.T_WC.p;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(A, Eigen::EigenvaluesOnly);
  condition = eigen.eigenvalues()[2] / std::max(eigen.eigenvalues()[0], 1e-15);
  return A.ldlt().solve(b);
}

/// Pose of one view's camera C relative to A, the camera of the newest view. The point is (x/z,
/// y/z, 1/z) in A.
struct Relative {
  Matrix3d R;  ///< R_CA
  Vector3d t;  ///< p_CA
  Eigen::Vector2d uv;
  double weight;
};

struct Normal {
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  double cost = 0.0;
  bool in_front = true;
};

/// Expected inverse depth and its weight 1 / σ; a weight of 0 means no prior.
struct Prior {
  double inverse_depth, weight;
};

Normal linearise(const std::vector<Relative>& views, const Vector3d& m, const Prior& prior) {
  Normal n;
  const double r_prior = prior.weight * (prior.inverse_depth - m.z());
  n.A(2, 2) = prior.weight * prior.weight;
  n.b.z() = prior.weight * r_prior;
  n.cost = r_prior * r_prior;
  for (const Relative& v : views) {
    const Vector3d h = v.R * Vector3d(m.x(), m.y(), 1.0) + v.t * m.z();
    if (!(h.z() > 1e-6)) {
      n.in_front = false;
      return n;
    }
    const Eigen::Vector2d uv = h.hnormalized(), r = v.weight * (v.uv - uv);
    Matrix3d dh;
    dh << v.R.col(0), v.R.col(1), v.t;
    Eigen::Matrix<double, 2, 3> J_h;
    J_h << 1, 0, -uv.x(), 0, 1, -uv.y();
    const Eigen::Matrix<double, 2, 3> J = (v.weight / h.z()) * J_h * dh;
    n.A += J.transpose() * J;
    n.b += J.transpose() * r;
    n.cost += r.squaredNorm();
  }
  return n;
}

}  // namespace

Result<Triangulated> triangulate(const std::vector<Ray>& rays, const VisionOptions& options,
                                 std::optional<double> scene) {
  if (rays.size() < 2) return fail("triangulation_views");
  double condition = 0.0;
  const Vector3d linear = nearestToRays(rays, condition);
  const bool parallel = !(condition < options.max_condition);
  if (parallel && !scene) return fail("triangulation_parallel");
  const RigidTransform& T_WA = rays.back().T_WC;
  std::vector<Relative> views;
  views.reserve(rays.size());
  for (const Ray& ray : rays) {
    const RigidTransform T_CA = ray.T_WC.inverse() * T_WA;
    views.push_back({T_CA.R(), T_CA.p, ray.normalised, ray.weight});
  }
  const Vector3d p_A = T_WA.inverse() * linear;
  if (!parallel && !(p_A.z() > 0.5 * options.min_depth_m)) return fail("triangulation_depth");
  Vector3d m(p_A.x() / p_A.z(), p_A.y() / p_A.z(), 1.0 / p_A.z());
  if (parallel) m << rays.back().normalised, *scene;
  // The prior is used for parallel rays only.
  const Prior prior{m.z(), parallel ? 1.0 / (options.scene_scatter * *scene) : 0.0};
  Normal n = linearise(views, m, prior);
  double lambda = 1e-4;
  for (int i = 0; i < kIterations && n.in_front; ++i) {
    Matrix3d damped = n.A;
    damped.diagonal() *= 1.0 + lambda;
    Vector3d to = m + damped.ldlt().solve(n.b);
    if (parallel) to.z() = std::max(to.z(), 1.0 / options.max_depth_m);
    const Normal next = linearise(views, to, prior);
    if (next.in_front && next.cost <= n.cost) {
      m = to;
      const bool done = n.cost - next.cost < 1e-4 * (1.0 + n.cost);
      n = next;
      lambda *= 0.1;
      if (done) break;
    } else {
      lambda *= 20.0;
    }
  }
  const double depth = 1.0 / m.z();
  if (!n.in_front || !(depth > options.min_depth_m)) return fail("triangulation_depth");
  if (!parallel && !(depth < options.max_depth_m)) return fail("triangulation_far");
  const Matrix3d cov_m = n.A.inverse();
  const double relative = std::sqrt(cov_m(2, 2)) * depth;  // σ(1/z) · z = σ(z) / z
  if (!parallel && !(relative < options.max_relative_sigma)) return fail("triangulation_condition");
  Matrix3d J;  // d point in A / d m
  J << depth, 0, -m.x() * depth * depth, 0, depth, -m.y() * depth * depth, 0, 0, -depth * depth;
  const Matrix3d J_W = T_WA.R() * J;
  const double rms = std::sqrt(n.cost / (2.0 * static_cast<double>(rays.size())));
  return Triangulated{T_WA * (depth * Vector3d(m.x(), m.y(), 1.0)), J_W * cov_m * J_W.transpose(),
                      relative, rms};
}

std::vector<Ray> raysOf(const Track& track, const State& state, double sigma_px) {
  std::vector<Ray> rays;
  rays.reserve(2 * track.observations.size());
  for (const Observation& o : track.observations) {
    const Clone* clone = state.clone(o.frame);
    if (!clone) continue;
    for (std::size_t c = 0; c < state.T_BC.size(); ++c) {
      if (!o.seen[c]) continue;
      const ImagePoint& seen = *o.seen[c];
      const RigidTransform T_BC =
          state.rolls(c) ? state.rowCamera(*clone, c, seen.row).T_BC : state.T_BC[c];
      rays.push_back(
          {clone->T_WB * T_BC, normalisedOf(state, *clone, c, seen), seen.scale / sigma_px});
    }
  }
  return rays;
}

Eigen::Matrix<double, 3, 6> crossOfRigid(const Eigen::Vector3d& p_W, const RigidTransform& T_WB,
                                         const Matrix6d& pose_covariance) {
  Eigen::Matrix<double, 3, 6> J;
  J << -T_WB.R() * skew(T_WB.inverse() * p_W), Eigen::Matrix3d::Identity();
  return J * pose_covariance;
}

}  // namespace perdure::vio
