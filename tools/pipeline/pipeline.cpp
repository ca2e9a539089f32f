#include "tools/pipeline/pipeline.h"

#include <chrono>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "common/base/errors.h"
#include "common/replay/files/class_aliases.h"
#include "common/replay/ros_topics.h"
#include "services/map_store/core/graph/graph_answer.h"
#include "services/semantic_filter/priors.h"
#include "tools/evaluate/simulated_truth.h"
#include "tools/outputs/pictures/overlay_video.h"
#include "tools/outputs/pictures/truth_sources.h"

namespace perdure::tools {
namespace {

// Fixed, so that nothing in the outputs depends on the run; another run on the same map has others.
constexpr InstanceId kCapture = 1, kVio = 2, kInference = 3, kFilter = 4, kMapStore = 5;
constexpr InstanceId kInstancesOfARun = 16;

double wallMs() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

std::string sequenceName(const PipelineOptions& options) {
  if (!options.sequence.empty()) return options.sequence;
  const auto path = std::filesystem::absolute(options.data).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

bool usesTruth(const PipelineOptions& options) {
  return options.odometry == "truth" || options.odometry == "drifting";
}

}  // namespace

Pipeline::Pipeline(const PipelineOptions& options)
    : options_(options), configs_(readServiceConfigs(options)) {
  cv::setNumThreads(1);
  checkRecorded();
  const bool of_data = options.odometry == "vio" || usesTruth(options);
  if (!of_data && !recorded_) {
    pose_file_ = replay::PoseFile::read(options.odometry);
  }
  if (!options.map.empty()) session_.world = MapMemory::newWorld(options.map);
  openData();
  openOdometry(options);
  openDetections(options);
  outputs_ = std::make_unique<OutputWriter>(options.out, sequenceName(options));
  if (options.record) openRun();
  openFilter();
  outputs_->onCalibration(dataset_->calibration());
  filter_->onCalibration(dataset_->calibration());
  map_->onCalibration(dataset_->calibration());
  if (inference_) learn(inference_->model());
  if (simulated_) learn(simulated_->info());
}

void Pipeline::openRun() {
  const auto file = outputs_->folder() / "run.mcap";
  std::filesystem::remove(file);  // of an earlier run
  run_ = std::make_unique<replay::RecordingWriter>(file);
  // What is known before the first frame is logged at its time.
  run_ns_ = toNanoseconds(dataset_->frameTime(first_index_).value_or(TimePoint()));
  if (!recorded_) keep("calibration", dataset_->calibration(), TimePoint());
}

void Pipeline::learn(const ModelInfo& model) {
  keep("model", model, TimePoint());
  hear(model);
}

void Pipeline::hear(const ModelInfo& model) {
  if (model.boxes == BoxExtent::kOutline) outputs_->setShapes(shapes_);
  filter_->onModel(model);
}

void Pipeline::openFilter() {
  const auto priors = semantic_filter::loadPriors(configs_.semantic_filter);
  shapes_ = semantic_filter::shapePoints(priors);
  semantic_filter::Outputs sinks;
  sinks.objects = [this](const Objects& objects) {
    ++counts_.objects;
    keep("objects", objects, objects.stamp.time);
    if (listener_) listener_(objects);
    timer_.timeTowardsNext("outputs", [&] { outputs_->onObjects(objects); });
    timer_.timeTowardsNext("map_store", [&] { map_->onObjects(objects); });
    if (vio_) timer_.timeTowardsNext("vio", [&] { vio_->onObjects(objects); });
    const auto started = started_ms_.find(objects.stamp.sequence);
    if (started == started_ms_.end()) return;
    counts_.latency_ms.push_back(wallMs() - started->second);
    started_ms_.erase(started);
  };
  sinks.events = [this](const Event& event) {
    keep("events", event, event.stamp.time);
    timer_.timeTowardsNext("outputs", [&] { outputs_->onEvent(event); });
    timer_.timeTowardsNext("map_store", [&] { map_->onEvent(event); });
  };
  sinks.queries = [this](const MapQuery& query) {
    timer_.timeTowardsNext("map_store", [&] { map_->onQuery(query); });
  };
  sinks.predictions = [this](const Predictions& predictions) { expected_ = predictions; };
  filter_ = std::make_unique<semantic_filter::Node>(configs_.semantic_filter, priors,
                                                    instanceOf(kFilter), std::move(sinks));
  const auto file = outputs_->folder() / "map.sqlite";
  options_.map.empty() ? MapMemory::clear(file) : MapMemory::copy(options_.map, file);
  map_ = std::make_unique<MapMemory>(
      configs_.map_store, file, instanceOf(kMapStore),
      MapMemory::Sinks{.recalled = [this](const Recalled& m) { filter_->onRecalled(m); },
                       .events =
                           [this](const Event& event) {
                             keep("events", event, event.stamp.time);
                             outputs_->onEvent(event);
                           },
                       .frames = [this](const MapFrame& frame) { keepMap(frame); },
                       .replies =
                           [this](const MapReply& reply) {
                             keep("map/reply", reply, fromNanoseconds(run_ns_));
                           }});
  if (configs_.map_store.graph) in_map_.emplace(session_);
  if (!options_.map.empty()) map_->giveIds(instanceOf(kFilter), session_);
}

/// What people may look at later: how W lies in M, and the graph, which is asked for as a gateway
/// asks that is looked at.
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

InstanceId Pipeline::instanceOf(InstanceId service) const {
  return service + kInstancesOfARun * (session_.world - 1);
}

/// What the filter has said reaches the map, and its questions are answered.
void Pipeline::remember() {
  timer_.timeTowardsNext("map_store", [&] { map_->work(); });
}

Pipeline::~Pipeline() = default;

replay::DatasetOptions Pipeline::dataOptions() const {
  const PipelineOptions& options = options_;
  replay::DatasetOptions data;
  data.path = options.data;
  data.sequence = options.sequence;
  data.rig = options.rig;
  data.topics = replay::topicsOf(options.topics);
  if (!options.image_size.empty()) data.image_size = {options.image_size[0], options.image_size[1]};
  if (pose_file_ && pose_file_->format() == replay::PoseFormat::kKitti) {
    data.frame_count = pose_file_->poses().size();
  }
  data.source = instanceOf(kCapture);
  data.second_encoding = ImageEncoding::kMono8;
  data.decode = options.odometry == "vio" || options.detections == "model" || options.landmarks;
  return data;
}

void Pipeline::openData() {
  dataset_ = replay::Dataset::open(dataOptions());
  checkData();
  if (options_.from <= 0.0) return;
  const auto first = dataset_->skip(durationFromSeconds(options_.from));
  if (!first) {
    throw StartupError(ExitCode::kUsage,
                       options_.data + " has no frame as late as --from says; give fewer seconds");
  }
  first_index_ = *first;
}

void Pipeline::openOdometry(const PipelineOptions& options) {
  if (options.landmarks && (recorded_ || options.odometry == "vio")) {
    throw StartupError(ExitCode::kUsage,
                       "--landmarks is for given poses (a file, truth, drifting); "
                       "--odometry " +
                           options.odometry + " has its own; leave it away");
  }
  if (recorded_) return;
  PoseAccuracy accuracy;
  if (usesTruth(options)) {
    if (!dataset_->truth()) {
      throw StartupError(
          ExitCode::kUnavailable,
          options.data + " holds no true poses; give --odometry a pose file, or vio");
    }
    pose_file_ = dataset_->truth();
    accuracy = isSimulated(options.data) ? ofExactTruth() : ofMeasuredTruth();
  }
  if (pose_file_) {
    const auto serve = [this](auto source) {
      pose_at_ = [source](const FrameStamp& stamp) mutable { return source.at(stamp); };
    };
    if (options.odometry == "drifting")
      serve(DriftingOdometry(*pose_file_, instanceOf(kVio), session_, accuracy, configs_.drifting));
    else
      serve(PoseOdometry(*pose_file_, instanceOf(kVio), session_, accuracy));
    return openKnownPoses();
  }
  uses_vio_ = true;
  if (!dataset_->calibration().imu) {
    throw StartupError(ExitCode::kUnavailable, options.data +
                                                   " has no inertial samples, which vio "
                                                   "needs; give --odometry a pose file");
  }
  vio::Outputs sinks;
  sinks.odometry = [this](const Odometry& odometry) { new_odometry_.push_back(odometry); };
  sinks.landmarks = [this](const Landmarks& landmarks) {
    landmarks_[landmarks.stamp.sequence] = landmarks;
    outputs_->onLandmarks(landmarks);
  };
  vio_ = std::make_unique<vio::Node>(configs_.vio, instanceOf(kVio), std::move(sinks));
  vio_->setWorld(session_);
  vio_->onCalibration(dataset_->calibration());
}

void Pipeline::openKnownPoses() {
  if (!options_.landmarks) return;
  const auto& frames = dataset_->recording().frames;
  if (frames.empty() || (frames.front().path.empty() && !frames.front().load)) {
    throw StartupError(ExitCode::kUnavailable, options_.data +
                                                   " has no images, which --landmarks "
                                                   "needs; leave it away");
  }
  known_poses_ = std::make_unique<vio::KnownPoseNode>(
      configs_.vio, instanceOf(kVio), [this](const Landmarks& landmarks) {
        landmarks_[landmarks.stamp.sequence] = landmarks;
        outputs_->onLandmarks(landmarks);
      });
  known_poses_->onCalibration(dataset_->calibration());
}

void Pipeline::openDetections(const PipelineOptions& options) {
  if (options.detections == "none" || recorded_) return;
  if (options.detections == "simulated") {
    simulated_ = std::make_unique<SimulatedDetections>(configs_.detector, options.data, *dataset_,
                                                       instanceOf(kInference));
    return;
  }
  if (options.detections != "model") {
    const auto aliases = replay::ClassAliases::load(configFolder() / "class_aliases.yaml");
    replay::DetectionFileOptions file;
    file.file = options.detections;
    file.class_name = options.class_name;
    file.box_origin = options.box_origin;
    if (options.outline_boxes) file.boxes = BoxExtent::kOutline;
    detection_file_ = replay::DetectionFile::read(file, aliases);
    return checkDetectionFile();
  }
  if (options.model.empty() && configs_.inference.model.path.empty()) {
    throw StartupError(ExitCode::kUsage,
                       "--detections model needs a network: give --model FILE.onnx");
  }
  if (!options.model.empty()) configs_.inference.model.path = options.model;
  if (dataset_->kind() == replay::DatasetKind::kKittiTracking &&
      !std::filesystem::is_directory(std::filesystem::path(options.data) / "image_02")) {
    throw StartupError(ExitCode::kUnavailable,
                       options.data +
                           " has no images (image_02), which --detections model needs; "
                           "give --detections a CSV");
  }
  inference_ = std::make_unique<inference::Node>(configs_.inference, instanceOf(kInference));
}

void Pipeline::run(const std::function<void(const PipelineCounts&)>& progress) {
  if (recorded_) return runRecorded(progress);
  while (auto message = timer_.timeTowardsNext("decode", [&] { return dataset_->next(); })) {
    const Frame* frame = std::get_if<Frame>(&*message);
    const bool first_camera =
        frame != nullptr && frame->camera == dataset_->calibration().cameras.front().name;
    if (first_camera) {
      timer_.time("decode", [] {});
      if (!first_frame_) first_frame_ = frame->stamp.time;
      if (options_.seconds && toSeconds(frame->stamp.time - *first_frame_) > *options_.seconds)
        break;
    }
    handle(*message);
    if (first_camera) progress(counts_);
  }
  if (vio_) timer_.timeTowardsNext("vio", [&] { vio_->flush(); });
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

/// A pose waits for its landmarks, which wait for the second camera.
void Pipeline::givePose(const Frame& frame) {
  const auto odometry = pose_at_(frame.stamp);
  if (!odometry) return reasons_.add("frame_without_pose");
  if (!known_poses_) return new_odometry_.push_back(*odometry);
  held_.push_back(*odometry);
  timer_.timeTowardsNext("vio", [&] { known_poses_->onOdometry(*odometry); });
}

/// Those for whose frames nothing more comes.
void Pipeline::releasePoses() {
  if (!known_poses_) return;
  const auto waits_for = known_poses_->waitsFor();
  const auto released = std::find_if(held_.begin(), held_.end(), [&](const Odometry& o) {
    return waits_for && o.stamp.sequence >= *waits_for;
  });
  new_odometry_.insert(new_odometry_.end(), held_.begin(), released);
  held_.erase(held_.begin(), released);
}

void Pipeline::detect(const Frame& frame) {
  if (inference_) {
    auto detections = timer_.time("inference", [&] { return inference_->infer(frame, expected_); });
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
  if (model.hash != model_hash_) {
    learn(model);
    model_hash_ = model.hash;
  }
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

/// Hands on what has come, each frame's odometry first, then its landmarks, then its detections.
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
