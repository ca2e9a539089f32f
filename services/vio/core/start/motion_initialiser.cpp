#include "services/vio/core/start/motion_initialiser.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/algorithms/stable_sort.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/vio/core/start/initialiser.h"
#include "services/vio/core/start/motion_path.h"
#include "services/vio/core/start/motion_refinement.h"

namespace perdure::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kKeyframes = 8, kFewestTracks = 15, kFewestViews = 3, kMostPoints = 120,
                      kFewestFrames = 5;
constexpr double kShortestWindow = 0.4;  // s; shorter ones have wrong minima that fit as well
constexpr double kGrowth = 0.1;          // share of the window's duration between searches
constexpr double kMostNoise = 1.25;      // largest RefinedWindow::noise_ratio
constexpr double kSpeeds[] = {0.3, 1.0, 3.0, 10.0};  // m/s, at the beginning of the searches
constexpr double kMuchWorse = 100.0;  // cost above that of the best of these beginnings
// On a street most points that last are at the horizon.
constexpr double kFewestParallaxPx = 2.0, kParallaxQuantile = 0.8;
constexpr double kMostAcceleration = 5.0;  // m/s², largest mean over a window

/// Returns the bearing of a point, rotated to the camera's attitude at the middle row. turn_C is
/// the camera's rotation vector from the first to the last row.
Vector3d bearing(const ImagePoint& seen, const Vector3d& turn_C) {
  const Vector3d ray = seen.normalised.homogeneous().normalized();
  return turn_C.isZero(0.0) ? ray : Vector3d(expQuaternion(seen.row * turn_C) * ray);
}

/// Frames of the window, and the inertial increments from the first of them, in B0.
struct Keyframes {
  std::vector<const TrackedFrame*> tracked;
  std::vector<TimePoint> times;
  std::vector<double> t;  ///< s since the first
  std::vector<Matrix3d> R;
  std::vector<Vector3d> dp, dv;
};

void addIncrements(Keyframes& k, const ImuBuffer& imu, const Vector3d& gyro_bias,
                   const ImuNoise& noise) {
  k.t = {0.0}, k.R = {Matrix3d::Identity()}, k.dp = k.dv = {Vector3d::Zero()};
  for (std::size_t i = 1; i < k.times.size(); ++i) {
    const ImuIncrement x =
        integrate(imu.between(k.times[0], k.times[i]), gyro_bias, Vector3d::Zero(), noise);
    k.t.push_back(x.dt);
    k.R.push_back(x.dq.toRotationMatrix());
    k.dp.push_back(x.dp);
    k.dv.push_back(x.dv);
  }
}

/// Points of a keyframe, and the rotation vector of the first camera during read-out.
struct Bearings {
  const TrackedFrame* tracked = nullptr;
  Vector3d turn_C = Vector3d::Zero();
};

/// Returns the body's angular rates during the read-outs at `times`; zero for global shutters.
std::vector<Vector3d> ratesAt(const std::vector<TimePoint>& times, const ImuBuffer& imu,
                              const std::vector<CameraModel>& cameras, const Vector3d& gyro_bias) {
  std::vector<Vector3d> rates(times.size(), Vector3d::Zero());
  double readout_s = 0.0;
  for (const CameraModel& c : cameras) {
    readout_s = std::max(readout_s, std::abs(c.calibration().readout_s));
  }
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

/// Matches between two times, as bearings of one camera, and the rotation between them.
struct BearingPair {
  std::size_t from = 0, to = 0;                         ///< keyframes
  std::vector<std::pair<Vector3d, Vector3d>> bearings;  ///< unit vectors in C
  Matrix3d R_B0_B1;                                     ///< rotation with zero bias
  Matrix3d J_bias;  ///< derivative of R_B0_B1 (right tangent) by the gyro bias
};

/// Returns the smallest eigenvalue of Σ n nᵀ over the epipolar normals n. It is zero for the true
/// R.
double coplanarity(const BearingPair& pair, const Matrix3d& R_C0_C1) {
  Matrix3d M = Matrix3d::Zero();
  for (const auto& [f0, f1] : pair.bearings) {
    const Vector3d n = f0.cross(R_C0_C1 * f1);
    M += n * n.transpose();
  }
  M /= static_cast<double>(pair.bearings.size());
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(M, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

/// Returns the gyro bias for which the epipolar normals are most coplanar (Kneip & Lynen, ICCV
/// 2013; He et al., CVPR 2023).
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

/// Returns the matches of points seen in both frames. Appends their displacements in pixels to
/// `moved`.
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

/// Returns the pairs of keyframes with enough matches. Long spans constrain the bias well, and
/// there are many short spans. Appends the displacements of all matches, in pixels, to `moved`.
std::vector<BearingPair> pairsOf(const Keyframes& k, const ImuBuffer& imu,
                                 const std::vector<CameraModel>& cameras, const Options& options,
                                 std::vector<double>& moved) {
  const std::vector<Vector3d> rates = ratesAt(k.times, imu, cameras, Vector3d::Zero());
  const double readout_s = cameras[0].calibration().readout_s;
  std::vector<Bearings> bearings;
  for (std::size_t i = 0; i < k.times.size(); ++i) {
    bearings.push_back({k.tracked[i], readout_s * (cameras[0].T_BC().q.conjugate() * rates[i])});
  }
  std::vector<BearingPair> pairs;
  for (const std::size_t span : {1u, 3u, 6u}) {
    for (std::size_t i = 0; i + span < k.times.size(); ++i) {
      const ImuIncrement x = integrate(imu.between(k.times[i], k.times[i + span]), Vector3d::Zero(),
                                       Vector3d::Zero(), options.imu);
      BearingPair pair = pairOf(bearings[i], bearings[i + span], x, moved);
      pair.from = i, pair.to = i + span;
      if (pair.bearings.size() >= kFewestTracks) pairs.push_back(std::move(pair));
    }
  }
  return pairs;
}

/// Returns the tracks with at least three views, the longest first.
std::vector<WindowPoint> windowPoints(const std::vector<const TrackedFrame*>& tracked,
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
  stableSortBy(points, [](const WindowPoint& p) { return -static_cast<double>(p.views.size()); });
  if (points.size() > kMostPoints) points.resize(kMostPoints);
  return points;
}

/// Returns the pairs with their rays rotated to B0.
std::vector<PathPair> pathPairs(const Keyframes& k, const std::vector<BearingPair>& pairs,
                                const Matrix3d& R_BC) {
  std::vector<PathPair> result;
  for (const BearingPair& p : pairs) {
    PathPair& pair = result.emplace_back(PathPair{p.from, p.to, {}});
    for (const auto& [f0, f1] : p.bearings) {
      pair.rays.emplace_back(k.R[p.from] * (R_BC * f0), k.R[p.to] * (R_BC * f1));
    }
  }
  return result;
}

/// Returns initial values for the search, one for each of kSpeeds that explains the planes about as
/// well as the best of them.
std::vector<MotionWindow> beginningsOf(const Keyframes& k, const std::vector<BearingPair>& pairs,
                                       const Vector3d& gyro_bias,
                                       const std::vector<CameraModel>& cameras,
                                       const Options& options) {
  std::vector<PathFrame> frames;
  for (std::size_t i = 0; i < k.t.size(); ++i) {
    frames.push_back({k.t[i], k.R[i] * cameras[0].T_BC().p, k.dp[i]});
  }
  const std::vector<PathPair> path_pairs = pathPairs(k, pairs, cameras[0].T_BC().R());
  const double sigma = options.vision.sigma_px / cameras[0].fx();
  const Vector3d against_force = -options.gravity * k.dv.back().normalized();
  const std::vector<WindowPoint> points = windowPoints(k.tracked, cameras);
  std::vector<Path> paths;
  for (const double speed : kSpeeds) {
    paths.push_back(pathWithSpeed(speed, frames, path_pairs, against_force, sigma));
  }
  stableSortBy(paths, [](const Path& p) { return p.cost; });
  std::vector<MotionWindow> beginnings;
  for (const Path& path : paths) {
    if (path.cost > paths[0].cost + kMuchWorse) break;
    MotionWindow& w = beginnings.emplace_back();
    w.gyro_bias = gyro_bias;
    w.gravity_B0 = path.gravity;
    for (std::size_t i = 0; i < k.t.size(); ++i) {
      const double t = k.t[i];
      w.poses.push_back({k.times[i], k.R[i], path.v0 * t + 0.5 * t * t * path.gravity + k.dp[i],
                         path.v0 + t * path.gravity + k.dv[i]});
    }
    w.points = points;
    placePoints(w);
  }
  return beginnings;
}

/// Returns the state at the newest pose after a correction by the error [θ, v, gravity, b_g, b_a].
/// W is the level frame with the smallest rotation, because yaw 0 is discontinuous if x points up.
Nav navOf(const MotionWindow& w, const Eigen::Matrix<double, kWindowError, 1>& error,
          const Eigen::Quaterniond& level) {
  const WindowPose& last = w.poses.back();
  const Matrix3d R_B0_B = last.R_B0_B * expSo3(error.head<3>());
  const Vector3d gravity = w.gravity_B0 + acrossGravity(w.gravity_B0) * error.segment<2>(6);
  Nav nav;
  const Vector3d up_W = level * (-R_B0_B.transpose() * gravity);
  nav.q_WB = Eigen::Quaterniond::FromTwoVectors(up_W, Vector3d::UnitZ()) * level;
  nav.v_WB = nav.q_WB * (R_B0_B.transpose() * (last.v_B0 + error.segment<3>(3)));
  nav.gyro_bias = w.gyro_bias + error.segment<3>(8);
  nav.accel_bias = w.accel_bias + error.segment<3>(11);
  return nav;
}

Start startOf(const RefinedWindow& refined, const Options& options) {
  using Error = Eigen::Matrix<double, kWindowError, 1>;
  Start start;
  start.time = refined.window.poses.back().time;
  const MotionWindow& window = refined.window;
  const Eigen::Quaterniond level =
      levelAttitude(-window.poses.back().R_B0_B.transpose() * window.gravity_B0);
  start.nav = navOf(window, Error::Zero(), level);
  Eigen::Matrix<double, 15, kWindowError> J;
  constexpr double kStep = 1e-5;
  for (int i = 0; i < kWindowError; ++i) {
    const Nav a = navOf(window, kStep * Error::Unit(i), level);
    const Nav b = navOf(window, -kStep * Error::Unit(i), level);
    J.col(i) << logSo3(b.q_WB.conjugate() * a.q_WB), Vector3d::Zero(), a.v_WB - b.v_WB,
        a.gyro_bias - b.gyro_bias, a.accel_bias - b.accel_bias;
  }
  J /= 2.0 * kStep;
  // Yaw and position define W. The error of the camera's mounting rotates the velocity.
  const double turned = options.calibration.extrinsic_rotation * start.nav.v_WB.norm();
  start.covariance = startCovariance(start.nav, 1e-4, 1e-4, 1e-4, Vector3d::Constant(turned));
  start.covariance += J * refined.covariance * J.transpose();
  start.covariance = (0.5 * (start.covariance + start.covariance.transpose())).eval();
  return start;
}

}  // namespace

void MotionInitialiser::add(const FrameInput& input, TimePoint imu_time) {
  // The clock restarted, so the new frames cannot share a window with earlier ones.
  if (!frames_.empty() && imu_time <= frames_.back().time) clear();
  frames_.push_back({imu_time, input.tracked});
  const Duration window = durationFromSeconds(options_.start.motion_window_s * 1.05);
  while (frames_.front().time < imu_time - window) frames_.pop_front();
}

Result<Start> MotionInitialiser::start(const ImuBuffer& imu,
                                       const std::vector<CameraModel>& cameras) {
  // Increments need samples at the frame, so frames older than the first sample are removed.
  while (!imu.empty() && !frames_.empty() && frames_.front().time < imu.first()) {
    frames_.pop_front();
  }
  if (frames_.empty()) return fail("start_window_short");
  const TimePoint now = frames_.back().time;
  // A search takes the time of several frames, so the next one waits until the window has grown.
  if (failed_ && now < next_attempt_) return tl::unexpected(*failed_);
  Result<Start> result = attempt(imu, cameras, 0);
  // Tracks of fast motion are shorter than the window.
  for (std::size_t first = frames_.size() / 2; first + kFewestFrames <= frames_.size();
       first = (first + frames_.size()) / 2) {
    if (result || result.error().code != "start_few_tracks") break;
    if (toSeconds(now - frames_[first].time) < kShortestWindow) break;
    result = attempt(imu, cameras, first);
  }
  failed_.reset();
  if (!result) {
    failed_ = result.error();
    const double window_s = toSeconds(now - frames_.front().time);
    next_attempt_ = now + durationFromSeconds(kGrowth * window_s);
  }
  return result;
}

Result<Start> MotionInitialiser::attempt(const ImuBuffer& imu,
                                         const std::vector<CameraModel>& cameras,
                                         std::size_t first) const {
  const std::size_t frames = frames_.size() - first;
  if (frames < kFewestFrames || imu.empty() ||
      toSeconds(frames_.back().time - frames_[first].time) < kShortestWindow) {
    return fail("start_window_short");
  }
  Keyframes k;
  const std::size_t count = std::min(kKeyframes, frames);
  for (std::size_t i = 0; i < count; ++i) {
    const Seen& s = frames_[first + i * (frames - 1) / (count - 1)];
    k.tracked.push_back(&s.tracked);
    k.times.push_back(s.time);
  }
  std::vector<double> moved;
  const std::vector<BearingPair> pairs = pairsOf(k, imu, cameras, options_, moved);
  if (pairs.size() < count) return fail("start_few_tracks");
  const auto usual = moved.begin() + static_cast<long>(kParallaxQuantile * moved.size());
  std::nth_element(moved.begin(), usual, moved.end());
  if (*usual < kFewestParallaxPx) return fail("start_no_parallax");
  const Vector3d gyro_bias = gyroBiasFromPairs(pairs, cameras[0].T_BC().R());
  addIncrements(k, imu, gyro_bias, options_.imu);
  const double mean_force = k.dv.back().norm() / k.t.back();
  if (std::abs(mean_force - options_.gravity) > kMostAcceleration) {
    return fail("start_force_not_gravity");
  }
  std::vector<MotionWindow> beginnings = beginningsOf(k, pairs, gyro_bias, cameras, options_);
  if (beginnings[0].points.size() < kFewestTracks) return fail("start_few_tracks");
  const auto refined = searchMinimum(std::move(beginnings), imu, options_);
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
