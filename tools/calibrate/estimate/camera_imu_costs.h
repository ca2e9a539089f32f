// Residuals for Ceres' automatic derivatives. Quaternions are Hamilton's, in the order x y z w.
#pragma once

#include <ceres/manifold.h>

#include <vector>

#include "common/math/so3.h"
#include "tools/calibrate/estimate/board.h"
#include "tools/calibrate/estimate/lens.h"
#include "tools/calibrate/estimate/spline.h"

namespace perdure::calibrate {

/// Unit quaternions with the perturbation on the right: q ⊞ θ = q Exp(θ), θ in radians.
class RightRotation : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return 3; }
  bool Plus(const double* x, const double* delta, double* sum) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(x);
    const Eigen::Map<const Eigen::Vector3d> theta(delta);
    Eigen::Map<Eigen::Quaterniond> out(sum);
    out = (q * expQuaternion(theta)).normalized();
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 4, 3, Eigen::RowMajor>> J(jacobian);
    J = halfTurns(x);
    return true;
  }
  bool Minus(const double* y, const double* x, double* difference) const override {
    const Eigen::Map<const Eigen::Quaterniond> to(y), from(x);
    Eigen::Map<Eigen::Vector3d> out(difference);
    out = logSo3(Eigen::Quaterniond(from.conjugate() * to));
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> J(jacobian);
    J = 4.0 * halfTurns(x).transpose();
    return true;
  }

 private:
  static Eigen::Matrix<double, 4, 3> halfTurns(const double* x) {
    const Eigen::Map<const Eigen::Quaterniond> q(x);
    Eigen::Matrix<double, 4, 3> J;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(i);
      J.col(i) = (q * Eigen::Quaterniond(0.0, axis.x(), axis.y(), axis.z())).coeffs() * 0.5;
    }
    return J;
  }
};

template <class T>
using Rotations = std::array<Eigen::Map<const Eigen::Quaternion<T>>, kOrder>;
template <class T>
using Positions = std::array<Eigen::Map<const Vector3<T>>, kOrder>;

/// The bias at a time between two bias nodes, by linear interpolation.
template <class T>
Vector3<T> biasAt(const T* before, const T* after, double share) {
  const Eigen::Map<const Vector3<T>> a(before), b(after);
  return a * T(1.0 - share) + b * T(share);
}

struct GyroCost {
  double u, interval_s, bias_share, weight;
  Eigen::Vector3d gyro;

  template <class T>
  bool operator()(const T* q0, const T* q1, const T* q2, const T* q3, const T* q4, const T* b0,
                  const T* b1, T* residual) const {
    using Q = Eigen::Map<const Eigen::Quaternion<T>>;
    const Rotations<T> controls = {Q(q0), Q(q1), Q(q2), Q(q3), Q(q4)};
    Eigen::Map<Vector3<T>> r(residual);
    r = T(weight) * (gyro.cast<T>() - rotationAt<T>(controls, T(u), interval_s).rate -
                     biasAt<T>(b0, b1, bias_share));
    return true;
  }
};

struct AccelCost {
  double u, interval_s, bias_share, weight, gravity;
  Eigen::Vector3d accel;

  /// down_T: unit vector along gravity in the board's frame.
  template <class T>
  bool operator()(const T* q0, const T* q1, const T* q2, const T* q3, const T* q4, const T* p0,
                  const T* p1, const T* p2, const T* p3, const T* p4, const T* b0, const T* b1,
                  const T* down_T, T* residual) const {
    using Q = Eigen::Map<const Eigen::Quaternion<T>>;
    using P = Eigen::Map<const Vector3<T>>;
    const Rotations<T> turns = {Q(q0), Q(q1), Q(q2), Q(q3), Q(q4)};
    const Positions<T> places = {P(p0), P(p1), P(p2), P(p3), P(p4)};
    const Eigen::Quaternion<T> q_TB = rotationAt<T>(turns, T(u), interval_s).q;
    const Vector3<T> force_T = positionAt<T>(places, T(u), interval_s, 2) - T(gravity) * P(down_T);
    Eigen::Map<Vector3<T>> r(residual);
    r = T(weight) * (accel.cast<T>() - q_TB.conjugate() * force_T - biasAt<T>(b0, b1, bias_share));
    return true;
  }
};

/// All corners of one image, with two residuals each.
struct FrameCost {
  struct Sight {
    Eigen::Vector3d point_T;
    Eigen::Vector2d pixel;
    double row_delay_s;  ///< exposure time of its row, after the stamp
  };
  DistortionModel model;
  double u, interval_s, weight;  ///< u at time offset 0, within the chosen segment
  bool rolling;
  std::vector<Sight> sights;

  template <class T>
  bool operator()(const T* q0, const T* q1, const T* q2, const T* q3, const T* q4, const T* p0,
                  const T* p1, const T* p2, const T* p3, const T* p4, const T* q_BC, const T* p_BC,
                  const T* offset_s, const T* focal, const T* distortion, T* residual) const {
    using Q = Eigen::Map<const Eigen::Quaternion<T>>;
    using P = Eigen::Map<const Vector3<T>>;
    const Rotations<T> turns = {Q(q0), Q(q1), Q(q2), Q(q3), Q(q4)};
    const Positions<T> places = {P(p0), P(p1), P(p2), P(p3), P(p4)};
    const Q rotation_BC(q_BC);
    const P position_BC(p_BC);
    Eigen::Quaternion<T> q_CT;
    Vector3<T> p_CT;
    for (std::size_t i = 0; i < sights.size(); ++i) {
      const Sight& sight = sights[i];
      if (i == 0 || rolling) {
        const T at = T(u) + (offset_s[0] + T(sight.row_delay_s)) / T(interval_s);
        const Eigen::Quaternion<T> q_TB = rotationAt<T>(turns, at, interval_s).q;
        const Vector3<T> p_TB = positionAt<T>(places, at, interval_s, 0);
        q_CT = (q_TB * rotation_BC).conjugate();
        p_CT = -(q_CT * (q_TB * position_BC + p_TB));
      }
      const Vector3<T> point = q_CT * sight.point_T.cast<T>() + p_CT;
      if (!(point.z() > T(1e-3))) return false;
      const auto pixel = projectPoint<T>(model, focal, distortion, point);
      residual[2 * i] = T(weight) * (T(sight.pixel.x()) - pixel.x());
      residual[2 * i + 1] = T(weight) * (T(sight.pixel.y()) - pixel.y());
    }
    return true;
  }
};

/// Random walk of a bias: the difference of two neighbouring nodes.
struct WalkCost {
  double weight;
  template <class T>
  bool operator()(const T* before, const T* after, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = T(weight) * (after[i] - before[i]);
    return true;
  }
};

/// Prior that limits the first bias value to the range of real sensors.
struct BiasPrior {
  double weight;
  template <class T>
  bool operator()(const T* bias, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = T(weight) * bias[i];
    return true;
  }
};

}  // namespace perdure::calibrate
