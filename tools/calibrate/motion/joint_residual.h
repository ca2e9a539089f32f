// The residuals of joint.h, for doubles and dual numbers.
#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>
#include <array>
#include <optional>
#include <type_traits>
#include <vector>

#include "common/camera/camera_model.h"
#include "tools/calibrate/estimate/lens.h"
#include "tools/calibrate/motion/inertial_path.h"
#include "tools/calibrate/motion/joint.h"

namespace perdure::calibrate::joint {

inline constexpr int kOwn = 6;                      // velocity and gravity of a window
inline constexpr int kShared = kParameters + kOwn;  // all but inverse depths
inline constexpr int kAll = kShared + 1;
inline constexpr double kGravity = 9.81,
                        kGravitySigma = 0.3;  // m/s²; includes the accelerometer's bias
inline constexpr double kUsualInverse = 0.3, kInverseSigma = 1.0;  // 1/m
inline constexpr double kLeastScale_px = 0.3;
// largest change of the time offset
inline constexpr Duration kMargin = std::chrono::milliseconds(100);

/// Dual numbers with derivatives by the last N of the shared unknowns, and by an inverse depth.
template <int N>
using Jet = ceres::Jet<double, N + 1>;
template <class T>
using Vec3 = Eigen::Matrix<T, 3, 1>;
using Own = Eigen::Matrix<double, kOwn, 1>;

/// Data of one window: its unknowns, and the results of the last linearisation.
struct Window {
  const TrackWindow* tracks;
  TimePoint from;               ///< start of its inertial path, before the first image
  Own own = Own::Zero();        ///< velocity and gravity, in the body's frame at the start
  std::vector<double> inverse;  ///< inverse depths
};

/// The unknowns as T: doubles, or dual numbers with derivatives by a small step.
template <class T>
struct Unknowns {
  Vec3<T> turn, bias, place, velocity, gravity;
  T later, readout;
  std::array<T, 4> focal, distortion;
};

template <class T>
T variable(double value, int index) {
  if constexpr (std::is_same_v<T, double>) {
    return value;
  } else {
    constexpr int kFirst = kAll - T::DIMENSION;
    return index < kFirst ? T(value) : T(value, index - kFirst);
  }
}

template <class T>
Vec3<T> variables(const Eigen::Vector3d& value, int index) {
  return {variable<T>(value.x(), index), variable<T>(value.y(), index + 1),
          variable<T>(value.z(), index + 2)};
}

template <class T>
Unknowns<T> unknownsOf(const JointState& state, const Own& own) {
  const CameraCalibration& c = state.camera;
  Unknowns<T> u;
  u.turn = variables<T>(Eigen::Vector3d::Zero(), kTurnOf);
  u.bias = variables<T>(Eigen::Vector3d::Zero(), kBias);
  u.place = variables<T>(c.T_BC.p, kPlace);
  u.velocity = variables<T>(own.head<3>(), kParameters);
  u.gravity = variables<T>(own.tail<3>(), kParameters + 3);
  u.later = variable<T>(0.0, kLater);
  u.readout = variable<T>(0.0, kReadout);
  const T scale = variable<T>(1.0, kFocal);
  u.focal = {c.fx * scale, c.fy * scale, variable<T>(c.cx, kCentre),
             variable<T>(c.cy, kCentre + 1)};
  u.distortion = {T(0.0), T(0.0), T(0.0), T(0.0)};
  for (std::size_t i = 0; i < c.distortion_coefficients.size() && i < 4; ++i) {
    const double d = c.distortion_coefficients[i];
    u.distortion[i] = i < 2 ? variable<T>(d, kDistortion + static_cast<int>(i)) : T(d);
  }
  return u;
}

/// Returns R v. A cast of R to dual numbers would take several times as long.
template <class T>
Vec3<T> rotated(const Eigen::Matrix3d& R, const Vec3<T>& v) {
  const auto row = [&](int i) { return R(i, 0) * v.x() + R(i, 1) * v.y() + R(i, 2) * v.z(); };
  return {row(0), row(1), row(2)};
}

template <class T>
Vec3<T> scaled(const Eigen::Vector3d& v, const T& factor) {
  return {v.x() * factor, v.y() * factor, v.z() * factor};
}

/// State of the body at the exposure of a pixel. Its time may differ by a small offset.
template <class T>
struct BodyAt {
  Eigen::Matrix3d R;
  Vec3<T> turn;      ///< small rotation on the right of R
  Vec3<T> position;  ///< position in the window's frame

  Vec3<T> toWindow(const Vec3<T>& v) const { return rotated<T>(R, v + turn.cross(v)); }
  Vec3<T> fromWindow(const Vec3<T>& v) const {
    const Vec3<T> still = rotated<T>(R.transpose(), v);
    return still - turn.cross(still);
  }
};

inline double shareOfRow(double row, const CameraCalibration& camera) {
  return row / (camera.height - 1.0) - 0.5;
}

/// Time of a corner's exposure after the start of the window, and the IMU's state at that time.
struct Exposure {
  double share, t;
  InertialState inertial;
};
/// For each track, the exposures of its corners. They depend on the shared unknowns only.
using Exposures = std::vector<std::vector<Exposure>>;

inline Exposures exposuresOf(const Window& window, const InertialPath& path,
                             const CameraCalibration& camera) {
  Exposures all;
  for (const Track& track : window.tracks->tracks) {
    auto& exposures = all.emplace_back();
    for (std::size_t i = 0; i < track.size(); ++i) {
      const double share = shareOfRow(track[i].y(), camera);
      const double t = toSeconds(window.tracks->times[i] - window.from) + camera.time_offset_s +
                       share * camera.readout_s;
      exposures.push_back({share, t, path.at(t)});
    }
  }
  return all;
}

template <class T>
BodyAt<T> bodyAt(const Exposure& exposure, const Unknowns<T>& u) {
  const InertialState& inertial = exposure.inertial;
  const T dt = u.later + exposure.share * u.readout, at = T(exposure.t) + dt;
  BodyAt<T> body;
  body.R = inertial.q.toRotationMatrix();
  body.turn = scaled(inertial.rate, dt) - rotated<T>(inertial.by_bias, u.bias);
  body.position = inertial.position.cast<T>() + scaled(inertial.velocity, dt) + u.velocity * at +
                  u.gravity * (at * at * 0.5);
  return body;
}

/// Ray of a pixel, with derivatives by the lens from a last Newton step in T.
template <class T>
std::optional<Vec3<T>> rayOf(const CameraModel& lens, const Eigen::Vector2d& pixel,
                             const Unknowns<T>& u) {
  const auto point = lens.unproject(pixel);
  if (!point) return std::nullopt;
  const CameraCalibration& camera = lens.calibration();
  Eigen::Matrix2d J;
  lens.distort(*point, &J);
  const Vec3<T> start = point->homogeneous().cast<T>();
  const auto again = projectPoint<T>(camera.distortion, u.focal.data(), u.distortion.data(), start);
  const Eigen::Matrix<T, 2, 1> step = J.inverse().cast<T>() * (pixel.cast<T>() - again);
  return Vec3<T>(start.x() + step.x(), start.y() + step.y(), T(1.0));
}

/// Calls `each(residual)`, in pixels, for every image of a track after the first.
template <class T, class Each>
void forResiduals(const Window& window, std::size_t k, const Exposures& exposures,
                  const CameraModel& lens, const Unknowns<T>& u, const Each& each) {
  const Track& track = window.tracks->tracks[k];
  const CameraCalibration& camera = lens.calibration();
  const auto ray = rayOf<T>(lens, track.front(), u);
  if (!ray) return;
  const T rho = variable<T>(window.inverse[k], kShared);
  const Eigen::Matrix3d R_BC = camera.T_BC.R(), R_CB = R_BC.transpose();
  const Vec3<T> in_body = rotated<T>(R_BC, *ray + u.turn.cross(*ray)) + rho * u.place;
  const BodyAt<T> first = bodyAt<T>(exposures[k][0], u);
  const Vec3<T> in_window = first.toWindow(in_body) + rho * first.position;
  for (std::size_t i = 1; i < track.size(); ++i) {
    const BodyAt<T> body = bodyAt<T>(exposures[k][i], u);
    const Vec3<T> there =
        rotated<T>(R_CB, body.fromWindow(in_window - rho * body.position) - rho * u.place);
    const Vec3<T> seen = there - u.turn.cross(there);
    if (!(seen.z() > T(1e-2))) continue;
    each(Eigen::Matrix<T, 2, 1>(track[i].cast<T>() - projectPoint<T>(camera.distortion,
                                                                     u.focal.data(),
                                                                     u.distortion.data(), seen)));
  }
}

}  // namespace perdure::calibrate::joint
