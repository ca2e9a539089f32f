#include "services/semantic_filter/node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/tracks/context.h"
#include "services/semantic_filter/core/visibility/predicted_box.h"

namespace perdure::semantic_filter {
namespace {

constexpr std::size_t kMaxEarly = 16;
constexpr std::chrono::seconds kFuture{10};  // further ahead of odometry nothing waits for it

}  // namespace

Node::Node(const Config& config, const ClassPriors& priors, InstanceId instance, Outputs outputs)
    : config_(config),
      instance_(instance),
      outputs_(std::move(outputs)),
      filter_(config.filter, priors),
      models_(priors),
      drift_(config.filter.drift),
      archive_(config.filter.memory, config.filter.motion.min_speed),
      former_(config.filter) {}

void Node::onCalibration(const Calibration& calibration) {
  if (calibration.cameras.empty()) {
    reasons_.add("calibration_without_camera");
    return;
  }
  flush();
  camera_ = std::make_shared<const CameraModel>(calibration.cameras.front());
  camera_name_ = calibration.cameras.front().name;
}

void Node::onModel(const ModelInfo& model) {
  if (const auto added = models_.add(model); !added) reasons_.add(added.error());
}

void Node::advancePoseError(const Odometry& odometry) {
  const PoseParameters& pose = config_.filter.pose;
  const bool walks = !odometry.has_increment ||
                     (pose.drift_position > 0.0 && !odometry.increment_covariance.isZero(0.0));
  if (!walks) {
    pose_error_.covariance = odometry.covariance.topLeftCorner<6, 6>();
    pose_error_.product = (odometry.transition * pose_error_.product).eval();
  } else if (last_T_WB_) {
    // A random walk in W, by distance travelled. The error of rotation is the body's: it turns
    // against it.
    Matrix6d A = Matrix6d::Identity();
    A.topLeftCorner<3, 3>() = odometry.T_WB.R().transpose() * last_T_WB_->R();
    const double position = odometry.has_increment ? pose.drift_position : pose.walk_position;
    const double rotation = odometry.has_increment ? pose.drift_rotation : pose.walk_rotation;
    Eigen::Matrix<double, 6, 1> q;
    q << Eigen::Vector3d::Constant(rotation * rotation),
        Eigen::Vector3d::Constant(position * position);
    const double metres = (odometry.T_WB.p - last_T_WB_->p).norm();
    pose_error_.covariance = (A * pose_error_.covariance * A.transpose()).eval();
    pose_error_.covariance.diagonal() += metres * q;
    pose_error_.product = (A * pose_error_.product).eval();
    drift_.predict(inM(*last_T_WB_), inM(odometry.T_WB), rotation, position);
  }
  last_T_WB_ = odometry.T_WB;
}

FrameInput Node::makeInput(const Odometry& odometry) {
  FrameInput input;
  input.stamp = odometry.stamp;
  input.view.camera = camera_.get();
  input.view.T_WB = inM(odometry.T_WB);
  input.view.up_W = odometry.up_W;
  input.pose_error = pose_error_;
  return input;
}

void Node::beginWorld(const WorldId& world) {
  if (world_) {
    reasons_.add("world_changed");
    keepFormer();
  }
  world_ = world;
  belief_ = {.tracks = {}, .recently_deleted = {}, .learned = belief_.learned};
  history_.clear();
  pose_error_ = {};
  last_T_WB_.reset();
  T_MW_.reset();
  told_not_level_ = false;
  drift_ = DriftEstimator(config_.filter.drift);
  events_.clear();
  returns_.clear();
  archive_.clear();
  if (const auto recalled = std::exchange(waiting_recalled_, std::nullopt)) {
    recalled->world == world ? insertRecalled(*recalled) : onRecalledOfFormer(*recalled);
  }
}

void Node::onOdometry(const Odometry& odometry) {
  if (!camera_) return reasons_.add("odometry_before_calibration");
  if (odometry.state == OdometryState::kInitialising) return reasons_.add("odometry_initialising");
  if (!odometry.T_WB.finite() || !odometry.up_W.allFinite() || odometry.up_W.norm() < 0.5) {
    return reasons_.add("odometry_not_finite");
  }
  flush();
  if (!world_ || *world_ != odometry.world) beginWorld(odometry.world);
  if (!history_.empty() && odometry.stamp.time <= history_.back().input.stamp.time) {
    return reasons_.add("odometry_not_newer");
  }
  advancePoseError(odometry);
  history_.push_back({makeInput(odometry), odometry.world, camera_, {}, false});
  if (history_.size() > static_cast<std::size_t>(config_.history.frames)) {
    spare_ = std::move(history_.front().before);
    history_.pop_front();
    ids_.forgetBefore(history_.front().input.stamp.sequence);
  }
  Entry& entry = history_.back();
  const auto early = std::find_if(early_.begin(), early_.end(), [&](const Detections& d) {
    return d.stamp.sameFrame(entry.input.stamp);
  });
  if (early != early_.end()) {
    attach(entry, *early);
    early_.erase(early);
  }
  forgetEarlyBefore(odometry.stamp.time);
  if (entry.input.boxes || !config_.history.wait_for_detections) flush();
}

void Node::onLandmarks(const Landmarks& landmarks) {
  for (auto& entry : history_) {
    if (!entry.input.stamp.sameFrame(landmarks.stamp)) continue;
    if (entry.stepped) reasons_.add("landmarks_after_step");
    const Eigen::Vector3d centre = inW(entry.input.view.T_WB) * entry.input.view.camera->T_BC().p;
    entry.input.points.clear();
    for (const auto& landmark : landmarks.landmarks) {
      if (!landmark.p_W.allFinite() || !landmark.covariance.allFinite()) continue;
      const Eigen::Vector3d ray = landmark.p_W - centre;
      const Eigen::Vector3d along = ray.normalized();
      const double variance = along.dot(landmark.covariance * along);
      entry.input.points.push_back(
          {landmark.pixel, ray.norm(), std::sqrt(std::max(variance, 0.0))});
    }
    return;
  }
  reasons_.add("landmarks_of_unknown_frame");
}

/// Why a message is no evidence, as Health counts it; nullptr where it may be.
const char* Node::refusalOf(const Detections& detections) const {
  if (camera_ && !detections.camera.empty() && detections.camera != camera_name_) {
    return "detections_of_other_camera";
  }
  const Model* model = models_.find(detections.model_hash);
  if (!model) return "detections_of_unknown_model";
  for (const auto& detection : detections.detections) {
    if (const char* flaw = flawOf(detection, *model)) return flaw;
  }
  return nullptr;
}

bool Node::attach(Entry& entry, const Detections& detections) {
  if (const char* refusal = refusalOf(detections)) {
    reasons_.add(refusal);
    return false;
  }
  if (inflations(entry, detections)) return true;  // the frame stays without evidence
  return use(entry, detections);
}

bool Node::use(Entry& entry, const Detections& detections) {
  if (entry.input.boxes) {
    reasons_.add("detections_repeated");
    return false;
  }
  entry.input.model = *models_.find(detections.model_hash);
  if (const auto change = models_.use(detections.model_hash, entry.input.stamp.time)) {
    tellModelChange(entry.input.stamp, *change);
  }
  if (detections.input_scale > 0.0) entry.input.model.input_width *= detections.input_scale;
  entry.input.boxes.emplace();
  for (const auto& detection : detections.detections) {
    if (detection.primed) {
      auto ratios = topDownRatios(detection, entry.input.model, config_.filter.clutter);
      if (ratios) entry.input.top_down[detection.primed_for] = *std::move(ratios);
      if (!ratios) reasons_.add("primed_malformed");
      continue;
    }
    auto evidence =
        makeBoxDetection(detection, entry.input.model, entry.camera->width(),
                         entry.camera->height(), config_.filter.box, config_.filter.clutter);
    if (evidence) {
      entry.input.boxes->push_back(std::move(*evidence));
    } else {
      reasons_.add("detection_outside_image");
    }
  }
  return true;
}

void Node::onDetections(const Detections& detections) {
  for (std::size_t i = history_.size(); i-- > 0;) {
    Entry& entry = history_[i];
    if (!entry.input.stamp.sameFrame(detections.stamp)) continue;
    if (!attach(entry, detections)) return;
    if (!entry.stepped) return flush();
    reasons_.add("detections_late");
    return stepAgainFrom(i);
  }
  if (const char* refusal = refusalOf(detections)) return reasons_.add(refusal);
  if (!history_.empty()) {
    const TimePoint newest = history_.back().input.stamp.time;
    if (detections.stamp.time <= newest) return reasons_.add("detections_too_late");
    if (detections.stamp.time > newest + kFuture) return reasons_.add("detections_of_the_future");
  }
  keepEarly(detections);
}

/// Of too many the furthest ahead goes: invented stamps must not drive out what is needed next.
void Node::keepEarly(const Detections& detections) {
  for (const auto& d : early_) {
    if (d.stamp.sameFrame(detections.stamp)) return reasons_.add("detections_repeated");
  }
  early_.push_back(detections);
  if (early_.size() <= kMaxEarly) return;
  const auto sooner = [](const auto& a, const auto& b) { return a.stamp.time < b.stamp.time; };
  early_.erase(history_.empty() ? early_.begin()
                                : std::max_element(early_.begin(), early_.end(), sooner));
  reasons_.add("detections_without_odometry");
}

void Node::forgetEarlyBefore(TimePoint time) {
  const auto gone =
      std::erase_if(early_, [&](const Detections& d) { return d.stamp.time <= time; });
  if (gone > 0) reasons_.add("detections_without_odometry", gone);
}

/// Where the map lies is sought in yaw about z and position.
bool Node::isLevel(const Entry& entry) {
  constexpr double kLevel = 0.99;  // 8 degrees
  if (entry.input.view.up_W.normalized().z() > kLevel) return true;
  if (!std::exchange(told_not_level_, true)) reasons_.add("frame_not_level_to_place_map");
  return false;
}

void Node::stepEntry(Entry& entry) {
  if (entry.before.tracks.empty()) entry.before = std::exchange(spare_, {});
  const std::size_t n = belief_.tracks.size();
  if (entry.before.tracks.capacity() < n) entry.before.tracks.reserve(n + n / 4);
  entry.before = belief_;
  StepReport report = filter_.step(entry.before, belief_, entry.input, ids_);
  entry.merges = std::move(report.merges);
  if (report.broken > 0) reasons_.add("object_numbers_bad", report.broken);
  if (entry.input.boxes && !std::exchange(entry.drift_measured, true) && !report.drift.empty() &&
      isLevel(entry)) {
    drift_.add(report.drift, entry.input.view.T_WB);
  }
  entry.stepped = true;
}

void Node::stepAgainFrom(std::size_t index) {
  belief_ = history_[index].before;
  for (std::size_t i = index; i < history_.size(); ++i) {
    if (!history_[i].stepped) break;
    stepEntry(history_[i]);
    late_merges_.insert(late_merges_.end(), history_[i].merges.begin(), history_[i].merges.end());
  }
}

void Node::flush() {
  if (history_.empty() || history_.back().stepped) return;
  stepEntry(history_.back());
  rejoin(history_.back());
  letGo(history_.back());
  correctDrift();
  publish(history_.back());
  askTheMap(history_.back());
}

/// Takes the pose's error out of all that refers to it, frames that may be stepped again included.
void Node::correctDrift() {
  const auto correction = drift_.correct(history_.back().input.view.T_WB, pose_error_);
  if (!correction) return;
  const Matrix6d F = regressOn(correction->before, correction->after);
  for (Entry& e : history_) {
    for (Track& o : e.before.tracks) applyCorrection(o, *correction, e.input.pose_error);
    e.input.view.T_WB = correction->step * e.input.view.T_WB;
    e.input.pose_error.product = (F * e.input.pose_error.product).eval();
    e.input.pose_error.covariance = correction->after;
  }
  for (Track& o : belief_.tracks) applyCorrection(o, *correction, pose_error_);
  for (Track& o : belief_.recently_deleted) applyCorrection(o, *correction, pose_error_);
  pose_error_.product = (F * pose_error_.product).eval();
  pose_error_.covariance = correction->after;
  T_MW_ = inM(RigidTransform());
  T_MW_ = correction->step * *T_MW_;
}

void Node::publish(const Entry& entry) {
  Objects objects;
  objects.stamp = entry.input.stamp;
  objects.instance = instance_;
  objects.world = entry.world;
  objects.T_WB = inW(entry.input.view.T_WB);
  objects.up_W = entry.input.view.up_W;
  objects.next_id = ids_.next();
  const MotionParameters& motion = config_.filter.motion;
  objects.objects.reserve(belief_.tracks.size());
  for (const auto& object : belief_.tracks) {
    ObjectBelief& belief = objects.objects.emplace_back(toBelief(object, motion.min_speed));
    if (belief.moving > 0.5) {
      const Track now = extrapolated(object, entry.input.stamp.time, motion);
      belief.classes = toBelief(now, motion.min_speed).classes;
    }
    addContext(belief, object);
    if (T_MW_) belief = inW(std::move(belief));
  }
  late_merges_.insert(late_merges_.end(), entry.merges.begin(), entry.merges.end());
  auto events = events_.update(objects, late_merges_);
  late_merges_.clear();
  const auto coming = comingFrame(entry);
  Event blank;
  blank.stamp = objects.stamp, blank.instance = objects.instance, blank.world = objects.world;
  const auto returns = returns_.update(belief_.tracks, entry.input, coming, config_.filter, blank);
  events.insert(events.end(), returns.begin(), returns.end());
  if (outputs_.objects) outputs_.objects(objects);
  for (const auto& event : events) {
    if (outputs_.events) outputs_.events(event);
  }
  publishPredictions(entry, coming);
}

/// The frame after this one, if body and clock go on as since the frame before it.
std::optional<ComingFrame> Node::comingFrame(const Entry& entry) const {
  for (std::size_t i = 1; i < history_.size(); ++i) {
    if (&history_[i] != &entry) continue;
    const FrameInput& before = history_[i - 1].input;
    const double seconds = toSeconds(entry.input.stamp.time - before.stamp.time);
    if (seconds <= 0.0 || history_[i - 1].world != entry.world) return std::nullopt;
    ComingFrame coming{entry.input.view, seconds};
    coming.view.T_WB = entry.input.view.T_WB * (before.view.T_WB.inverse() * entry.input.view.T_WB);
    return coming;
  }
  return std::nullopt;
}

std::string Node::note() const {
  constexpr double kWorthSaying = 1.1;
  std::string note = former_.note();
  const BoxParameters& assumed = config_.filter.box;
  const auto say = [&](const char* what, double ratio) {
    const double times = std::sqrt(ratio);
    if (std::max(times, 1.0 / times) < kWorthSaying) return;
    if (!note.empty()) note += "; ";
    note += fmt::format("{} err {:.2f} times as far as was assumed", what, times);
  };
  say("boxes", belief_.learned.sides.ratio(models_.used(), assumed.assumed_sides));
  say("azimuths", belief_.learned.azimuths.ratio(models_.used(), assumed.assumed_azimuths));
  return note;
}

void Node::publishPredictions(const Entry& entry, const std::optional<ComingFrame>& coming) {
  if (!outputs_.predictions) return;
  Predictions predictions;
  predictions.stamp = entry.input.stamp;
  predictions.instance = instance_;
  predictions.camera = camera_name_;
  for (const auto& object : belief_.tracks) {
    auto prediction = predictionOf(object, entry.input, coming);
    if (prediction) predictions.predictions.push_back(*std::move(prediction));
  }
  outputs_.predictions(predictions);
}

}  // namespace perdure::semantic_filter
