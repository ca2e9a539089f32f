// Motion of the body as uniform cumulative B-splines of order 5 for rotation and position (Furgale
// et al., ICRA 2012; Sommer et al., CVPR 2020), templates for Ceres' dual numbers.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <vector>

#include "common/math/b_spline.h"
#include "common/math/rigid_transform.h"

namespace perdure::calibrate {

inline constexpr int kOrder = 5;
inline constexpr auto kPlainWeights = blendingMatrix<kOrder>();
inline constexpr auto kCumulativeWeights = cumulativeMatrix<kOrder>();

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// Unit quaternion of a rotation vector, smooth at zero.
template <class T>
Eigen::Quaternion<T> expQuaternionOf(const Vector3<T>& theta) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T n2 = theta.squaredNorm();
  if (n2 < T(1e-10)) {
    const T half = T(0.5) - n2 / T(48.0);
    return {T(1.0) - n2 / T(8.0), half * theta.x(), half * theta.y(), half * theta.z()};
  }
  const T n = sqrt(n2), s = sin(T(0.5) * n) / n;
  return {cos(T(0.5) * n), s * theta.x(), s * theta.y(), s * theta.z()};
}

/// Rotation vector of a quaternion, smooth at zero, for rotations below 180°.
template <class T>
Vector3<T> logOf(const Eigen::Quaternion<T>& q) {
  using std::atan2;
  using std::sqrt;
  const T sign = q.w() < T(0.0) ? T(-1.0) : T(1.0);
  const T w = sign * q.w(), n2 = q.vec().squaredNorm();
  T scale;
  if (n2 < T(1e-10)) {
    scale = T(2.0) / w - T(2.0 / 3.0) * n2 / (w * w * w);
  } else {
    const T n = sqrt(n2);
    scale = T(2.0) * atan2(n, w) / n;
  }
  return sign * scale * q.vec();
}

template <class T>
struct Turning {
  Eigen::Quaternion<T> q;  ///< q_TB
  Vector3<T> rate;         ///< w_TB_B, rad/s
};

/// Rotation and angular rate from five control points; u in about [0, 1).
template <class T>
Turning<T> rotationAt(const std::array<Eigen::Map<const Eigen::Quaternion<T>>, kOrder>& controls,
                      const T& u, double interval_s) {
  Turning<T> out{controls[0], Vector3<T>::Zero()};
  for (std::size_t i = 1; i < kOrder; ++i) {
    const auto w = evaluatePolynomial(kCumulativeWeights[i], u);
    const Vector3<T> d = logOf<T>(controls[i - 1].conjugate() * controls[i]);
    const Eigen::Quaternion<T> step = expQuaternionOf<T>(w[0] * d);
    out.q = out.q * step;
    out.rate = step.conjugate() * out.rate + w[1] / T(interval_s) * d;
  }
  return out;
}

/// The derivative of `order` 0, 1 or 2 of the position p_TB.
template <class T>
Vector3<T> positionAt(const std::array<Eigen::Map<const Vector3<T>>, kOrder>& controls, const T& u,
                      double interval_s, std::size_t order) {
  Vector3<T> sum = Vector3<T>::Zero();
  for (std::size_t i = 0; i < kOrder; ++i) {
    sum += evaluatePolynomial(kPlainWeights[i], u)[order] * controls[i];
  }
  for (std::size_t i = 0; i < order; ++i) sum /= T(interval_s);
  return sum;
}

struct Spline {
  double start_s = 0.0, interval_s = 0.05;
  std::vector<RigidTransform> controls;  ///< T_TB

  std::size_t segments() const { return controls.size() - (kOrder - 1); }
  double end_s() const { return start_s + interval_s * static_cast<double>(segments()); }
  bool covers(double t) const { return t >= start_s && t < end_s(); }
  std::size_t segmentAt(double t) const {
    const double at = std::floor((t - start_s) / interval_s);
    return std::min(segments() - 1, static_cast<std::size_t>(std::max(0.0, at)));
  }
  /// Relative position of time t within segment `k`, in [0, 1).
  double withinOf(std::size_t k, double t) const {
    return (t - start_s) / interval_s - static_cast<double>(k);
  }
  /// The time at which control point i has its largest weight.
  double timeOf(std::size_t i) const {
    return start_s + interval_s * (static_cast<double>(i) - 0.5 * (kOrder - 2));
  }
  RigidTransform poseAt(double t) const;
};

}  // namespace perdure::calibrate
