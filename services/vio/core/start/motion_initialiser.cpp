#include "services/vio/core/start/motion_initialiser.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/vio/core/start/initialiser.h"
#include "services/vio/core/start/motion_refinement.h"

namespace perdure::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr std::size_t kKeyframes = 8, kFewestTracks = 15, kFewestViews = 3, kMostPoints = 40;
constexpr double kShortestWindow = 0.25;  // s
constexpr double kGrowth = 0.2;           // of a window before it is searched again
constexpr double kMostNoise = 1.25;       // of the residuals, relative to what they should be
constexpr double kFewestInFront = 0.8;    // share of the points, of the linear solution
constexpr double kMostLinearPx = 3.0;     // its residual
// A start is used as soon as its velocity is known to this share of the largest in the window. With
// a larger one, windows are taken whose noise looks like motion.
constexpr double kVelocityShare = 0.12;
constexpr double kUsualDepth = 3.0;  // m
constexpr double kAsLikely = 9.0;    // of the cost
constexpr double kFewestParallaxPx = 2.0;

struct Keyframe {
  double t = 0.0;  ///< since the first
  Matrix3d R;      ///< R_B0_Bi
  Vector3d dp, dv;
  const TrackedFrame* tracked = nullptr;
  Vector3d rate = Vector3d::Zero();  ///< of the body, where a shutter rolls
};

/// Smallest eigenvalue of Σ n nᵀ, n the epipolar normals: zero where R is right.
double coplanarity(const BearingPair& pair, const Matrix3d& R_C0_C1) {
  Matrix3d M = Matrix3d::Zero();
  for (const auto& [f0, f1] : pair.bearings) {
    const Vector3d n = f0.cross(R_C0_C1 * f1);
    M += n * n.transpose();
  }
  M /= static_cast<double>(pair.bearings.size());
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(M, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

struct LinearView {
  Matrix3d R_CB0;    ///< rotates B0 into this camera
  Vector3d p_BC_B0;  ///< the camera relative to the body, in B0
  double t;          ///< since the first keyframe
  Vector3d dp;       ///< of the increment until then
  Eigen::Vector2d normalised;
  double scale;
};
using Views = std::map<std::uint64_t, std::vector<LinearView>>;

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

/// Rows of one view: [A_f | A_x] [f; v0; g] = b, in pixels times depth.
void rowsOf(const LinearView& v, Eigen::Matrix<double, 2, 3>& A_f, Eigen::Matrix<double, 2, 6>& A_x,
            Eigen::Vector2d& b) {
  Eigen::Matrix<double, 2, 3> J;
  J << 1, 0, -v.normalised.x(), 0, 1, -v.normalised.y();
  A_f = v.scale * J * v.R_CB0;
  A_x << -A_f * v.t, -A_f * (0.5 * v.t * v.t);
  b = A_f * (v.dp + v.p_BC_B0);
}

struct Solution {
  Vector6 x;  ///< v0, g in B0
  Matrix6 information;
  double rms_px = 0.0;
  double in_front = 0.0;  ///< share of points in front of all their cameras
};

struct PointEstimate {
  Vector3d f = Vector3d::Zero();
  bool known = false;
};

/// One weighted linear solution; depths of the last one weigh this one's rows.
Solution solveOnce(const Views& views, std::map<std::uint64_t, PointEstimate>& points,
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
  Solution s;
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

/// The bearing from where the camera was at the middle row, by rotation alone: the way of the body
/// between the rows lies in the epipolar plane. turn_C: of the camera, first to last row.
Vector3d bearing(const ImagePoint& seen, const Vector3d& turn_C) {
  const Vector3d ray = seen.normalised.homogeneous().normalized();
  return turn_C.isZero(0.0) ? ray : Vector3d(expQuaternion(seen.row * turn_C) * ray);
}

/// A keyframe's points, and how far the first camera turned while it was read out.
struct Bearings {
  const TrackedFrame* tracked = nullptr;
  Vector3d turn_C = Vector3d::Zero();
};

/// Of the body while the rows of a rolling shutter were read out; zero where none rolls.
std::vector<Vector3d> ratesAt(const std::vector<TimePoint>& times, const ImuBuffer& imu,
                              const std::vector<CameraModel>& cameras, const Vector3d& gyro_bias) {
  std::vector<Vector3d> rates(times.size(), Vector3d::Zero());
  double readout_s = 0.0;
  for (const CameraModel& c : cameras) readout_s = std::max(readout_s, c.calibration().readout_s);
  if (readout_s == 0.0) return rates;
  Nav nav;
  nav.gyro_bias = gyro_bias;
  std::vector<ImuReading> readings;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Duration half = durationFromSeconds(0.5 * readout_s);
    rates[i] = rowMotion(nav, imu, times[i], half, 0.0, readings).rate;
  }
  return rates;
}

/// Matches of points seen in both frames; distances in pixels are added to `moved`.
BearingPair pairOf(const Bearings& from, const Bearings& to, const ImuIncrement& x,
                   std::vector<double>& moved) {
  const TrackedFrame &first = *from.tracked, &second = *to.tracked;
  BearingPair pair;
  pair.R_B0_B1 = x.dq.toRotationMatrix();
  pair.J_bias = x.F.block<3, 3>(kTheta, kGyroBias);
  auto b = second.points.begin();
  for (const TrackedPoint& a : first.points) {
    while (b != second.points.end() && b->id < a.id) ++b;
    if (b == second.points.end()) break;
    if (b->id != a.id) continue;
    pair.bearings.emplace_back(bearing(*a.seen[0], from.turn_C), bearing(*b->seen[0], to.turn_C));
    moved.push_back((a.seen[0]->pixel - b->seen[0]->pixel).norm());
  }
  return pair;
}

}  // namespace

Vector3d solveOnSphere(const Matrix3d& M, const Vector3d& d, double length) {
  // Stationary: (M + λ I) g = d; the minimum has λ above the negated smallest eigenvalue, where
  // |g(λ)| falls from infinity to zero.
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

Vector3d gyroBiasFromPairs(const std::vector<BearingPair>& pairs, const Matrix3d& R_BC) {
  const auto residuals = [&](const Vector3d& bias) {
    Eigen::VectorXd r(static_cast<Eigen::Index>(pairs.size()));
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Matrix3d R_B = pairs[i].R_B0_B1 * expSo3(pairs[i].J_bias * bias);
      r[static_cast<Eigen::Index>(i)] =
          std::sqrt(std::max(coplanarity(pairs[i], R_BC.transpose() * R_B * R_BC), 0.0));
    }
    return r;
  };
  Vector3d bias = Vector3d::Zero();
  double lambda = 1e-3;
  Eigen::VectorXd r = residuals(bias);
  for (int iteration = 0; iteration < 30; ++iteration) {
    Eigen::MatrixXd J(r.size(), 3);
    constexpr double kStep = 1e-4;
    for (int i = 0; i < 3; ++i) {
      J.col(i) = (residuals(bias + kStep * Vector3d::Unit(i)) -
                  residuals(bias - kStep * Vector3d::Unit(i))) /
                 (2.0 * kStep);
    }
    Matrix3d A = J.transpose() * J;
    A.diagonal() *= 1.0 + lambda;
    A.diagonal().array() += 1e-12;
    const Vector3d step = -solveSymmetric(A, J.transpose() * r);
    const Eigen::VectorXd next = residuals(bias + step);
    if (next.squaredNorm() < r.squaredNorm()) {
      bias += step;
      r = next;
      lambda = std::max(0.2 * lambda, 1e-6);
      if (step.norm() < 1e-6) break;
    } else {
      lambda *= 5.0;
      if (lambda > 1e6) break;
    }
  }
  return bias;
}

void MotionInitialiser::add(const FrameInput& input, TimePoint imu_time) {
  frames_.push_back({imu_time, input.tracked});
  const Duration window = durationFromSeconds(options_.start.motion_window_s * 1.05);
  while (frames_.front().time < imu_time - window) frames_.pop_front();
}

namespace {

/// Tracks of at least three views, the longest first, placed by the poses of the window.
std::vector<WindowPoint> windowPoints(const MotionWindow& window,
                                      const std::vector<const TrackedFrame*>& tracked,
                                      const std::vector<CameraModel>& cameras) {
  std::map<std::uint64_t, WindowPoint> tracks;
  for (std::size_t k = 0; k < tracked.size(); ++k) {
    for (const TrackedPoint& p : tracked[k]->points) {
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        if (!p.seen[c]) continue;
        const RigidTransform& T_BC = cameras[c].T_BC();
        tracks[p.id].views.push_back({k, T_BC.R(), T_BC.p, p.seen[c]->normalised,
                                      p.seen[c]->to_pixels,
                                      p.seen[c]->row * cameras[c].calibration().readout_s});
      }
    }
  }
  std::vector<WindowPoint> points;
  for (auto& [id, point] : tracks) {
    if (point.views.size() >= kFewestViews) points.push_back(std::move(point));
  }
  std::stable_sort(points.begin(), points.end(), [](const WindowPoint& a, const WindowPoint& b) {
    return a.views.size() > b.views.size();
  });
  if (points.size() > kMostPoints) points.resize(kMostPoints);
  for (WindowPoint& point : points) {
    Matrix3d F = Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    for (const WindowView& v : point.views) {
      const WindowPose& pose = window.poses[v.keyframe];
      const Vector3d ray = pose.R_B0_B * v.R_BC * v.normalised.homogeneous().normalized();
      const Matrix3d across = Matrix3d::Identity() - ray * ray.transpose();
      F += across;
      b += across * (pose.p_B0 + pose.R_B0_B * v.p_BC);
    }
    F.diagonal().array() += 1e-9 * F.trace();
    point.p_B0 = F.ldlt().solve(b);
  }
  return points;
}

/// Where a point would be `depth` m from the camera that saw it first.
Vector3d alongFirstView(const WindowPoint& point, const MotionWindow& window, double depth) {
  const WindowView& v = point.views.front();
  const WindowPose& pose = window.poses[v.keyframe];
  return pose.p_B0 + pose.R_B0_B * (v.p_BC + depth * (v.R_BC * v.normalised.homogeneous()));
}

/// The state at the newest pose, with yaw 0, from the error [θ, v, gravity, b_g, b_a] of a window.
Nav navOf(const MotionWindow& w, const Eigen::Matrix<double, kWindowError, 1>& error) {
  const WindowPose& last = w.poses.back();
  const Matrix3d R_B0_B = last.R_B0_B * expSo3(error.head<3>());
  const Vector3d gravity = w.gravity_B0 + acrossGravity(w.gravity_B0) * error.segment<2>(6);
  Nav nav;
  nav.q_WB = levelAttitude(-R_B0_B.transpose() * gravity);
  nav.v_WB = nav.q_WB * (R_B0_B.transpose() * (last.v_B0 + error.segment<3>(3)));
  nav.gyro_bias = w.gyro_bias + error.segment<3>(8);
  nav.accel_bias = w.accel_bias + error.segment<3>(11);
  return nav;
}

Start startOf(const RefinedWindow& refined, const Options& options) {
  using Error = Eigen::Matrix<double, kWindowError, 1>;
  Start start;
  start.time = refined.window.poses.back().time;
  start.nav = navOf(refined.window, Error::Zero());
  Eigen::Matrix<double, 15, kWindowError> J;
  constexpr double kStep = 1e-5;
  for (int i = 0; i < kWindowError; ++i) {
    const Nav a = navOf(refined.window, kStep * Error::Unit(i));
    const Nav b = navOf(refined.window, -kStep * Error::Unit(i));
    J.col(i) << logSo3(b.q_WB.conjugate() * a.q_WB), Vector3d::Zero(), a.v_WB - b.v_WB,
        a.gyro_bias - b.gyro_bias, a.accel_bias - b.accel_bias;
  }
  J /= 2.0 * kStep;
  // Yaw and position are W's own. The camera's mounting turns the velocity.
  const double turned = options.calibration.extrinsic_rotation * start.nav.v_WB.norm();
  start.covariance = startCovariance(start.nav, 1e-4, 1e-4, 1e-4, Vector3d::Constant(turned));
  start.covariance += J * refined.covariance * J.transpose();
  start.covariance = (0.5 * (start.covariance + start.covariance.transpose())).eval();
  return start;
}

}  // namespace

Result<Start> MotionInitialiser::start(const ImuBuffer& imu,
                                       const std::vector<CameraModel>& cameras) {
  if (frames_.empty()) return fail("start_window_short");
  const TimePoint now = frames_.back().time;
  // A search costs as much as some frames, and another view of the same says little more.
  if (failed_ && now < next_attempt_) return tl::unexpected(*failed_);
  Result<Start> result = attempt(imu, cameras);
  failed_.reset();
  if (!result) {
    failed_ = result.error();
    const double window_s = toSeconds(now - frames_.front().time);
    next_attempt_ = now + durationFromSeconds(kGrowth * window_s);
  }
  return result;
}

Result<Start> MotionInitialiser::attempt(const ImuBuffer& imu,
                                         const std::vector<CameraModel>& cameras) const {
  if (frames_.size() < 5 || imu.empty() || imu.first() > frames_.front().time ||
      toSeconds(frames_.back().time - frames_.front().time) < kShortestWindow) {
    return fail("start_window_short");
  }
  const std::size_t count = std::min(kKeyframes, frames_.size());
  std::vector<const TrackedFrame*> tracked;
  std::vector<TimePoint> times;
  for (std::size_t i = 0; i < count; ++i) {
    const Seen& s = frames_[i * (frames_.size() - 1) / (count - 1)];
    tracked.push_back(&s.tracked);
    times.push_back(s.time);
  }
  const std::vector<Vector3d> raw_rates = ratesAt(times, imu, cameras, Vector3d::Zero());
  std::vector<Bearings> bearings;
  for (std::size_t i = 0; i < count; ++i) {
    const double readout_s = cameras[0].calibration().readout_s;
    bearings.push_back({tracked[i], readout_s * (cameras[0].T_BC().q.conjugate() * raw_rates[i])});
  }
  std::vector<BearingPair> pairs;
  std::vector<double> moved;
  for (const std::size_t span : {1u, 3u, 6u}) {  // long ones weigh the bias, short ones are many
    for (std::size_t i = 0; i + span < count; ++i) {
      const ImuIncrement x = integrate(imu.between(times[i], times[i + span]), Vector3d::Zero(),
                                       Vector3d::Zero(), options_.imu);
      BearingPair pair = pairOf(bearings[i], bearings[i + span], x, moved);
      if (pair.bearings.size() >= kFewestTracks) pairs.push_back(std::move(pair));
    }
  }
  if (pairs.size() < count) return fail("start_few_tracks");
  std::nth_element(moved.begin(), moved.begin() + static_cast<long>(moved.size() / 2), moved.end());
  if (moved[moved.size() / 2] < kFewestParallaxPx) return fail("start_no_parallax");
  const Vector3d gyro_bias = gyroBiasFromPairs(pairs, cameras[0].T_BC().R());

  const std::vector<Vector3d> rates = ratesAt(times, imu, cameras, gyro_bias);
  std::vector<Keyframe> keyframes;
  for (std::size_t i = 0; i < count; ++i) {
    Keyframe k{0.0, Matrix3d::Identity(), Vector3d::Zero(), Vector3d::Zero(), tracked[i], rates[i]};
    if (i > 0) {
      const ImuIncrement x =
          integrate(imu.between(times[0], times[i]), gyro_bias, Vector3d::Zero(), options_.imu);
      k = {x.dt, x.dq.toRotationMatrix(), x.dp, x.dv, tracked[i], rates[i]};
    }
    keyframes.push_back(k);
  }
  const Views views = viewsOf(keyframes, cameras);
  if (views.size() < kFewestTracks) return fail("start_few_tracks");
  std::map<std::uint64_t, PointEstimate> estimates;
  Solution s;
  s.x.setZero();
  for (int i = 0; i < 4; ++i) s = solveOnce(views, estimates, s.x, options_.gravity);
  if (!s.x.allFinite() || s.in_front < kFewestInFront || s.rms_px > kMostLinearPx) {
    return fail("start_inconsistent");
  }

  MotionWindow window;
  window.gyro_bias = gyro_bias;
  window.gravity_B0 = s.x.tail<3>();
  for (std::size_t i = 0; i < count; ++i) {
    const Keyframe& k = keyframes[i];
    window.poses.push_back({times[i], k.R,
                            s.x.head<3>() * k.t + 0.5 * k.t * k.t * s.x.tail<3>() + k.dp,
                            s.x.head<3>() + k.t * s.x.tail<3>() + k.dv});
  }
  window.points = windowPoints(window, tracked, cameras);
  // The linear solution may be near nothing at all: no motion, no depth. Another search begins
  // where all points are as far as things usually are.
  std::vector<RefinedWindow> minima;
  Result<RefinedWindow> refined = refine(window, imu, options_);
  if (refined) minima.push_back(*refined);
  for (WindowPoint& point : window.points) point.p_B0 = alongFirstView(point, window, kUsualDepth);
  if (const auto other = refine(std::move(window), imu, options_)) {
    minima.push_back(*other);
    if (!refined || other->cost < refined->cost) refined = other;
  }
  // Another minimum that fits about as well: the window does not say which is right.
  for (const RefinedWindow& other : minima) {
    const double apart =
        (other.window.poses.back().v_B0 - refined->window.poses.back().v_B0).norm();
    if (other.cost < refined->cost + kAsLikely &&
        apart > kVelocityShare * refined->window.poses.back().v_B0.norm()) {
      return fail("start_unobservable");
    }
  }
  if (!refined) return tl::unexpected(refined.error());
  if (refined->noise_ratio > kMostNoise) return fail("start_inconsistent");
  Start start = startOf(*refined, options_);
  const double sigma_v = std::sqrt(start.covariance.block<3, 3>(kVelocity, kVelocity).trace());
  double fastest = 0.0;
  for (const WindowPose& pose : refined->window.poses) {
    fastest = std::max(fastest, pose.v_B0.norm());
  }
  if (!(sigma_v <= kVelocityShare * fastest)) return fail("start_unobservable");
  return start;
}

}  // namespace perdure::vio
