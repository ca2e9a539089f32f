#include "services/gateway/node.h"

#include <algorithm>
#include <cmath>

#include "common/vision/jpeg.h"
#include "services/gateway/core/annotations.h"

namespace perdure::gateway {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::chrono::seconds kLongBack{2};  // a larger step back: another recording or drive
constexpr std::chrono::seconds kGap{1};       // sensor time; a longer gap interrupts the trajectory

}  // namespace

Node::Node(const Config& config, const std::string& vehicle, InstanceId instance, Outputs outputs)
    : config_(config),
      instance_(instance),
      outputs_(std::move(outputs)),
      vital_signs_(vehicle),
      cameras_(config.cameras.size()),
      image_pace_(config.cameras.size(), Pace{config.image_rate_hz}),
      scene_pace_{config.scene_rate_hz},
      pose_pace_{config.scene_rate_hz} {}

bool Node::Pace::due(TimePoint time) {
  // A slightly early message passes, because stamps jitter around the rate.
  const auto least = durationFromSeconds(0.9 / rate_hz);
  if (last && time >= *last && time - *last < least) return false;
  last = time;
  return true;
}

void Node::send(std::uint32_t channel, std::string payload, std::optional<TimePoint> time) {
  outputs_.message(
      {channel, time.value_or(time_), std::make_shared<const std::string>(std::move(payload))});
}

void Node::sendScene() {
  SceneUpdate update = scene_.update(*objects_);
  outputs_.message({kScene, time_, std::make_shared<const std::string>(std::move(update.changes)),
                    std::make_shared<const std::string>(std::move(update.whole))});
}

void Node::sendWanted(std::initializer_list<std::uint32_t> channels) {
  for (const std::uint32_t channel : channels) {
    if (wants(channel)) sendNow(channel);
  }
}

void Node::newest(TimePoint time) {
  if (time <= time_ && time_ - time < kLongBack) return;
  time_ = time;  // slightly earlier messages are late; much earlier: another drive
  if (!wanted_.empty()) outputs_.time(time);
}

std::optional<Node::Body> Node::body() const {
  if (odometry_) return Body{odometry_->stamp.time, odometry_->world, odometry_->T_WB};
  if (objects_) return Body{objects_->stamp.time, objects_->world, objects_->T_WB};
  return std::nullopt;
}

void Node::setWanted(const Channels& wanted) {
  const bool looked_at_graph = wantsGraph();
  const Channels before = std::exchange(wanted_, wanted);
  lookAtGraph(looked_at_graph);
  away_ = away_ || wanted.empty();
  if (before.empty() && !wanted.empty() && time_ != TimePoint{}) outputs_.time(time_);
  if (!wantsTiles()) map_.clear();  // without a reader, stored tiles become outdated
  if (!before.contains(kScene)) scene_ = Scene();
  for (const std::uint32_t channel : wanted) {
    if (!before.contains(channel)) sendNow(channel);
  }
}

/// Sends the current state of a channel to its first viewer.
void Node::sendNow(std::uint32_t channel) {
  switch (channel) {
    case kTransforms:
      if (!body()) return;
      return send(kTransforms,
                  frameTransforms(time_, map_.T_MW(world()), pose(),
                                  calibration_ ? &*calibration_ : nullptr, earth_.yawOf(world())));
    case kMapToOdom:
      if (const MapFrame* frame = map_.frameOf(world())) send(kMapToOdom, mapFrameJson(*frame));
      return;
    case kMap:
    case kMapScene:
      next_map_ns_ = 0;
      map_due_ = map_due_ || !map_.empty();  // if empty, the map is sent once tiles arrive
      return;
    case kMapGraph:
    case kMapGraphScene:
      if (graph_) sendGraph(channel);
      return;
    case kMapSeen:
      if (!seen_ground_.empty()) send(kMapSeen, seen_ground_.json(pose().p, time_));
      return;
    case kPose:
      if (body()) send(kPose, poseInFrame(time_, pose()));
      return;
    case kTrajectory:
      if (trajectory_.size() > 0) send(kTrajectory, trajectory_.posesInFrame());
      return;
    case kScene:
      if (objects_) sendScene();
      return;
    case kObjects:
      if (objects_) send(kObjects, objectsAtAGlance(*objects_, latency_ms_, bodySigma()));
      return;
    case kEvents:
    case kLog:
      for (const Happened& one : events_) sendEvent(one, channel == kLog);
      return;
    case kHealth:
      next_health_ns_ = 0;
      return;
    case kModel:
      if (model_) send(kModel, modelJson(*model_));
      return;
    default:
      break;
  }
  for (std::size_t i = 0; i < config_.cameras.size(); ++i) sendNow(i, channel);
}

void Node::sendNow(std::size_t camera, std::uint32_t channel) {
  if (channel == cameraChannel(camera, kImage)) image_pace_[camera].last.reset();
  const bool drawn = channel == cameraChannel(camera, kAnnotations) ||
                     channel == cameraChannel(camera, kLikelihood);
  if (drawn && objects_) sendAnnotations(camera, true);
  if (channel != cameraChannel(camera, kCalibration) || !calibration_) return;
  const CameraCalibration* its = calibration_->camera(config_.cameras[camera]);
  if (its != nullptr) send(channel, cameraCalibration(*its, time_));
}

void Node::onCalibration(const Calibration& calibration) {
  calibration_ = calibration;
  earth_.onCalibration(calibration);
  for (std::size_t i = 0; i < config_.cameras.size(); ++i) {
    const CameraCalibration* camera = calibration.camera(config_.cameras[i]);
    cameras_[i].reset();
    if (camera == nullptr) continue;
    cameras_[i].emplace(*camera);
    sendWanted({cameraChannel(i, kCalibration)});
  }
}

void Node::onFrame(std::size_t camera, const Frame& frame) {
  const std::uint32_t channel = cameraChannel(camera, kImage);
  if (!wants(channel) || !image_pace_[camera].due(frame.stamp.time)) return;
  const auto jpeg = vision::compressed(frame, static_cast<int>(config_.image_quality));
  if (!jpeg) return reasons_.add("image_" + jpeg.error().code);
  send(channel, compressedImage(frame.stamp, config_.cameras[camera], *jpeg->data),
       frame.stamp.time);
}

/// Takes a frame stored by its writer. The frame is ignored if a newer frame was sent.
void Node::onFrameOfBefore(std::size_t camera, const Frame& frame) {
  const auto& last = image_pace_[camera].last;
  if (!last || frame.stamp.time > *last) onFrame(camera, frame);
}

void Node::onOdometry(const Odometry& odometry, std::int64_t now_ns) {
  last_.odometry_ns = now_ns;
  earth_.onOdometry(odometry);
  if (odometry.state == OdometryState::kInitialising) return;
  // If W changes, M may change too, and with it the displayed part of the map.
  map_due_ = map_due_ || (!map_.empty() && world() != odometry.world);
  beginAnew(odometry.stamp.time);
  odometry_ = odometry;
  placeEvents();
  newest(odometry.stamp.time);
  trajectory_.add(odometry.stamp.time, odometry.world, odometry.T_WB);
  if (wants(kMapSeen)) lookAtGround();
  if (pose_pace_.due(odometry.stamp.time)) sendPose(odometry.stamp.time);
}

/// Returns the standard deviation of the body's position in W, or -1 if unknown.
double Node::bodySigma() const {
  if (!odometry_ || odometry_->world != objects_->world) return -1;
  return std::sqrt(odometry_->covariance.diagonal().segment<3>(3).sum());
}

/// Returns the height of the ground in W: the median underside of the confirmed objects.
double Node::groundHeight() const {
  constexpr double kBody_m = 1.2;  // height of the body's origin, if there is no object
  std::vector<double> heights;
  for (const ObjectBelief& o : objects_ ? objects_->objects : std::vector<ObjectBelief>{}) {
    const Vector7d& x = o.best().mean;
    if (o.confirmed) heights.push_back(x[2] - 0.5 * std::exp(x[6]));
  }
  if (heights.empty()) return pose().p.z() - kBody_m;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return *middle;
}

void Node::lookAtGround() {
  for (const auto& camera : cameras_) {
    if (camera) seen_ground_.add(*camera, pose(), groundHeight(), time_, world());
  }
  if (seen_pace_.due(time_)) sendNow(kMapSeen);
}

void Node::sendPose(TimePoint time) {
  sendWanted({kTransforms, kPose});
  if (wants(kTrajectory) && trajectory_pace_.due(time)) sendNow(kTrajectory);
}

void Node::onLandmarks(const Landmarks& landmarks) {
  if (wants(kLandmarks)) send(kLandmarks, landmarksAsPoints(landmarks));
}

void Node::onDetections(const Detections& detections) {
  constexpr std::size_t kMostCameras = 16, kMostFrames = 16;
  if (!detections_.contains(detections.camera) && detections_.size() >= kMostCameras) return;
  auto& frames = detections_[detections.camera];
  frames.push_back(detections);
  if (frames.size() > kMostFrames) frames.pop_front();
  for (std::size_t i = 0; i < config_.cameras.size(); ++i) {
    if (awaited_.contains(i) && config_.cameras[i] == detections.camera) sendAnnotations(i, true);
  }
  if (wants(kDetections)) {
    send(kDetections, detectionsJson(detections, model_ ? &*model_ : nullptr));
  }
}

void Node::onModel(const ModelInfo& model) {
  model_ = model;
  sendWanted({kModel});
}

/// After a time without viewers, clears trajectory and histories, unless the message at `time`
/// continues them.
void Node::beginAnew(TimePoint time) {
  if (!std::exchange(away_, false) || (time >= time_ && time - time_ < kGap)) return;
  trajectory_.clear();
  seen_ground_.clear();
  history_.clear();
  detections_.clear();
  awaited_.clear();
  odometry_.reset();
}

void Node::onObjects(const Objects& objects, std::int64_t now_ns) {
  last_.objects_ns = now_ns;
  const double latency = 1e-6 * static_cast<double>(now_ns - objects.stamp.captured_ns);
  constexpr double kLongest = 1e4;  // ms; a longer latency comes from another host's clock, or a
                                    // recording
  latency_ms_ = objects.stamp.captured_ns > 0 && latency >= 0 && latency < kLongest ? latency : -1;
  take(objects);
}

void Node::onObjectsOfBefore(const Objects& objects) {
  const bool known =
      objects_ && objects_->world == objects.world && objects.stamp.time <= objects_->stamp.time;
  if (known) return;
  latency_ms_ = -1;
  take(objects);
}

void Node::take(const Objects& objects) {
  sendAwaited();
  beginAnew(objects.stamp.time);
  const bool again = objects_ && objects.stamp.time + kLongBack < objects_->stamp.time;
  if (again || (objects_ && objects_->world != objects.world)) {
    history_.clear();
    returns_.clear();
  }
  objects_ = objects;
  placeEvents();
  newest(objects.stamp.time);
  history_.add(objects);
  if (!odometry_) trajectory_.add(objects.stamp.time, objects.world, objects.T_WB);
  if (scene_pace_.due(objects.stamp.time)) sendObjects();
}

void Node::sendObjects() {
  sendWanted({kObjects, kScene});
  for (std::size_t i = 0; i < config_.cameras.size(); ++i) sendAnnotations(i, false);
  // If odometry is received, it determines the pose.
  if (!odometry_) sendPose(objects_->stamp.time);
}

/// Sends the annotations for the newest objects. Unless `now`, waits for detections of the same
/// frame if they are likely to follow.
void Node::sendAnnotations(std::size_t camera, bool now) {
  const bool wanted =
      wants(cameraChannel(camera, kAnnotations)) || wants(cameraChannel(camera, kLikelihood));
  awaited_.erase(camera);
  if (!cameras_[camera] || !wanted) return;
  const auto& frames = detections_[config_.cameras[camera]];
  const auto same = std::ranges::find_if(
      frames, [&](const Detections& one) { return one.stamp.sameFrame(objects_->stamp); });
  constexpr std::chrono::milliseconds kLately{500};
  const bool may_come = !frames.empty() && same == frames.end() &&
                        frames.back().stamp.time < objects_->stamp.time &&
                        objects_->stamp.time - frames.back().stamp.time < kLately;
  if (may_come && !now) {
    awaited_.insert(camera);
    return;
  }
  const Detections* detections = same != frames.end() ? &*same : nullptr;
  if (wants(cameraChannel(camera, kAnnotations)))
    send(cameraChannel(camera, kAnnotations),
         imageAnnotations(*objects_, *cameras_[camera], detections), objects_->stamp.time);
  // Before the first detections, no likelihood is known.
  if (wants(cameraChannel(camera, kLikelihood)) && !frames.empty())
    send(cameraChannel(camera, kLikelihood),
         likelihoodRegions(*objects_, *cameras_[camera], detections, model_ ? &*model_ : nullptr),
         objects_->stamp.time);
}

void Node::sendAwaited() {
  for (const std::size_t camera : std::set<std::size_t>(awaited_)) sendAnnotations(camera, true);
}

void Node::onMapFrame(const MapFrame& frame) {
  map_.follow(frame);
  graph_pace_.changed();
  sendWanted({kMapToOdom, kTransforms});
}

std::size_t Node::sendMap() {
  const MapLayer::View view = map_.viewFrom(world());
  const auto shown = nearestTo(map_.T_MW(world()) * pose().p, view.here);
  if (wants(kMap)) send(kMap, mapJson(view, shown, time_));
  if (wants(kMapScene)) {
    std::set<ObjectId> working;
    if (objects_) {
      for (const ObjectBelief& object : objects_->objects) {
        if (object.confirmed) working.insert(object.id);
      }
    }
    send(kMapScene, mapScene(shown, working, time_));
  }
  return shown.size();
}

void Node::tick(std::int64_t now_ns) {
  ticked_ns_ = now_ns;
  sendAwaited();
  followGraph(now_ns);
  if (wants(kHealth) && now_ns >= next_health_ns_) {
    next_health_ns_ = now_ns + kSecond;
    send(kHealth, vital_signs_.json(now_ns, last_));
  }
  map_due_ = map_.takeChanged() || map_due_;
  if (wantsTiles() && map_due_ && now_ns >= next_map_ns_) {
    map_due_ = false;
    // A large map is sent less often, so that the bytes per second are about constant.
    constexpr std::size_t kASecond = 200;
    next_map_ns_ = now_ns + kSecond * static_cast<std::int64_t>(1 + sendMap() / kASecond);
  }
  constexpr std::int64_t kResend = kSecond / 2;
  for (auto it = pending_.begin(); it != pending_.end();) {
    Pending& one = it->second;
    if (now_ns >= one.until_ns) {
      fail(one.call, "map_store does not answer; does it run, on this bus?");
      it = pending_.erase(it);
      continue;
    }
    if (now_ns >= one.next_ns) {
      one.next_ns = now_ns + kResend;
      one.send();
    }
    ++it;
  }
}

}  // namespace perdure::gateway
