#include "common/camera/camera_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.h"

namespace perdure {
namespace {

constexpr double kMinDepth = 1e-3;

/// The value of a radial factor and its derivative with respect to the squared radius.
struct Radial {
  double value, slope;
};

Radial radialOf(DistortionModel model, const LensCoefficients& d, double r2) {
  const double k1 = d[0], k2 = d[1];
  const Radial brown{1.0 + k1 * r2 + k2 * r2 * r2, k1 + 2.0 * k2 * r2};
  if (model != DistortionModel::kRational) return brown;
  const double k3 = d[4], k4 = d[5], k5 = d[6], k6 = d[7], r4 = r2 * r2, r6 = r4 * r2;
  const double above = brown.value + k3 * r6, below = 1.0 + k4 * r2 + k5 * r4 + k6 * r6;
  const double above_slope = brown.slope + 3.0 * k3 * r4;
  const double below_slope = k4 + 2.0 * k5 * r2 + 3.0 * k6 * r4;
  return {above / below, (above_slope * below - above * below_slope) / (below * below)};
}

/// d (distorted angle) / d (angle off the axis).
double slopeOfEquidistant(const LensCoefficients& d, double angle) {
  const double t2 = angle * angle;
  return 1.0 + t2 * (3.0 * d[0] + t2 * (5.0 * d[1] + t2 * (7.0 * d[2] + t2 * 9.0 * d[3])));
}

Eigen::Vector2d distortEquidistant(const LensCoefficients& d, const Eigen::Vector2d& n,
                                   Eigen::Matrix2d* J) {
  const double r = n.norm();
  if (r < 1e-9) {
    if (J) J->setIdentity();
    return n;
  }
  const double t = std::atan(r), t2 = t * t;
  const double poly = 1.0 + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3])));
  const double scale = t * poly / r;
  if (J) {
    const double dscale = (slopeOfEquidistant(d, t) / (1.0 + r * r) - scale) / r;  // d scale / d r
    *J = scale * Eigen::Matrix2d::Identity() + (dscale / r) * n * n.transpose();
  }
  return scale * n;
}

constexpr double kLeastSlope = 0.05;

double monotoneRadius2OfEquidistant(const LensCoefficients& d) {
  for (double angle = 0.01; angle < 1.57; angle += 0.01) {
    if (!(slopeOfEquidistant(d, angle) > kLeastSlope)) return std::pow(std::tan(angle), 2);
  }
  return std::numeric_limits<double>::infinity();
}

// The squared radius at which the distorted radius stops growing. Beyond it the mapping folds back.
double monotoneRadius2(DistortionModel model, const LensCoefficients& d) {
  if (model == DistortionModel::kNone) return std::numeric_limits<double>::infinity();
  if (model == DistortionModel::kEquidistant) return monotoneRadius2OfEquidistant(d);
  for (double r2 = 0.01; r2 < 25.0; r2 += 0.01) {
    const auto [value, slope] = radialOf(model, d, r2);
    if (!(value + 2.0 * r2 * slope > kLeastSlope)) return r2;  // d (r · value) / d r
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

Eigen::Vector2d distortRadTan(DistortionModel model, const LensCoefficients& d,
                              const Eigen::Vector2d& n, Eigen::Matrix2d* J) {
  const double x = n.x(), y = n.y(), r2 = x * x + y * y;
  const double p1 = d[2], p2 = d[3];
  const auto [radial, slope] = radialOf(model, d, r2);
  if (J) {
    const double dr = 2.0 * slope;
    (*J)(0, 0) = radial + x * x * dr + 2.0 * p1 * y + 6.0 * p2 * x;
    (*J)(0, 1) = x * y * dr + 2.0 * p1 * x + 2.0 * p2 * y;
    (*J)(1, 0) = (*J)(0, 1);
    (*J)(1, 1) = radial + y * y * dr + 6.0 * p1 * y + 2.0 * p2 * x;
  }
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

CameraModel::CameraModel(const CameraCalibration& c)
    : calibration_(c),
      width_(c.width),
      height_(c.height),
      fx_(c.fx),
      fy_(c.fy),
      cx_(c.cx),
      cy_(c.cy),
      T_BC_(c.T_BC) {
  check(c.fx > 0 && c.fy > 0, "focal lengths are positive");
  const std::size_t wanted = coefficientsOf(c.distortion);
  check(c.distortion_coefficients.size() >= wanted, "a distortion model has all its coefficients");
  std::copy_n(c.distortion_coefficients.begin(), wanted, d_.begin());
  max_radius2_ = monotoneRadius2(c.distortion, d_);
}

Eigen::Vector2d CameraModel::distort(const Eigen::Vector2d& n, Eigen::Matrix2d* J) const {
  Eigen::Vector2d distorted = n;
  switch (calibration_.distortion) {
    case DistortionModel::kNone:
      if (J) J->setIdentity();
      break;
    case DistortionModel::kRadialTangential:
    case DistortionModel::kRational:
      distorted = distortRadTan(calibration_.distortion, d_, n, J);
      break;
    case DistortionModel::kEquidistant:
      distorted = distortEquidistant(d_, n, J);
      break;
  }
  if (J) {
    J->row(0) *= fx_;
    J->row(1) *= fy_;
  }
  return {fx_ * distorted.x() + cx_, fy_ * distorted.y() + cy_};
}

std::optional<Eigen::Vector2d> CameraModel::project(const Eigen::Vector3d& p,
                                                    Eigen::Matrix<double, 2, 3>* J_point) const {
  if (!(p.z() > kMinDepth)) return std::nullopt;
  const double iz = 1.0 / p.z();
  const Eigen::Vector2d n(p.x() * iz, p.y() * iz);
  if (n.squaredNorm() > max_radius2_) return std::nullopt;
  Eigen::Matrix2d J;
  const Eigen::Vector2d pixel = distort(n, J_point ? &J : nullptr);
  if (J_point) {
    Eigen::Matrix<double, 2, 3> J_n;
    J_n << iz, 0, -n.x() * iz, 0, iz, -n.y() * iz;
    *J_point = J * J_n;
  }
  return pixel;
}

std::optional<Eigen::Vector2d> CameraModel::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d target((pixel.x() - cx_) / fx_, (pixel.y() - cy_) / fy_);
  Eigen::Vector2d n = target;
  if (calibration_.distortion == DistortionModel::kNone) return n;
  if (calibration_.distortion == DistortionModel::kEquidistant && target.norm() > 1e-9) {
    n = target * (std::tan(std::min(target.norm(), 1.4)) / target.norm());
  }
  for (int i = 0; i < 20; ++i) {
    Eigen::Matrix2d J;
    const Eigen::Vector2d error = pixel - distort(n, &J);
    if (!error.allFinite() || std::abs(J.determinant()) < 1e-9) return std::nullopt;
    n += J.inverse() * error;
    if (error.squaredNorm() < 1e-16) return n;
  }
  const Eigen::Vector2d error = pixel - distort(n);
  return error.squaredNorm() < 1e-8 ? std::optional(n) : std::nullopt;
}

bool sameCamera(const CameraCalibration& a, const CameraCalibration& b) {
  return a.name == b.name && a.width == b.width && a.height == b.height && a.fx == b.fx &&
         a.fy == b.fy && a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion &&
         a.distortion_coefficients == b.distortion_coefficients &&
         a.T_BC.matrix() == b.T_BC.matrix() && a.time_offset_s == b.time_offset_s &&
         a.readout_s == b.readout_s && a.deviations == b.deviations;
}

}  // namespace perdure
