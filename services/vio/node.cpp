#include "services/vio/node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/vision/image.h"
#include "services/vio/core/tracks/descriptor.h"

namespace perdure::vio {
namespace {

constexpr int kUnaidedFrames = 5;  // more frames without an update by the image: degraded

constexpr char kLate[] =
    "frames are older than those before them; the camera's clock jumped back and the IMU's did "
    "not: give both one clock";
constexpr char kNoSamples[] =
    "frames have no inertial samples of their time; start the IMU, or give both one clock";

constexpr char kPositionUncertain[] =
    "the position is uncertain: its deviation grew by more than odometry.position_growth in ten "
    "seconds; let the camera see things nearby and move sideways, or calibrate the rig";

constexpr char kImagesContradict[] =
    "most of what the images show contradicts the IMU: see T_BS (is it the inverse?), the IMU's "
    "axes, signs and units (radians per second), the focal length and time_offset_s; or what moves "
    "fills the picture";

}  // namespace

Node::Node(const Config& config, InstanceId instance, Outputs outputs)
    : config_(config),
      instance_(instance),
      outputs_(std::move(outputs)),
      world_{instance, 0},
      speeds_(config.core.speed.max_age_s),
      waiting_(config.pair_tolerance_s),
      moving_(config.moving_mask),
      position_doubt_(config.position_growth_m),
      motion_initialiser_(config.core) {}

const ReasonCounts& Node::reasons() const {
  all_reasons_ = reasons_;
  if (cameras_) {
    for (const auto* more : {&cameras_->estimator.reasons(), &cameras_->tracker.reasons()}) {
      for (const auto& [code, count] : more->all()) all_reasons_.add(code, count);
    }
  }
  return all_reasons_;
}

void Node::onCalibration(const Calibration& calibration) {
  if (calibration.cameras.empty()) return reasons_.add("calibration_without_camera");
  if (calibration_ && sameCameras(*calibration_, calibration)) {
    calibration_->has_speed = calibration.has_speed;
    return news_.begin(calibration);
  }
  if (calibration_) {
    if (started()) lose({"calibration_changed", ""});
    waiting_.clear();
  }
  agreement_.clear();
  calibration_ = calibration;
  news_.begin(calibration);
  std::vector<CameraModel> models = usedCameras(config_, calibration);
  Options options = config_.core;
  useDeviations(models[0].calibration().deviations, options.calibration);
  if (config_.prefer_calibration && calibration.imu && calibration.imu->gyro_noise > 0 &&
      calibration.imu->accel_noise > 0) {
    options.imu.gyro = calibration.imu->gyro_noise;
    options.imu.accel = calibration.imu->accel_noise;
    options.imu.gyro_walk = std::max(calibration.imu->gyro_bias_walk, 1e-7);
    options.imu.accel_walk = std::max(calibration.imu->accel_bias_walk, 1e-6);
  }
  options.imu.inflation = config_.imu_inflation;
  options.calibration.gyro_scale = config_.gyro_scale;
  cameras_ = std::make_unique<Cameras>(config_, options, models);
  if (outputs_.innovations) cameras_->estimator.keepInnovations();
  motion_initialiser_ = MotionInitialiser(options);
}

HealthState Node::health() const {
  if (!in_vain_.sentence().empty()) return HealthState::kDegraded;
  if (last_state_ == OdometryState::kTracking) {
    return status().empty() ? HealthState::kOk : HealthState::kDegraded;
  }
  return last_state_ == OdometryState::kDegraded ? HealthState::kDegraded : HealthState::kStarting;
}

std::string Node::whyAlone() const {
  if (!cameras_) return {};
  if (auto unknown = unknownCamera(config_, *calibration_); !unknown.empty()) return unknown;
  return cameras_->models.size() == 2 ? waiting_.whyAlone() : std::string();
}

std::string Node::status() const {
  if (!cameras_) return "waits for the calibration; start capture";
  if (!in_vain_.sentence().empty()) return in_vain_.sentence();
  if (imu_.empty()) return "waits for inertial samples; start capture, or fix the IMU";
  if (!last_image_) return "waits for frames; start capture, or fix the camera";
  if (!started() && last_start_reason_ == "start_picture_moves_imu_does_not") {
    return "has no start yet: the IMU is at rest or moves evenly, and most of the picture moves; "
           "let traffic pass, or drive off";
  }
  if (!started() && last_start_reason_ == "start_force_not_gravity") {
    return "has no start: the accelerations are not those of gravity and motion; see their unit "
           "(m/s²) and which columns they are in";
  }
  if (!started()) {
    return "has no start yet (" + last_start_reason_ +
           "); stand still for a second, or move with the camera on things that stand";
  }
  if (agreement_.verdict() == Agreement::Verdict::kContradicted) return kImagesContradict;
  if (started() && *speed_doubt_.sentence() != '\0') return speed_doubt_.sentence();
  if (const auto turn = cameras_->estimator.mountTurn()) {
    return fmt::format(
        "the camera has turned on the body by {:.1f}°; fasten it, then calibrate the rig again",
        *turn * 180.0 / M_PI);
  }
  if (last_state_ != OdometryState::kDegraded) return whyAlone();
  if (position_doubt_.uncertain()) return kPositionUncertain;
  return degraded_frames_ > 0 ? "has just come over a gap or a restart"
                              : "sees no points; it goes by inertia (and speed)";
}

/// Discards all data, because the clock restarted.
void Node::clockJumpedBack() {
  if (!started()) reasons_.add("clock_jumped_back");
  imu_.clear();
  speeds_.clear();
  waiting_.clear();
  motion_initialiser_.clear();
  last_image_.reset();
  last_imu_time_.reset();
  agreement_.clear();
  if (started()) lose({"clock_jumped_back", ""});
}

void Node::onImu(const ImuSample& sample) {
  // Transports reorder samples by less than this time.
  if (!imu_.empty() && sample.time < imu_.last() - std::chrono::milliseconds(300)) {
    clockJumpedBack();
  }
  const auto added = imu_.add({sample.time, sample.gyro, sample.accel});
  if (!added) reasons_.add(added.error());
  if (!last_imu_time_) {
    // Before the first frame, only the last seconds are needed.
    imu_.dropBefore(sample.time - std::chrono::seconds(5));
  }
  drain(false);
}

void Node::onSpeed(const SpeedSample& sample) {
  const auto added = speeds_.add(sample);
  if (!added) return reasons_.add(added.error());
  drain(false);
}

void Node::onFrame(const Frame& frame) {
  if (!cameras_) return reasons_.add("frame_before_calibration");
  const auto camera = cameraOf(frame, cameras_->models, *calibration_, reasons_);
  if (!camera) return;
  const bool second = *camera == 1;
  if (auto why = otherSize(frame, cameras_->models[*camera]); !why.empty()) {
    second ? waiting_.refuseSecond(std::move(why)) : in_vain_.add(std::move(why), kOtherSizes);
    return reasons_.add("frame_size_differs");
  }
  if (!second && last_image_ && frame.stamp.time <= *last_image_) {
    in_vain_.add(kLate, kInVain);
    return reasons_.add("frame_late");
  }
  const auto added = second ? waiting_.addSecond(frame) : waiting_.addFirst(frame);
  if (!added) reasons_.add(added.error());
  if (static_cast<std::int64_t>(waiting_.size()) > config_.max_pending) {
    reasons_.add("frame_without_imu");
    in_vain_.add(kNoSamples, kInVain);
    publishWaiting(waiting_.take().first.stamp);
  }
  drain(false);
}

TimePoint Node::imuTime(TimePoint image_time) const {
  const double offset = started() ? cameras_->estimator.state().time_offset_s
                                  : cameras_->models[0].calibration().time_offset_s;
  return image_time + durationFromSeconds(offset);
}

bool Node::waitsForPair() const {
  if (cameras_->models.size() < 2 || !waiting_.frontMayBePaired()) return false;
  // Waits until samples are half a second later.
  return imu_.empty() ||
         imu_.last() < waiting_.front().first.stamp.time + std::chrono::milliseconds(500);
}

bool Node::ready() const {
  TimePoint now = imuTime(waiting_.front().first.stamp.time);
  if (imu_.empty()) return false;
  // Samples are needed until the last row has been read out.
  now += durationFromSeconds(0.5 * std::max(0.0, std::ranges::max(readouts(cameras_->models))));
  // The last sample may be used for a further quarter of a period.
  if (const auto period = imu_.period()) now -= *period / 4;
  if (imu_.last() < now + durationFromSeconds(config_.imu_slack_s)) return false;
  if (waitsForPair()) return false;
  if (!config_.core.speed.enabled || !calibration_->has_speed) return true;
  return speeds_.reaches(now) || imu_.last() >= now + durationFromSeconds(config_.speed_wait_s);
}

void Node::drain(bool all) {
  while (cameras_ && !waiting_.empty() && (all || ready())) process(waiting_.take());
}

/// IMU time of the state, or of the last frame before a start.
TimePoint Node::timeBefore(TimePoint now) const {
  return started() ? cameras_->estimator.state().time : last_imu_time_.value_or(now);
}

void Node::noteGaps(TimePoint now) {
  const TimePoint from = timeBefore(now);
  if (from >= now || imu_.empty()) return;
  const double gap = toSeconds(imu_.longestGap(from, now));
  if (gap <= config_.core.imu.gap_from_s) return;
  reasons_.add("imu_gap");
  degraded_frames_ = kDegradedFrames;
  if (!started()) return;
  if (gap > config_.longest_gap_s) return lose({"imu_gap_too_long", ""});
  // If neither images nor samples arrived, the clock jumped or the body moved unobserved.
  if (std::min(gap, toSeconds(now - from)) > config_.longest_blackout_s) {
    lose({"clock_jumped_or_blackout", ""});
  }
}

TrackedFrame Node::trackImages(const cv::Mat& first, const cv::Mat& second, TimePoint now) {
  if (cameras_->estimator.options().calibration.estimated().lens) {
    cameras_->tracker.setCameras(cameras_->estimator.cameras(cameras_->models));
  }
  // With the rotation, the tracker follows points through fast turns, and a minority of points at
  // rest behind traffic.
  std::optional<Eigen::Matrix3d> R;
  const TimePoint from = timeBefore(now);
  if (from < now && !imu_.empty() && imu_.last() > from &&
      toSeconds(imu_.longestGap(from, now)) <= config_.core.imu.gap_from_s) {
    R = cameras_->estimator.predictRotation(imu_, from, now);
  }
  const Eigen::Vector3d turn = cameras_->estimator.turnOfReadout(imu_, now);
  if (!started()) return cameras_->tracker.track(first, second, R, {}, turn);
  const State& state = cameras_->estimator.state();
  RigidTransform T_WB = state.nav.T_WB();
  T_WB.p += toSeconds(now - state.time) * state.nav.v_WB;
  if (R) T_WB.q = T_WB.q * Eigen::Quaterniond(R->transpose());
  const auto masked = moving_.boxes(cameras_->models[0], world_, T_WB, *last_image_);
  return cameras_->tracker.track(first, second, R, masked, turn);
}

void Node::process(const FramePair& frames) {
  const FrameStamp& stamp = frames.first.stamp;
  last_image_ = stamp.time;
  const auto first = vision::monoOf(frames.first);
  if (!first) {
    in_vain_.add(kNoImage, kInVain);
    reasons_.add(first.error());
    return publishWaiting(stamp);
  }
  in_vain_.clear();
  const cv::Mat second = secondImage(frames, cameras_->models.size() == 2, reasons_);
  const TimePoint now = imuTime(stamp.time);
  noteGaps(now);
  FrameInput input{++frame_, stamp.time, trackImages(*first, second, now), {}, {}};
  input.motion_px =
      cameras_->tracker.motionSince(static_cast<std::size_t>(config_.core.rest.frames));
  input.most_motion_px =
      cameras_->tracker.motionSince(static_cast<std::size_t>(config_.core.rest.frames), 0.8);
  input.still_share = cameras_->tracker.stillShare(framesIn(1.0));
  if (config_.core.speed.enabled) input.speed = speeds_.at(now);
  if (!started()) begin(now, input);
  if (!started()) {
    last_imu_time_ = now;
    imu_.dropBefore(now - std::chrono::seconds(3));
    return publishWaiting(stamp);
  }
  const auto estimate = cameras_->estimator.process(input, imu_);
  last_imu_time_ = now;
  if (!estimate) {
    if (started()) {
      reasons_.add(estimate.error());
    } else {
      lose(estimate.error());
    }
    return publishWaiting(stamp);
  }
  imu_.dropBefore(cameras_->estimator.state().time - std::chrono::seconds(3));
  judgeImages(*estimate);
  if (const auto cameras = news_.take(cameras_->estimator, cameras_->models)) {
    if (outputs_.calibration) outputs_.calibration(*cameras);
  }
  publish(stamp, *estimate);
  publishLandmarks(stamp, *first);
  if (outputs_.innovations) outputs_.innovations(estimate->innovations);
}

void Node::judgeImages(const FrameEstimate& estimate) {
  const Mapped mapped{static_cast<std::size_t>(estimate.points_refused), 0,
                      static_cast<std::size_t>(estimate.points_used)};
  agreement_.add(mapped, 1.0, !estimate.at_rest);
  speed_doubt_.add(cameras_->estimator.state().time, estimate.speed_refused);
  if (agreement_.verdict() == Agreement::Verdict::kContradicted) {
    reasons_.add("images_contradict_imu");
  }
}

void Node::lose(const Reason& reason) {
  reasons_.add(reason);
  reasons_.add("reset");
  if (cameras_) {
    cameras_->estimator.stop();
    cameras_->tracker.reset();
  }
  motion_initialiser_.clear();
  position_doubt_.clear();
  ++world_.epoch;
  last_sequence_.reset();
  aided_ = false;
}

void Node::publishWaiting(const FrameStamp& stamp) {
  Odometry o;
  o.stamp = stamp;
  o.instance = instance_;
  o.world = world_;
  o.covariance = Matrix9d::Identity();
  last_state_ = o.state;
  last_sequence_.reset();
  if (outputs_.odometry) outputs_.odometry(o);
}

void Node::publish(const FrameStamp& stamp, const FrameEstimate& e) {
  Odometry o;
  o.stamp = stamp;
  o.instance = instance_;
  o.world = world_;
  const bool unaided = !e.at_rest && e.points_used == 0;
  unaided_frames_ = unaided ? unaided_frames_ + 1 : 0;
  // The first points are used some ten frames after a start.
  constexpr int kFirstFrames = 20;
  aided_ = aided_ || e.points_used > 0;
  const bool late = unaided_frames_ == kFirstFrames;
  if (unaided && (aided_ || unaided_frames_ >= kFirstFrames)) {
    reasons_.add("frame_without_update", !aided_ && late ? kFirstFrames : 1);
  }
  const bool uncertain = position_doubt_.add(stamp.time, e.nav.p_WB, e.covariance);
  if (uncertain) reasons_.add("position_uncertain");
  const bool degraded = degraded_frames_ > 0 || unaided_frames_ > kUnaidedFrames || uncertain;
  if (degraded_frames_ > 0) --degraded_frames_;
  o.state = degraded ? OdometryState::kDegraded : OdometryState::kTracking;
  o.T_WB = e.nav.T_WB();
  o.v_WB = e.nav.v_WB;
  o.covariance = e.covariance;
  o.gyro_bias = e.nav.gyro_bias;
  o.accel_bias = e.nav.accel_bias;
  if (e.has_increment && last_sequence_) {
    o.has_increment = true;
    o.increment_from = *last_sequence_;
    o.transition = e.transition;
    o.increment_covariance = e.increment_covariance;
  }
  last_sequence_ = stamp.sequence;
  last_state_ = o.state;
  if (outputs_.odometry) outputs_.odometry(o);
}

void Node::publishLandmarks(const FrameStamp& stamp, const cv::Mat& image) {
  if (!outputs_.landmarks) return;
  outputs_.landmarks(landmarksMessage(stamp, instance_, world_,
                                      cameras_->models[0].calibration().name,
                                      cameras_->estimator.landmarks(), image));
}

}  // namespace perdure::vio
