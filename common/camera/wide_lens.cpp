#include "common/camera/wide_lens.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/camera/camera_model.h"

namespace perdure {
namespace {

constexpr double kWidest = 85.0 * std::numbers::pi / 180.0;
constexpr double kMostError = 0.5;  // px

/// The divisor of x and y in the projection, with its gradient `slope`.
struct Divisor {
  double value = 0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
};

Divisor divisorOf(const WideLens& lens, const Eigen::Vector3d& p) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const double d1 = p.norm();
  if (lens.kind == WideLens::Kind::kUnified) {
    return {p.z() + lens.a * d1, up + lens.a * p / d1};
  }
  if (lens.kind == WideLens::Kind::kExtendedUnified) {
    const Eigen::Vector3d weighed(lens.b * p.x(), lens.b * p.y(), p.z());
    const double d = std::sqrt(weighed.dot(p));
    return {lens.a * d + (1 - lens.a) * p.z(), lens.a * weighed / d + (1 - lens.a) * up};
  }
  const double shifted = lens.a * d1 + p.z();
  const Eigen::Vector3d shifted_slope = lens.a * p / d1 + up;
  const double d2 = std::sqrt(p.x() * p.x() + p.y() * p.y() + shifted * shifted);
  const Eigen::Vector3d d2_slope =
      (Eigen::Vector3d(p.x(), p.y(), 0.0) + shifted * shifted_slope) / d2;
  return {lens.b * d2 + (1 - lens.b) * shifted, lens.b * d2_slope + (1 - lens.b) * shifted_slope};
}

struct Sample {
  double angle;
  Eigen::Vector2d side, pixel;  ///< side: unit vector of the direction in the image
};

/// Directions that are visible in the image, evenly distributed over it.
std::vector<Sample> samplesOf(const WideLens& lens, const CameraCalibration& camera) {
  std::vector<Sample> samples;
  for (int i = 1; i <= 85; ++i) {
    const double angle = kWidest * i / 85.0;
    for (int k = 0; k < 48; ++k) {
      const double turn = 2 * std::numbers::pi * k / 48.0;
      const Eigen::Vector2d side(std::cos(turn), std::sin(turn));
      const double across = std::sin(angle);
      const auto pixel = project(lens, {across * side.x(), across * side.y(), std::cos(angle)});
      const bool inside = pixel && pixel->x() >= 0 && pixel->y() >= 0 &&
                          pixel->x() < camera.width && pixel->y() < camera.height;
      if (inside) samples.push_back({angle, side, *pixel});
    }
  }
  return samples;
}

}  // namespace

std::optional<Eigen::Vector2d> project(const WideLens& lens, const Eigen::Vector3d& p,
                                       Eigen::Matrix<double, 2, 3>* J) {
  if (!(p.norm() > 1e-9)) return std::nullopt;
  const Divisor divisor = divisorOf(lens, p);
  // Beyond this limit the projection folds back.
  if (!(divisor.value > 1e-6 * p.norm())) return std::nullopt;
  const Eigen::Vector2d n = p.head<2>() / divisor.value;
  const auto& [k1, k2, p1, p2] = lens.distortion;
  const LensCoefficients d{k1, k2, p1, p2};
  Eigen::Matrix2d J_n;
  const Eigen::Vector2d m =
      distortRadTan(DistortionModel::kRadialTangential, d, n, J ? &J_n : nullptr);
  if (J) {
    Eigen::Matrix<double, 2, 3> J_p = -n * divisor.slope.transpose() / divisor.value;
    J_p(0, 0) += 1 / divisor.value;
    J_p(1, 1) += 1 / divisor.value;
    *J = Eigen::Vector2d(lens.fx, lens.fy).asDiagonal() * J_n * J_p;
  }
  return Eigen::Vector2d(lens.fx * m.x() + lens.cx, lens.fy * m.y() + lens.cy);
}

Result<EquidistantFit> fitEquidistant(const WideLens& lens, CameraCalibration& camera) {
  const auto samples = samplesOf(lens, camera);
  if (samples.size() < 200) {
    return fail("intrinsics", "are of a lens that sees next to nothing of its image");
  }
  // pixel = c + f·side·(t + k1·t³ + …): linear in f and f·k. Angles are scaled to 1 for the solver.
  const double widest = samples.back().angle;
  Eigen::MatrixXd A(2 * samples.size(), 5);
  Eigen::VectorXd b(2 * samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Sample& s = samples[i];
    for (int axis = 0; axis < 2; ++axis) {
      const auto row = static_cast<Eigen::Index>(2 * i) + axis;
      double power = s.angle / widest;
      for (int k = 0; k < 5; ++k, power *= (s.angle / widest) * (s.angle / widest)) {
        A(row, k) = power * s.side[axis];
      }
      b[row] = axis == 0 ? (s.pixel.x() - lens.cx) / lens.fx : (s.pixel.y() - lens.cy) / lens.fy;
    }
  }
  const Eigen::VectorXd found = A.colPivHouseholderQr().solve(b);
  const double scale = found[0] / widest;
  if (!found.allFinite() || !(scale > 0)) {
    return fail("intrinsics", "are of no lens that can be");
  }
  camera.fx = lens.fx * scale, camera.fy = lens.fy * scale, camera.cx = lens.cx,
  camera.cy = lens.cy;
  camera.distortion = DistortionModel::kEquidistant;
  camera.distortion_coefficients.clear();
  for (int k = 1; k < 5; ++k) {
    camera.distortion_coefficients.push_back(found[k] / found[0] / std::pow(widest, 2 * k));
  }
  EquidistantFit fit;
  fit.angle = widest;
  const CameraModel model(camera);
  for (const Sample& s : samples) {
    const Eigen::Vector2d n = s.side * std::tan(s.angle);
    const double error = (model.distort(n) - s.pixel).norm();
    fit.rms_px += error * error / static_cast<double>(samples.size());
    fit.max_px = std::max(fit.max_px, error);
  }
  fit.rms_px = std::sqrt(fit.rms_px);
  if (fit.max_px > kMostError) {
    return fail("intrinsics",
                fmt::format("are of a lens that no equidistant one follows (by {:.2f} pixels): "
                            "calibrate it as pinhole-equi",
                            fit.max_px));
  }
  return fit;
}

}  // namespace perdure
