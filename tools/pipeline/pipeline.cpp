#include "tools/pipeline/pipeline.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "common/base/errors.h"
#include "services/map_store/core/graph/graph_answer.h"
#include "tools/evaluate/simulated_truth.h"
#include "tools/outputs/box_motion.h"
#include "tools/outputs/pictures/overlay_video.h"
#include "tools/outputs/pictures/truth_sources.h"
#include "tools/pipeline/instances.h"
namespace perdure::tools {
namespace {

double wallMs() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

}  // namespace

void Pipeline::learn(const ModelInfo& model) {
  if (model.hash == model_hash_) return;
  model_hash_ = model.hash;
  keep("model", model, TimePoint());
  hear(model);
}

void Pipeline::hear(const ModelInfo& model) {
  if (model.boxes == BoxExtent::kOutline) outputs_->setShapes(shapes_);
  filter_->onModel(model);
}

/// Records `map/frame`, and requests the graph from the map as a gateway does, so that viewers of
/// the recording can show it.
void Pipeline::keepMap(const MapFrame& frame) {
  if (!run_) return;
  keep("map/frame", frame, frame.stamp.time);
  constexpr double kEach_s = 3.0, kAnchorsASecond = 100.0;
  const double wait_s = std::max(kEach_s, frame.anchors / kAnchorsASecond);
  const bool due = !graph_kept_ || frame.stamp.time - *graph_kept_ >= durationFromSeconds(wait_s);
  graph_waits_ = !due;
  if (!due) return;
  graph_kept_ = frame.stamp.time;
  askForGraph();
}

void Pipeline::askForGraph() {
  MapQuery query;
  query.client = instanceOf(kMapStore);
  query.request = ++graphs_asked_;
  query.kind = MapQueryKind::kGraph;
  query.limit = map_store::kMostAnchors;
  map_->onQuery(query);
}

/// Lets the map process the filter's messages, and the filter the map's answers.
void Pipeline::remember() {
  timer_.timeTowardsNext("map_store", [&] { map_->work(); });
}

Pipeline::~Pipeline() = default;

void Pipeline::run(const std::function<void(const PipelineCounts&)>& progress) {
  if (recorded_) return runRecorded(progress);
  while (auto message = timer_.timeTowardsNext("decode", [&] { return dataset_->next(); })) {
    const Frame* frame = std::get_if<Frame>(&*message);
    const bool first_camera =
        frame != nullptr && frame->camera == dataset_->calibration().cameras.front().name;
    if (first_camera) {
      timer_.time("decode", [] {});
      if (!first_frame_) first_frame_ = frame->stamp.time;
      if (options_.seconds && toSeconds(frame->stamp.time - *first_frame_) > *options_.seconds) {
        end_index_ = frame->stamp.sequence;
        break;
      }
    }
    handle(*message);
    if (first_camera) progress(counts_);
  }
  if (vio_) {
    timer_.timeTowardsNext("vio", [&] { vio_->flush(); });
    rig_watch_->remember(*vio_);
    judgeMotion();
  }
  if (known_poses_) {
    timer_.timeTowardsNext("vio", [&] { known_poses_->flush(); });
    releasePoses();
  }
  if (simulated_) offerDue(TimePoint::max());
  deliver();
  timer_.timeTowardsNext("semantic_filter", [&] { filter_->flush(); });
  timer_.time("map_store", [&] { map_->finish(); });
}

void Pipeline::handle(const replay::Message& message) {
  if (const auto* frame = std::get_if<Frame>(&message)) return handleFrame(*frame);
  if (!vio_) return;
  timer_.timeTowardsNext("vio", [&] {
    if (const auto* imu = std::get_if<ImuSample>(&message)) vio_->onImu(*imu);
    if (const auto* speed = std::get_if<SpeedSample>(&message)) vio_->onSpeed(*speed);
  });
  deliver();
}

void Pipeline::handleFrame(const Frame& frame) {
  const bool first_camera = frame.camera == dataset_->calibration().cameras.front().name;
  if (first_camera) {
    ++counts_.frames;
    started_ms_[frame.stamp.sequence] = wallMs();
  }
  if (first_camera && pose_at_) givePose(frame);
  constexpr std::uint64_t kEach = 20;  // frames between stored states, because a state is costly to
                                       // write
  if (first_camera && vio_ && counts_.frames % kEach == 0) rig_watch_->remember(*vio_);
  if (vio_ || known_poses_) {
    const auto work = [&] { vio_ ? vio_->onFrame(frame) : known_poses_->onFrame(frame); };
    if (first_camera)
      timer_.time("vio", work);
    else
      timer_.timeTowardsNext("vio", work);
  }
  releasePoses();
  if (!first_camera) return deliver();
  detect(frame);
  deliver();
  timer_.time("semantic_filter", [] {});
  timer_.time("map_store", [] {});
  timer_.time("outputs", [] {});
}

/// Takes the given pose of a frame. If landmarks are computed, the pose waits for those of its
/// frame.
void Pipeline::givePose(const Frame& frame) {
  const auto odometry = pose_at_(frame.stamp);
  if (!odometry) return reasons_.add("frame_without_pose");
  if (!known_poses_) return new_odometry_.push_back(*odometry);
  held_.push_back(*odometry);
  timer_.timeTowardsNext("vio", [&] { known_poses_->onOdometry(*odometry); });
}

/// Releases the poses of frames whose landmarks are complete.
void Pipeline::releasePoses() {
  if (!known_poses_) return;
  const auto waits_for = known_poses_->waitsFor();
  const auto released = std::find_if(held_.begin(), held_.end(), [&](const Odometry& o) {
    return waits_for && o.stamp.sequence >= *waits_for;
  });
  new_odometry_.insert(new_odometry_.end(), held_.begin(), released);
  held_.erase(held_.begin(), released);
}

/// Records the latency: the wall time from the decoded frame to its `objects`.
void Pipeline::noteLatency(const FrameStamp& stamp) {
  const auto started = started_ms_.find(stamp.sequence);
  if (started == started_ms_.end()) return;
  counts_.latency_ms.push_back(wallMs() - started->second);
  started_ms_.erase(started);
}

void Pipeline::detect(const Frame& frame) {
  if (inference_) {
    auto detections = timer_.time("inference", [&] { return inference_->infer(frame, expected_); });
    learn(inference_->model());
    if (detections)
      offer(*std::move(detections));
    else
      reasons_.add(detections.error());
    return;
  }
  if (simulated_) {
    simulated_->look(frame);
    return offerDue(frame.stamp.time);
  }
  if (!detection_file_) return;
  const auto found = detection_file_->at(frame.stamp.sequence);
  const ModelInfo model = detection_file_->modelAt(frame.stamp.sequence);
  if (!found || model.classes.empty()) return;
  learn(model);
  Detections detections;
  detections.stamp = frame.stamp;
  detections.camera = frame.camera;
  detections.instance = instanceOf(kInference);
  detections.model_hash = model.hash;
  detections.detections = *found;
  offer(std::move(detections));
}

void Pipeline::offerDue(TimePoint now) {
  for (Detections& detections : simulated_->due(now)) offer(std::move(detections));
}

void Pipeline::offer(Detections detections) {
  outputs_->onDetections(detections);
  ++counts_.inferred;
  counts_.detections += detections.detections.size();
  waiting_[detections.stamp.sequence] = std::move(detections);
}

/// Delivers the received data to the filter by frame: odometry, then landmarks, then detections.
void Pipeline::deliver() {
  for (const Odometry& odometry : std::exchange(new_odometry_, {})) {
    const std::uint64_t frame = odometry.stamp.sequence;
    outputs_->onOdometry(odometry);
    keep("odometry", odometry, odometry.stamp.time);
    if (odometry.state != OdometryState::kInitialising) ++counts_.odometry;
    timer_.timeTowardsNext("map_store", [&] { map_->onOdometry(odometry); });
    timer_.timeTowardsNext("semantic_filter", [&] { filter_->onOdometry(odometry); });
    const auto landmarks = landmarks_.find(frame);
    if (landmarks != landmarks_.end()) {
      keep("landmarks", landmarks->second, odometry.stamp.time);
      timer_.timeTowardsNext("map_store", [&] { map_->onLandmarks(landmarks->second); });
      timer_.timeTowardsNext("semantic_filter", [&] { filter_->onLandmarks(landmarks->second); });
    }
    waits_for_detections_.insert(frame);
    if (waits_for_detections_.size() > 64)
      waits_for_detections_.erase(waits_for_detections_.begin());
    timer_.timeTowardsNext("semantic_filter", [&] { deliverDetections(frame); });
    remember();
    if (in_map_) in_map_->follow(odometry, map_->mapper());
    landmarks_.erase(landmarks_.begin(), landmarks_.upper_bound(frame));
  }
  while (!waiting_.empty() && waits_for_detections_.contains(waiting_.begin()->first)) {
    timer_.timeTowardsNext("semantic_filter", [&] { deliverDetections(waiting_.begin()->first); });
    remember();
  }
  while (waiting_.size() > 256) waiting_.erase(waiting_.begin());
}

void Pipeline::deliverDetections(std::uint64_t frame) {
  const auto found = waiting_.find(frame);
  if (found == waiting_.end()) return;
  keep("detections", found->second, found->second.stamp.time);
  filter_->onDetections(found->second);
  waiting_.erase(found);
  waits_for_detections_.erase(frame);
}

void Pipeline::finish() {
  if (auto truth = pictureTruth(*dataset_, dataOptions(), outputs_->poses()))
    outputs_->setTruth(*std::move(truth));
  if (in_map_) {
    outputs_->setInMap(in_map_->finish(map_->mapper(), outputs_->history().lastBeliefs()));
  }
  outputs_->finish();
  if (const auto& cameras = dataset_->calibration().cameras; detection_file_ && !cameras.empty())
    box_doubt_ = doubtOfBoxes(outputs_->log().frames(), cameras.front());
  if (detection_file_ && !box_doubt_) box_doubt_ = doubtOfHeights(estimatedHeights());
  if (graph_waits_) {
    askForGraph();
    map_->work();
  }
  if (run_) {
    if (const auto kept = run_->finish(); !kept) reasons_.add("run_" + kept.error().code);
  }
  outputs_->writeJson("timing.json", timer_.toJson());
  refuseUnwritten();
}

std::string Pipeline::drawOverlay(
    const std::function<void(std::size_t, std::size_t)>& progress) const {
  auto data = dataOptions();
  data.decode = true;
  return writeOverlay(outputs_->log(), data, outputs_->folder() / "overlay.mp4", progress);
}

std::string Pipeline::doubtOfPoses() const {
  return known_poses_ ? known_poses_->statusOfPoses() : std::string();
}

std::map<std::string, ReasonCounts> Pipeline::reasons() const {
  std::map<std::string, ReasonCounts> all{{"capture", dataset_->reasons()},
                                          {"semantic_filter", filter_->reasons()},
                                          {"map_store", map_->reasons()},
                                          {"pipeline", reasons_}};
  if (vio_) all["vio"] = vio_->reasons();
  if (known_poses_) all["vio"] = known_poses_->reasons();
  return all;
}

}  // namespace perdure::tools
