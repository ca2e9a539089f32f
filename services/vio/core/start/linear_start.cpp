#include "services/vio/core/start/linear_start.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace perdure::vio {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

namespace {

/// Computes the rows of one view: [A_f | A_x] [f; v0; g] = b, in pixels times depth.
void rowsOf(const LinearView& v, Eigen::Matrix<double, 2, 3>& A_f, Eigen::Matrix<double, 2, 6>& A_x,
            Eigen::Vector2d& b) {
  Eigen::Matrix<double, 2, 3> J;
  J << 1, 0, -v.normalised.x(), 0, 1, -v.normalised.y();
  A_f = v.scale * J * v.R_CB0;
  A_x << -A_f * v.t, -A_f * (0.5 * v.t * v.t);
  b = A_f * (v.dp + v.p_BC_B0);
}

}  // namespace

Views viewsOf(const std::vector<Keyframe>& keyframes, const std::vector<CameraModel>& cameras) {
  Views views;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    for (const TrackedPoint& p : keyframes[k].tracked->points) {
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        if (!p.seen[c]) continue;
        const RigidTransform& T_BC = cameras[c].T_BC();
        const Keyframe& at = keyframes[k];
        const double later_s = p.seen[c]->row * cameras[c].calibration().readout_s;
        const Matrix3d R = later_s == 0.0 ? at.R : Matrix3d(at.R * expSo3(later_s * at.rate));
        views[p.id].push_back({T_BC.R().transpose() * R.transpose(), R * T_BC.p, at.t + later_s,
                               at.dp + later_s * at.dv, p.seen[c]->normalised, p.seen[c]->scale});
      }
    }
  }
  std::erase_if(views, [&](const auto& v) { return v.second.size() < keyframes.size() * 2 / 3; });
  return views;
}

LinearStart solveOnce(const Views& views, std::map<std::uint64_t, PointEstimate>& points,
                      const Vector6& x_before, double gravity) {
  Matrix6 N = Matrix6::Zero();
  Vector6 y = Vector6::Zero();
  struct Eliminated {
    Matrix3d F_inverse;
    Eigen::Matrix<double, 3, 6> F_x;
    Vector3d F_b;
  };
  std::map<std::uint64_t, Eliminated> eliminated;
  const auto depthOf = [&](const LinearView& v, const PointEstimate& p, const Vector6& x) {
    const Vector3d body = x.head<3>() * v.t + 0.5 * v.t * v.t * x.tail<3>() + v.dp;
    return (v.R_CB0 * (p.f - body - v.p_BC_B0)).z();
  };
  for (const auto& [id, list] : views) {
    Matrix3d F = Matrix3d::Zero();
    Eigen::Matrix<double, 3, 6> F_x = Eigen::Matrix<double, 3, 6>::Zero();
    Vector3d F_b = Vector3d::Zero();
    Matrix6 X = Matrix6::Zero();
    Vector6 X_b = Vector6::Zero();
    const PointEstimate& p = points[id];
    for (const LinearView& v : list) {
      Eigen::Matrix<double, 2, 3> A_f;
      Eigen::Matrix<double, 2, 6> A_x;
      Eigen::Vector2d b;
      rowsOf(v, A_f, A_x, b);
      const double depth = p.known ? std::max(std::abs(depthOf(v, p, x_before)), 0.2) : 1.0;
      const double w = 1.0 / (depth * depth);
      F += w * A_f.transpose() * A_f;
      F_x += w * A_f.transpose() * A_x;
      F_b += w * A_f.transpose() * b;
      X += w * A_x.transpose() * A_x;
      X_b += w * A_x.transpose() * b;
    }
    if (!(F.ldlt().vectorD().minCoeff() > 1e-9 * F.trace())) continue;
    const Matrix3d F_inverse = F.inverse();
    N += X - F_x.transpose() * F_inverse * F_x;
    y += X_b - F_x.transpose() * F_inverse * F_b;
    eliminated[id] = {F_inverse, F_x, F_b};
  }
  LinearStart s;
  s.information = N;
  const Matrix3d N_vv_inverse = N.topLeftCorner<3, 3>().inverse();
  const Matrix3d N_gv = N.bottomLeftCorner<3, 3>();
  s.x.tail<3>() =
      solveOnSphere(N.bottomRightCorner<3, 3>() - N_gv * N_vv_inverse * N_gv.transpose(),
                    y.tail<3>() - N_gv * N_vv_inverse * y.head<3>(), gravity);
  s.x.head<3>() = N_vv_inverse * (y.head<3>() - N_gv.transpose() * s.x.tail<3>());
  double sum = 0.0;
  std::size_t rows = 0, front = 0;
  for (auto& [id, e] : eliminated) {
    PointEstimate& p = points[id];
    p.f = e.F_inverse * (e.F_b - e.F_x * s.x);
    p.known = true;
    bool in_front = true;
    for (const LinearView& v : views.at(id)) {
      const Vector3d body = s.x.head<3>() * v.t + 0.5 * v.t * v.t * s.x.tail<3>() + v.dp;
      const Vector3d p_C = v.R_CB0 * (p.f - body - v.p_BC_B0);
      in_front = in_front && p_C.z() > 0.0;
      sum += std::min((p_C.hnormalized() - v.normalised).squaredNorm() * v.scale * v.scale, 400.0);
      rows += 2;
    }
    front += in_front;
  }
  s.rms_px = rows ? std::sqrt(sum / static_cast<double>(rows)) : 1e9;
  s.in_front = eliminated.empty()
                   ? 0.0
                   : static_cast<double>(front) / static_cast<double>(eliminated.size());
  return s;
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
