#include "services/semantic_filter/node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/camera/camera_model.h"
#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/motion_model.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/visibility/predicted_box.h"

namespace perdure::semantic_filter {

constexpr std::size_t kMaxEarly = 16;
constexpr std::chrono::seconds kFuture{10};  // detections further ahead of odometry are not stored

Node::Node(const Config& config, const ClassPriors& priors, InstanceId instance, Outputs outputs)
    : config_(config),
      instance_(instance),
      outputs_(std::move(outputs)),
      history_(config.filter, priors, static_cast<std::size_t>(config.history.frames), reasons_),
      models_(priors),
      archive_(config.filter.memory, config.filter.motion.min_speed) {}

void Node::onCalibration(const Calibration& calibration) {
  if (calibration.cameras.empty()) {
    reasons_.add("calibration_without_camera");
    return;
  }
  if (camera_ && sameCamera(camera_->calibration(), calibration.cameras.front())) return;
  flush();
  camera_ = std::make_shared<const CameraModel>(calibration.cameras.front());
  camera_name_ = calibration.cameras.front().name;
}

void Node::onModel(const ModelInfo& model) {
  if (const auto added = models_.add(model); !added) reasons_.add(added.error());
}

void Node::beginWorld(const WorldId& world) {
  if (world_) reasons_.add("world_changed");
  world_ = world;
  history_.beginWorld();
  events_.clear();
  returns_.clear();
  archive_.clear();
  members_.clear();
  if (const auto near = std::exchange(waiting_near_, std::nullopt)) {
    if (near->world == world) take(*near, ExistenceEvidence::kRestore);
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
  if (!history_.empty() && odometry.stamp.time <= history_.newest().input.stamp.time) {
    return reasons_.add("odometry_not_newer");
  }
  Frame& frame = history_.add(odometry, camera_);
  const auto early = std::find_if(early_.begin(), early_.end(), [&](const Detections& d) {
    return d.stamp.sameFrame(frame.input.stamp);
  });
  if (early != early_.end()) {
    attach(frame, *early);
    early_.erase(early);
  }
  forgetEarlyBefore(odometry.stamp.time);
  if (frame.input.boxes || !config_.history.wait_for_detections) flush();
}

/// Returns the pixel of a landmark in the filter's camera; nothing if it is outside the image.
/// `camera`: that of the landmarks, which may be another one.
std::optional<Eigen::Vector2d> Node::pixelOf(const Landmark& landmark, const std::string& camera,
                                             const View& view) const {
  if (camera.empty() || camera == camera_name_) return landmark.pixel;
  const RigidTransform T_WC = view.T_WB * view.camera->T_BC();
  const auto pixel = view.camera->project(T_WC.inverse() * landmark.p_W);
  if (!pixel || !view.camera->inImage(*pixel)) return std::nullopt;
  return *pixel;
}

void Node::onLandmarks(const Landmarks& landmarks) {
  for (Frame& frame : history_.frames()) {
    if (!frame.input.stamp.sameFrame(landmarks.stamp)) continue;
    if (frame.stepped) reasons_.add("landmarks_after_step");
    const Eigen::Vector3d centre = frame.input.view.T_WB * frame.input.view.camera->T_BC().p;
    frame.input.points.clear();
    for (const auto& landmark : landmarks.landmarks) {
      if (!landmark.p_W.allFinite() || !landmark.covariance.allFinite()) continue;
      const Eigen::Vector3d ray = landmark.p_W - centre;
      const Eigen::Vector3d along = ray.normalized();
      const double variance = along.dot(landmark.covariance * along);
      const auto pixel = pixelOf(landmark, landmarks.camera, frame.input.view);
      if (!pixel) continue;
      frame.input.points.push_back({*pixel, ray.norm(), std::sqrt(std::max(variance, 0.0))});
    }
    return;
  }
  reasons_.add("landmarks_of_unknown_frame");
}

/// Returns the reason why a message is refused, as Health counts it; nullptr if it is accepted.
const char* Node::refusalOf(const Detections& detections) const {
  if (camera_ && !detections.camera.empty() && detections.camera != camera_name_) {
    return "detections_of_other_camera";
  }
  const auto model = models_.find(detections.model_hash);
  if (!model) return "detections_of_unknown_model";
  for (const auto& detection : detections.detections) {
    if (const char* flaw = flawOf(detection, *model)) return flaw;
  }
  return nullptr;
}

bool Node::attach(Frame& frame, const Detections& detections) {
  if (const char* refusal = refusalOf(detections)) {
    reasons_.add(refusal);
    return false;
  }
  if (isInDoubt(frame, detections)) return true;  // the frame remains without detections
  return use(frame, detections);
}

bool Node::use(Frame& frame, const Detections& detections) {
  if (frame.input.boxes) {
    reasons_.add("detections_repeated");
    return false;
  }
  frame.input.model = models_.find(detections.model_hash);
  if (const auto change = models_.use(detections.model_hash, frame.input.stamp.time)) {
    reportModelChange(frame.input.stamp, *change);
  }
  if (detections.input_scale > 0.0 && detections.input_scale != 1.0) {
    Model scaled = *frame.input.model;
    scaled.input_width *= detections.input_scale;
    frame.input.model = std::make_shared<const Model>(std::move(scaled));
  }
  frame.input.boxes.emplace().reserve(detections.detections.size());
  for (const auto& detection : detections.detections) {
    if (detection.primed) {
      auto ratios = topDownRatios(detection, *frame.input.model, config_.filter.clutter);
      if (ratios) frame.input.top_down[trackOf(detection.primed_for)] = *std::move(ratios);
      if (!ratios) reasons_.add("primed_malformed");
      continue;
    }
    auto evidence =
        makeBoxDetection(detection, *frame.input.model, frame.camera->width(),
                         frame.camera->height(), config_.filter.box, config_.filter.clutter);
    if (evidence) {
      frame.input.boxes->push_back(std::move(*evidence));
    } else {
      reasons_.add("detection_outside_image");
    }
  }
  return true;
}

void Node::onDetections(const Detections& detections) {
  for (std::size_t i = history_.frames().size(); i-- > 0;) {
    Frame& frame = history_.frames()[i];
    if (!frame.input.stamp.sameFrame(detections.stamp)) continue;
    if (!attach(frame, detections)) return;
    if (!frame.stepped) return flush();
    reasons_.add("detections_late");
    return history_.stepAgainFrom(i);
  }
  if (const char* refusal = refusalOf(detections)) return reasons_.add(refusal);
  if (!history_.empty()) {
    const TimePoint newest = history_.newest().input.stamp.time;
    if (detections.stamp.time <= newest) return reasons_.add("detections_too_late");
    if (detections.stamp.time > newest + kFuture) return reasons_.add("detections_of_the_future");
  }
  keepEarly(detections);
}

/// Stores detections that arrive before their odometry. If there are too many, drops the ones
/// furthest ahead, because messages with false stamps must not displace the next ones.
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

void Node::flush() {
  if (history_.empty() || history_.newest().stepped) return;
  history_.step();
  letGo(history_.newest());
  publish(history_.newest());
}

void Node::publish(const Frame& frame) {
  const ScratchScope scope;
  auto merges = history_.takeLateMerges();
  merges.insert(merges.end(), frame.merges.begin(), frame.merges.end());
  for (const MergeRecord& m : merges) {
    if (m.by_map || !events_.wasConfirmed(m.absorbed)) continue;
    ended_confirmed_.insert(m.absorbed);
    noteMerge(m.survivor, m.absorbed);
  }
  nameObjects();
  Objects& objects = published_;
  objects.stamp = frame.input.stamp;
  objects.instance = instance_;
  objects.world = frame.world;
  objects.T_WB = frame.input.view.T_WB;
  objects.up_W = frame.input.view.up_W;
  objects.next_id = history_.ids().next();
  objects.pose_error = frame.input.pose_error.covariance;
  objects.near_source = near_source_;
  objects.near_revision = near_revision_;
  objects.near_m = archive_.nearRadius();
  const MotionParameters& motion = config_.filter.motion;
  const std::vector<Track>& tracks = history_.belief().tracks;
  objects.objects.resize(tracks.size());
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& object = tracks[i];
    ObjectBelief& belief = objects.objects[i];
    toBelief(object, models_.priors(), motion.min_speed, belief);
    if (belief.moving > 0.5) {
      const Track now = extrapolated(object, frame.input.stamp.time, motion);
      belief.classes = toBelief(now, models_.priors(), motion.min_speed).classes;
    }
    belief.blocked_by = objectOf(belief.blocked_by);
    if (const ObjectId id = objectOf(object.id); id != object.id) {
      belief.track = object.id;
      belief.id = id;
    }
  }
  if (!object_of_.empty()) {
    std::sort(objects.objects.begin(), objects.objects.end(),
              [](const ObjectBelief& a, const ObjectBelief& b) { return a.id < b.id; });
  }
  Event blank;
  blank.stamp = objects.stamp, blank.instance = objects.instance, blank.world = objects.world;
  auto [events, ended] = events_.update(objects, merges, blank);
  keepEnded(ended);
  objects.ended.assign(ended_.begin(), ended_.end());
  const auto coming = history_.comingAfter(frame);
  auto returns =
      returns_.update(history_.belief().tracks, frame.input, coming, config_.filter, blank);
  for (Event& event : returns) {
    event.object_id = objectOf(event.object_id);
    event.other_id = objectOf(event.other_id);
  }
  events.insert(events.end(), returns.begin(), returns.end());
  corrections_.apply(objects);
  corrections_.apply(events, objects);
  if (outputs_.objects) outputs_.objects(objects);
  for (const auto& event : events) {
    if (outputs_.events) outputs_.events(event);
  }
  publishPredictions(frame, coming);
}

std::string Node::note() const {
  constexpr double kWorthSaying = 1.1;
  std::string note;
  const BoxParameters& assumed = config_.filter.box;
  const auto model = models_.find(models_.used());
  const std::uint64_t network = model ? model->network : 0;
  const auto say = [&](const char* what, double ratio) {
    const double times = std::sqrt(ratio);
    if (std::max(times, 1.0 / times) < kWorthSaying) return;
    if (!note.empty()) note += "; ";
    note += fmt::format("{} err {:.2f} times as far as was assumed", what, times);
  };
  if (model && model->outline_styles && history_.belief().learned.extents.outlines(network)) {
    note = "boxes enclose the outlines of objects";
  }
  const SideScales sides = history_.belief().learned.sides.scales(network);
  const double lasts = assumed.bias_share;
  say("boxes", (1.0 - lasts) * sides.noise + lasts * sides.lasting);
  say("azimuths", history_.belief().learned.azimuths.ratio(network, assumed.prior_azimuths));
  return note;
}

void Node::publishPredictions(const Frame& frame, const std::optional<ComingFrame>& coming) {
  if (!outputs_.predictions) return;
  Predictions predictions;
  predictions.stamp = frame.input.stamp;
  predictions.instance = instance_;
  predictions.camera = camera_name_;
  for (const auto& object : history_.belief().tracks) {
    auto prediction = predictionOf(object, frame.input, coming);
    if (!prediction) continue;
    prediction->object_id = objectOf(prediction->object_id);
    predictions.predictions.push_back(*std::move(prediction));
  }
  outputs_.predictions(predictions);
}

}  // namespace perdure::semantic_filter
