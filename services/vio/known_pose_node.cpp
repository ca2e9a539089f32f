#include "services/vio/known_pose_node.h"

#include <algorithm>
#include <chrono>

#include "common/camera/camera_model.h"
#include "common/math/so3.h"
#include "common/vision/image.h"
#include "services/vio/core/tracks/descriptor.h"

namespace perdure::vio {
namespace {

constexpr std::size_t kPoses = 256;  // largest number of poses that wait for frames

constexpr char kNoPose[] =
    "frames have no pose; start what publishes odometry, with the stamps of the frames";
constexpr char kNoStart[] = "the poses may not be used yet: their program has no start";
constexpr char kContradicted[] =
    "the poses do not fit what the camera sees: they are of another body or in other axes than "
    "T_BS of the calibration says, inverted (T_BW for T_WB), on another clock, or nearly all that "
    "is seen moves; fix T_BS or the program that gives the poses";
constexpr char kFar[] =
    "nearly all points lie beyond vision.max_depth; raise it, or see that the poses are in metres";

}  // namespace

KnownPoseNode::KnownPoseNode(const Config& config, InstanceId instance, Sink<Landmarks> landmarks)
    : config_(config),
      instance_(instance),
      landmarks_(std::move(landmarks)),
      moving_(config.moving_mask),
      waiting_(config.pair_tolerance_s) {}

const ReasonCounts& KnownPoseNode::reasons() const {
  all_reasons_ = reasons_;
  if (!cameras_) return all_reasons_;
  for (const auto& [code, count] : cameras_->tracker.reasons().all()) {
    all_reasons_.add(code, count);
  }
  return all_reasons_;
}

void KnownPoseNode::onCalibration(const Calibration& calibration) {
  if (calibration.cameras.empty()) return reasons_.add("calibration_without_camera");
  if (calibration_ && sameCameras(*calibration_, calibration)) return;
  waiting_.clear();
  last_.reset();
  agreement_.clear();
  calibration_ = calibration;
  std::vector<CameraModel> models = usedCameras(config_, calibration);
  cameras_ = std::make_unique<Cameras>(config_, std::move(models));
}

HealthState KnownPoseNode::health() const {
  if (!other_size_.sentence().empty()) return HealthState::kDegraded;
  if (!last_) return HealthState::kStarting;
  return status().empty() ? HealthState::kOk : HealthState::kDegraded;
}

std::string KnownPoseNode::status() const {
  if (!cameras_) return "waits for the calibration; start capture";
  if (!other_size_.sentence().empty()) return other_size_.sentence();
  if (!in_vain_.sentence().empty()) return in_vain_.sentence();
  if (!last_image_ && waiting_.empty()) return "waits for frames; start capture, or fix the camera";
  if (!last_) return "waits for poses of its frames; start what publishes odometry";
  if (auto wrong = statusOfPoses(); !wrong.empty()) return wrong;
  if (auto unknown = unknownCamera(config_, *calibration_); !unknown.empty()) return unknown;
  return cameras_->models.size() == 2 ? waiting_.whyAlone() : std::string();
}

std::string KnownPoseNode::statusOfPoses() const {
  switch (agreement_.verdict()) {
    case Agreement::Verdict::kContradicted:
      return kContradicted;
    case Agreement::Verdict::kFar:
      return kFar;
    case Agreement::Verdict::kGood:
      break;
  }
  return {};
}

void KnownPoseNode::judgePoses() {
  const PointMapper& mapper = cameras_->mapper;
  agreement_.add(mapper.mapped(), mapper.scale(), mapper.moved());
  const auto verdict = agreement_.verdict();
  if (verdict == Agreement::Verdict::kContradicted) reasons_.add("poses_contradict_images");
  if (verdict == Agreement::Verdict::kFar) reasons_.add("points_too_far");
}

std::optional<std::uint64_t> KnownPoseNode::waitsFor() const {
  if (waiting_.empty()) return std::nullopt;
  return waiting_.front().first.stamp.sequence;
}

/// Returns true if `time` is before `newest` by more than transports reorder messages.
bool KnownPoseNode::isBefore(TimePoint time, const std::optional<TimePoint>& newest) const {
  return newest && time < *newest - std::chrono::milliseconds(300);
}

/// Discards all data: the clock restarted, or one stamp was far ahead.
void KnownPoseNode::clockJumpedBack() {
  reasons_.add("clock_jumped_back");
  waiting_.clear();
  poses_.clear();
  newest_frame_.reset();
  last_image_.reset();
  last_.reset();
  agreement_.clear();
  if (!cameras_) return;
  cameras_->tracker.reset();
  cameras_->mapper.clear();
}

void KnownPoseNode::giveUp(const Reason& reason, const char* why) {
  reasons_.add(reason);
  in_vain_.add(why, kInVain);
}

void KnownPoseNode::onOdometry(const Odometry& odometry) {
  if (!odometry.T_WB.finite() || !odometry.covariance.allFinite() || !odometry.v_WB.allFinite()) {
    return reasons_.add("odometry_not_finite");
  }
  const TimePoint time = odometry.stamp.time;
  if (isBefore(time, last_image_) || (!poses_.empty() && isBefore(time, poses_.back().stamp.time)))
    clockJumpedBack();
  if ((last_image_ && odometry.stamp.time <= *last_image_) ||
      (!poses_.empty() && odometry.stamp.time < poses_.back().stamp.time)) {
    return reasons_.add("odometry_late");
  }
  poses_.push_back(odometry);
  if (poses_.size() > kPoses) poses_.pop_front();
  drain(false);
}

void KnownPoseNode::onFrame(const Frame& frame) {
  if (!cameras_) return reasons_.add("frame_before_calibration");
  const auto& models = cameras_->models;
  const auto camera = cameraOf(frame, models, *calibration_, reasons_);
  if (!camera) return;
  const bool second = *camera == 1;
  if (auto why = otherSize(frame, models[*camera]); !why.empty()) {
    second ? waiting_.refuseSecond(std::move(why)) : other_size_.add(std::move(why), kOtherSizes);
    return reasons_.add("frame_size_differs");
  }
  if (!second) {
    other_size_.clear();
    if (isBefore(frame.stamp.time, newest_frame_)) clockJumpedBack();
    newest_frame_ = std::max(newest_frame_.value_or(frame.stamp.time), frame.stamp.time);
  }
  if (!second && last_image_ && frame.stamp.time <= *last_image_) return reasons_.add("frame_late");
  const auto added = second ? waiting_.addSecond(frame) : waiting_.addFirst(frame);
  if (!added) reasons_.add(added.error());
  if (static_cast<std::int64_t>(waiting_.size()) > config_.max_pending) {
    waiting_.take();
    giveUp({"frame_without_pose", ""}, kNoPose);
  }
  drain(false);
}

const Odometry* KnownPoseNode::poseOf(const Frame& frame) const {
  const auto found = std::find_if(poses_.begin(), poses_.end(), [&](const Odometry& o) {
    return o.stamp.sameFrame(frame.stamp);
  });
  return found == poses_.end() ? nullptr : &*found;
}

void KnownPoseNode::drain(bool all) {
  while (cameras_ && !waiting_.empty()) {
    const FramePair& front = waiting_.front();
    const Odometry* pose = poseOf(front.first);
    // Poses arrive in order. A later pose therefore shows that this frame has none.
    if (!pose && (poses_.empty() || poses_.back().stamp.time <= front.first.stamp.time)) return;
    if (pose && !all && cameras_->models.size() == 2 && waiting_.frontMayBePaired()) return;
    const FramePair frames = waiting_.take();
    last_image_ = frames.first.stamp.time;
    if (pose && pose->state != OdometryState::kInitialising) {
      process(frames, *pose);
    } else {
      giveUp({"frame_without_pose", ""}, pose ? kNoStart : kNoPose);
    }
    std::erase_if(poses_, [&](const Odometry& o) { return o.stamp.time <= *last_image_; });
  }
}

void KnownPoseNode::begin(const WorldId& world) {
  if (last_ && last_->world == world) return;
  cameras_->mapper.clear();
  agreement_.clear();
  last_.reset();
}

void KnownPoseNode::process(const FramePair& frames, const Odometry& odometry) {
  const auto first = vision::monoOf(frames.first);
  if (!first) return giveUp(first.error(), kNoImage);
  const cv::Mat second = secondImage(frames, cameras_->models.size() == 2, reasons_);
  begin(odometry.world);
  std::optional<Eigen::Matrix3d> R;
  KnownPose pose{odometry.T_WB, odometry.covariance.topLeftCorner<6, 6>(), odometry.v_WB, {}};
  pose.rate_B.setZero();
  if (last_) {
    R = (odometry.T_WB.q.conjugate() * last_->T_WB.q).toRotationMatrix();
    const double s = toSeconds(odometry.stamp.time - last_->stamp.time);
    if (s > 0.0) pose.rate_B = logSo3(last_->T_WB.q.conjugate() * odometry.T_WB.q) / s;
  }
  const auto masked =
      moving_.boxes(cameras_->models[0], odometry.world, odometry.T_WB, odometry.stamp.time);
  const Eigen::Vector3d turn = cameras_->models[0].calibration().readout_s * pose.rate_B;
  cameras_->mapper.add(pose, cameras_->tracker.track(*first, second, R, masked, turn));
  judgePoses();
  last_ = odometry;
  in_vain_.clear();
  landmarks_(landmarksMessage(odometry.stamp, instance_, odometry.world,
                              cameras_->models[0].calibration().name, cameras_->mapper.landmarks(),
                              *first));
}

}  // namespace perdure::vio
