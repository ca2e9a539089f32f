#include "services/vio/core/estimator.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "common/base/check.h"
#include "common/math/gaussian.h"
#include "services/vio/core/propagation/imu_propagator.h"
#include "services/vio/core/update/point_updates.h"
#include "services/vio/core/update/triangulation.h"
#include "services/vio/core/update/updates.h"
#include "services/vio/core/update/visual.h"

namespace perdure::vio {
namespace {

// Limits in m/s, rad/s and m/s²; beyond them the filter has diverged, even if its covariance is
// small. The scale error has no unit.
constexpr double kMaxSpeed = 150.0, kMaxGyroBias = 1.0, kMaxAccelBias = 5.0;
constexpr double kMaxSpeedSigma = 10.0, kMaxScaleError = 0.3;

std::int64_t asInt(std::size_t n) { return static_cast<std::int64_t>(n); }

}  // namespace

Estimator::Estimator(const Options& options, const std::vector<RigidTransform>& T_BC,
                     double time_offset_s, const std::vector<double>& readout_s)
    : options_(options), T_BC_(T_BC), time_offset_s_(time_offset_s), readout_s_(readout_s) {
  check(!T_BC.empty() && T_BC.size() <= kMaxCameras, "one or two cameras");
  readout_s_.resize(T_BC.size(), 0.0);
}

Eigen::Matrix3d Estimator::predictRotation(const ImuBuffer& imu, TimePoint from, TimePoint to) {
  if (to <= from || imu.empty()) return Eigen::Matrix3d::Identity();
  imu.between(from, to, readings_);
  const Eigen::Vector3d bias = state_ ? state_->nav.gyro_bias : Eigen::Vector3d::Zero();
  const Eigen::Vector3d scale = state_ ? state_->gyro_scale : Eigen::Vector3d::Ones();
  return integrateRotation(readings_, bias, scale).toRotationMatrix().transpose();
}

Eigen::Vector3d Estimator::turnOfReadout(const ImuBuffer& imu, TimePoint time) {
  const double readout_s = state_ ? state_->readout_s[0] : readout_s_[0];
  if (readout_s == 0.0 || imu.empty()) return Eigen::Vector3d::Zero();
  const Duration half = durationFromSeconds(0.5 * std::abs(readout_s));
  const Nav nav = state_ ? state_->nav : Nav{};
  const Eigen::Vector3d scale = state_ ? state_->gyro_scale : Eigen::Vector3d::Ones();
  return readout_s * rowMotion(nav, imu, time, half, options_.gravity, readings_, scale).rate;
}

/// Computes the row motion of the newest clone. It is repeated after the update.
void Estimator::measureRows(const ImuBuffer& imu) {
  const double readout_s = state_->longestReadout();
  if (readout_s == 0.0) return;
  const Duration half = durationFromSeconds(0.5 * std::abs(readout_s));
  state_->clones.back().rows =
      rowMotion(state_->nav, imu, state_->time, half, options_.gravity, rows_, state_->gyro_scale);
}

Result<void> Estimator::propagateTo(const FrameInput& input, const ImuBuffer& imu) {
  const TimePoint to = input.image_time + durationFromSeconds(state_->time_offset_s);
  if (imu.empty()) return fail("imu_missing");
  Eigen::Vector3d rate;
  if (to > state_->time) {
    imu.between(state_->time, to, readings_);
    const ImuIncrement x = integrate(readings_, state_->nav.gyro_bias, state_->nav.accel_bias,
                                     options_.imu, state_->gyro_scale);
    propagate(*state_, x, to, options_.gravity, options_.window.first_estimates);
    rate = x.end_rate;
  } else if (to == state_->time) {
    rate = (imu.between(to, to + Duration(1)).front().gyro - state_->nav.gyro_bias)
               .cwiseQuotient(state_->gyro_scale);
  } else {
    return fail("frame_not_after_state");
  }
  check(input.tracked.cameras || !options_.calibration.estimated().lens,
        "an image whose lens is estimated names its cameras");
  state_->addClone(input.frame, input.image_time, rate, options_.window.first_estimates,
                   input.tracked.cameras);
  measureRows(imu);
  database_.add(input.frame, input.tracked);
  return {};
}

/// Returns true if half of the points rest and the gyroscope measures no turn. Points on a lorry
/// that moves along with the body may cause this too.
bool Estimator::medianRests(const FrameInput& input) const {
  const RestOptions& o = options_.rest;
  if (!input.motion_px || *input.motion_px > o.disparity_px) return false;
  const RestSample sample = restSample(readings_, options_.imu);
  return (sample.rate - state_->nav.gyro_bias).norm() <= o.max_rate + 3.0 * sample.rate_sigma;
}

bool Estimator::velocityMayBeZero() const {
  const Eigen::Matrix3d P = state_->P().block<3, 3>(kVelocity, kVelocity);
  const double sigma = options_.rest.speed_sigma;
  const Eigen::Matrix3d S = P + sigma * sigma * Eigen::Matrix3d::Identity();
  return passesGate(state_->nav.v_WB, S, 0.99);
}

/// Returns true if the body rests while part of the image moves. A distant background rests in the
/// image of a moving body too, so the IMU must agree.
bool Estimator::standsInTraffic(const ImuBuffer& imu, bool background_rests) {
  const bool knew = standstill_.known();
  const bool held = standstill_.holds(imu, state_->time, options_.imu);
  if (held || knew || !background_rests) return held && velocityMayBeZero();
  constexpr std::chrono::seconds kWindow{1};
  return imuIsEven(imu, state_->time, kWindow, options_.imu) && velocityMayBeZero();
}

bool Estimator::restUpdate(const FrameInput& input, const ImuBuffer& imu, TimePoint from) {
  const RestOptions& o = options_.rest;
  if (!o.enabled || !previous_frame_ || !state_->clone(*previous_frame_)) return false;
  if (state_->time <= from) return false;
  if ((input.speed && std::abs(input.speed->speed) > 0.1) ||
      state_->nav.v_WB.norm() > o.max_speed) {
    standstill_.forget();
    return false;
  }
  imu.between(from, state_->time, readings_);
  const bool median_rests = medianRests(input);
  const bool disputed = input.most_motion_px && *input.most_motion_px > o.disparity_px;
  const bool background_rests = median_rests || input.still_share >= o.still_share;
  if ((!median_rests || disputed) && !standsInTraffic(imu, background_rests)) return false;
  State before = *state_;
  auto done = updateRest(*state_, restSample(readings_, options_.imu), o, options_.gravity);
  if (done) done = updateNoMotion(*state_, *previous_frame_, input.frame, o);
  if (!done) {
    reasons_.add(done.error());
    *state_ = std::move(before);
    return false;
  }
  if (background_rests) {
    standstill_.confirm(state_->time, restExpectation(*state_, options_.gravity));
  } else {
    reasons_.add("rest_by_imu");
  }
  return true;
}

std::vector<const Track*> Estimator::onceUsed(std::uint64_t frame, bool window_full) const {
  struct Candidate {
    bool goes_on;
    std::size_t views;
    const Track* track;
  };
  std::vector<Candidate> candidates;
  candidates.reserve(database_.tracks().size());
  const std::uint64_t oldest = state_->clones.front().frame;
  for (const auto& [id, track] : database_.tracks()) {
    const std::size_t views = track.views();
    if (asInt(views) < options_.window.min_observations || state_->point(id)) continue;
    const bool goes_on = track.seenAt(frame);
    if (goes_on && !(window_full && track.observations.front().frame == oldest)) continue;
    candidates.push_back({goes_on, views, &track});
  }
  // Ended tracks come first, because they cannot be used later; then the longest tracks.
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::tuple(a.goes_on, b.views, a.track->id) <
           std::tuple(b.goes_on, a.views, b.track->id);
  });
  const auto limit = static_cast<std::size_t>(options_.window.msckf_features);
  if (candidates.size() > limit) candidates.resize(limit);
  std::vector<const Track*> result;
  result.reserve(candidates.size());
  for (const Candidate& c : candidates) result.push_back(c.track);
  return result;
}

void Estimator::forgetUsed(const std::vector<const Track*>& used, std::uint64_t frame) {
  for (const Track* track : used) database_.erase(track->id);
  database_.eraseIf(
      [&](const Track& track) { return !track.seenAt(frame) && !state_->point(track.id); });
}

void Estimator::dropLostPoints(std::uint64_t frame) {
  std::vector<std::uint64_t> lost;
  for (const PointState& point : state_->points) {
    const Track* track = database_.find(point.id);
    if (!track || !track->seenAt(frame)) lost.push_back(point.id);
  }
  for (const std::uint64_t id : lost) {
    state_->removePoint(id);
    database_.erase(id);
  }
}

/// Removes all images before the newest one, in which the cameras may have had another pose on the
/// body.
void Estimator::dropEarlierImages(std::uint64_t newest) {
  while (state_->clones.front().frame != newest) {
    const std::uint64_t frame = state_->clones.front().frame;
    database_.removeFrame(frame);
    state_->removeClone(frame);
  }
}

Result<void> Estimator::admitPoints(std::uint64_t frame, bool window_full) {
  if (!window_full) return {};
  const std::uint64_t oldest = state_->clones.front().frame;
  const auto room = options_.window.slam_features - asInt(state_->points.size());
  if (room <= 0) return {};
  std::vector<std::pair<std::size_t, const Track*>> candidates;  // number of views, track
  for (const auto& [id, track] : database_.tracks()) {
    if (state_->point(id) || !track.seenAt(frame)) continue;
    if (track.observations.front().frame != oldest) continue;
    candidates.emplace_back(track.views(), &track);
  }
  std::sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return std::tuple(b.first, a.second->id) < std::tuple(a.first, b.second->id);
  });
  for (const auto& [views, track] : candidates) {
    if (asInt(state_->points.size()) >= options_.window.slam_features) break;
    const auto added = initialisePoint(*state_, *track, options_.vision);
    if (!added) {
      reasons_.add(added.error());
      if (added.error().code.starts_with("update_")) return added;
      if (added.error().code == "slam_depth_unknown") continue;  // updateMsckf() may use the track
    }
    database_.erase(track->id);
  }
  return {};
}

Result<void> Estimator::visionUpdate(const FrameInput& input, FrameEstimate& out) {
  const bool full = asInt(state_->clones.size()) > options_.window.clones;
  dropLostPoints(input.frame);
  const MountPose mount = MountPose::of(*state_);
  const auto slam = updateSlam(*state_, database_, options_.vision, agreed_, reasons_,
                               keeps_innovations_ ? &out.innovations : nullptr);
  if (!slam) return tl::unexpected(slam.error());
  if (slam->jumped) {
    mount_.compareWith(mount, state_->time);
    dropEarlierImages(input.frame);
  }
  agreed_ = slam->used > slam->gated;
  for (const PointState& point : state_->points) database_.erase(point.id);
  if (const auto admitted = admitPoints(input.frame, full); !admitted) return admitted;
  const std::vector<const Track*> tracks = onceUsed(input.frame, full);
  const auto once = updateMsckf(*state_, tracks, options_.vision, reasons_);
  if (!once) return tl::unexpected(once.error());
  forgetUsed(tracks, input.frame);
  if (2 * once->supposed > once->used) widenBySupposedDepth();
  out.points_used = slam->used + once->used;
  out.points_refused = slam->gated + once->gated + once->behind;
  return {};
}

/// Enlarges the position covariance. The length of the path is as uncertain as the scene's depth,
/// from which it was computed.
void Estimator::widenBySupposedDepth() {
  const Clone* const last = previous_frame_ ? state_->clone(*previous_frame_) : nullptr;
  if (!last) return;
  const double before = supposed_m_;
  supposed_m_ += (state_->nav.p_WB - last->T_WB.p).norm();
  const double variance = supposed_m_ * supposed_m_ - before * before;
  state_->widenPositions(options_.vision.sceneSigma() * std::sqrt(variance));
}

void Estimator::report(const FrameInput& input, FrameEstimate& out) {
  const auto P = state_->P();
  // The covariance is that of the newest clone, which includes the error of the time offset.
  const Clone& newest = state_->clones.back();
  out.nav = state_->nav;
  out.covariance << P.block<6, 6>(newest.at, newest.at), P.block<6, 3>(newest.at, kVelocity),
      P.block<3, 6>(kVelocity, newest.at), P.block<3, 3>(kVelocity, kVelocity);
  const Clone* previous = previous_frame_ ? state_->clone(*previous_frame_) : nullptr;
  const Matrix6d P_now = P.block<6, 6>(newest.at, newest.at);
  if (previous) {
    // E[e_now e_prevᵀ] equals the cross-covariance with the clone's error after the update. The
    // update's correction of the clone is uncorrelated with the remaining present error.
    const Matrix6d cross = P.block<6, 6>(newest.at, previous->at);
    Matrix6d P_before = previous_pose_covariance_;
    P_before.diagonal().array() += 1e-12;
    out.transition = solveSymmetric(P_before, cross.transpose()).transpose();
    const Matrix6d Q = P_now - out.transition * cross.transpose();
    out.increment_covariance = withLeastEigenvalue(Q, 1e-12);
    out.has_increment = out.transition.allFinite() && out.increment_covariance.allFinite();
    out.increment_from = previous->frame;
  }
  previous_frame_ = input.frame;
  previous_pose_covariance_ = P_now;
}

void Estimator::marginalise(bool at_rest) {
  const std::size_t n = state_->clones.size();
  if (at_rest && n >= 2) {
    // The newest pose equals the previous one. Removing the previous one preserves the window's
    // baseline.
    const std::uint64_t frame = state_->clones[n - 2].frame;
    database_.removeFrame(frame);
    state_->removeClone(frame);
  } else if (asInt(n) > options_.window.clones) {
    const std::uint64_t frame = state_->clones.front().frame;
    database_.removeFrame(frame);
    state_->removeClone(frame);
  }
}

Result<void> Estimator::sane() const {
  if (!state_->healthy()) return fail("numbers_not_finite");
  if (state_->nav.v_WB.norm() > kMaxSpeed) return fail("numbers_speed_absurd");
  if (state_->nav.gyro_bias.norm() > kMaxGyroBias) return fail("numbers_gyro_bias_absurd");
  if (state_->nav.accel_bias.norm() > kMaxAccelBias) return fail("numbers_accel_bias_absurd");
  if ((state_->gyro_scale.array() - 1.0).abs().maxCoeff() > kMaxScaleError) {
    return fail("numbers_gyro_scale_absurd");
  }
  if (state_->P().diagonal().segment<3>(kVelocity).maxCoeff() > kMaxSpeedSigma * kMaxSpeedSigma) {
    return fail("numbers_velocity_unknown");
  }
  return {};
}

Result<FrameEstimate> Estimator::process(const FrameInput& input, const ImuBuffer& imu) {
  check(started(), "the estimator has been started");
  FrameEstimate out;
  const TimePoint from = state_->time;
  if (const auto done = propagateTo(input, imu); !done) return tl::unexpected(done.error());
  if (options_.speed.enabled && input.speed) {
    const auto done = updateSpeed(*state_, input.speed->speed, input.speed->sigma, options_.speed);
    if (!done) reasons_.add(done.error());
    out.speed_refused = !done && done.error().code == "speed_gated";
  }
  out.at_rest = restUpdate(input, imu, from);
  if (out.at_rest) {
    dropLostPoints(input.frame);
  } else if (const auto done = visionUpdate(input, out); !done) {
    stop();
    return fail("numbers_" + done.error().code);
  }
  if (const auto fine = sane(); !fine) {
    stop();
    return tl::unexpected(fine.error());
  }
  if (mount_.judge(MountPose::of(*state_), state_->time)) {
    reasons_.add("camera_turned_on_body");
    T_BC_ = state_->T_BC;
  }
  measureRows(imu);
  newest_ = input.tracked;
  report(input, out);
  marginalise(out.at_rest);
  return out;
}

Landmark Estimator::ofState(const PointState& point, const ImagePoint& seen) const {
  const auto P = state_->P();
  Landmark l;
  l.id = point.id;
  l.p_W = point.p_W;
  l.pixel = seen.pixel;
  l.cross_pose = P.block<3, 6>(point.at, state_->clones.back().at);
  const int pose = state_->clones.back().at;
  Matrix6d P_pose = P.block<6, 6>(pose, pose);
  P_pose.diagonal().array() += 1e-12;
  const Eigen::Matrix3d given = P.block<3, 3>(point.at, point.at) -
                                l.cross_pose * solveSymmetric(P_pose, l.cross_pose.transpose());
  l.covariance = withLeastEigenvalue(given, 1e-10);
  return l;
}

std::optional<Landmark> Estimator::ofTrack(const Track& track, const ImagePoint& seen) const {
  const auto point = triangulate(raysOf(track, *state_, options_.vision.sigma_px), options_.vision);
  if (!point || point->rms > 2.0) return std::nullopt;
  Landmark l;
  l.id = track.id;
  l.p_W = point->p_W;
  l.pixel = seen.pixel;
  l.covariance = point->covariance;
  const int pose = state_->clones.back().at;
  l.cross_pose = crossOfRigid(point->p_W, state_->nav.T_WB(), state_->P().block<6, 6>(pose, pose));
  return l;
}

std::vector<Landmark> Estimator::landmarks() const {
  std::vector<Landmark> result;
  if (!state_ || state_->clones.empty()) return result;
  std::map<std::uint64_t, const PointState*> points;
  for (const PointState& p : state_->points) points[p.id] = &p;
  for (const TrackedPoint& seen : newest_.points) {
    if (const auto it = points.find(seen.id); it != points.end()) {
      result.push_back(ofState(*it->second, *seen.seen[0]));
      continue;
    }
    const Track* track = database_.find(seen.id);
    if (!track || asInt(track->views()) < options_.window.min_observations) continue;
    if (const auto landmark = ofTrack(*track, *seen.seen[0])) result.push_back(*landmark);
  }
  return result;
}

}  // namespace perdure::vio
