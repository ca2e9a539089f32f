// Starts the pipeline: opens data, odometry, detections, filter, map and recording.
#include <opencv2/core/utility.hpp>

#include "common/base/errors.h"
#include "common/bus/topics.h"
#include "common/replay/files/class_aliases.h"
#include "common/replay/files/output_place.h"
#include "common/replay/recordings/ros_topics.h"
#include "services/semantic_filter/priors.h"
#include "tools/base/config_folder.h"
#include "tools/evaluate/simulated_truth.h"
#include "tools/pipeline/instances.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

std::string sequenceName(const PipelineOptions& options) {
  if (!options.sequence.empty()) return options.sequence;
  const auto path = std::filesystem::absolute(options.data).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

bool usesTruth(const PipelineOptions& options) {
  return options.odometry == "truth" || options.odometry == "drifting";
}

}  // namespace

void refuseOut(const PipelineOptions& options) {
  replay::refuseInside(options.out, options.data, "--out");
  std::error_code none;
  if (!options.map.empty() &&
      std::filesystem::equivalent(options.map, std::filesystem::path(options.out) / "map.sqlite",
                                  none)) {
    throw StartupError(
        ExitCode::kUsage,
        options.map + " is this run's own map; give another --out, or copy it first");
  }
  if (!options.record) return;
  replay::refuseOverwriting(std::filesystem::path(options.out) / "run.mcap", options.data,
                            "--record");
}

Pipeline::Pipeline(const PipelineOptions& options)
    : options_(options), configs_(readServiceConfigs(options)) {
  cv::setNumThreads(1);
  refuseOut(options);
  checkLandmarks();
  checkRecorded();
  const bool of_data = options.odometry == "vio" || usesTruth(options);
  if (!of_data && !recorded_) {
    pose_file_ = replay::PoseFile::read(options.odometry);
  }
  checkWalk();
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
  std::filesystem::remove(file);  // remove the file of an earlier run
  run_ = std::make_unique<replay::RecordingWriter>(file);
  // Messages before the first frame get the log time of this frame.
  run_ns_ = toNanoseconds(dataset_->frameTime(first_index_).value_or(TimePoint()));
  if (!recorded_) keep("calibration", dataset_->calibration(), TimePoint());
}

InstanceId Pipeline::instanceOf(InstanceId service) const {
  return service + kInstancesOfARun * (session_.world - 1);
}

void Pipeline::openFilter() {
  priors_ = semantic_filter::loadPriors(configs_.semantic_filter);
  shapes_ = semantic_filter::shapePoints(priors_);
  if (detection_file_) checkClasses();
  semantic_filter::Outputs sinks;
  sinks.objects = [this](const Objects& objects) {
    ++counts_.objects;
    keep("objects", objects, objects.stamp.time);
    if (listener_) listener_(objects);
    timer_.timeTowardsNext("outputs", [&] { outputs_->onObjects(objects); });
    timer_.timeTowardsNext("map_store", [&] { map_->onObjects(objects); });
    if (vio_) timer_.timeTowardsNext("vio", [&] { vio_->onObjects(objects); });
    noteLatency(objects.stamp);
  };
  sinks.events = [this](const Event& event) {
    keep("events", event, event.stamp.time);
    timer_.timeTowardsNext("outputs", [&] { outputs_->onEvent(event); });
  };
  sinks.predictions = [this](const Predictions& predictions) { expected_ = predictions; };
  filter_ = std::make_unique<semantic_filter::Node>(configs_.semantic_filter, priors_,
                                                    instanceOf(kFilter), std::move(sinks));
  const auto file = outputs_->folder() / "map.sqlite";
  options_.map.empty() ? MapMemory::clear(file) : MapMemory::copy(options_.map, file);
  map_store::Outputs map;
  map.tile = map.emptied = [](const MapTile&) {};
  map.header = [](const MapHeader&) {};
  map.reply = [this](const MapReply& m) { keep("map/reply", m, fromNanoseconds(run_ns_)); };
  map.near = [this](const MapNear& m) { filter_->onNear(m); };
  map.frame = [this](const MapFrame& frame) { keepMap(frame); };
  map.event = [this](const Event& event) {
    keep("events", event, event.stamp.time);
    outputs_->onEvent(event);
  };
  map_ =
      std::make_unique<MapMemory>(configs_.map_store, file, instanceOf(kMapStore), std::move(map));
  if (configs_.map_store.graph) in_map_.emplace(session_);
  if (!options_.map.empty()) map_->giveIds(instanceOf(kFilter), session_);
}

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
  data.every = options.every;
  data.source = instanceOf(kCapture);
  data.second_encoding = ImageEncoding::kMono8;
  data.decode = options.odometry == "vio" || options.detections == "model" || options.landmarks;
  return data;
}

void Pipeline::openData() {
  dataset_ = replay::Dataset::open(dataOptions());
  turnPosesToBody();
  checkData();
  if (options_.from <= 0.0) return;
  const auto first = dataset_->skip(durationFromSeconds(options_.from));
  if (!first) {
    throw StartupError(ExitCode::kUsage,
                       options_.data + " has no frame as late as --from says; give fewer seconds");
  }
  first_index_ = *first;
}

/// Converts given poses of the first camera to poses of the body, if the user declared them so.
void Pipeline::turnPosesToBody() {
  if (options_.odometry_of.empty()) return;
  if (!pose_file_) {
    throw StartupError(ExitCode::kUsage, "--odometry-of is of a pose file; leave it out");
  }
  if (options_.odometry_of != "camera" || dataset_->calibration().cameras.empty()) return;
  if (pose_file_->hasSteps()) {
    throw StartupError(ExitCode::kUsage,
                       "the covariances of steps are of the body: give poses of the body with "
                       "them, or leave those columns out");
  }
  const RigidTransform T_CB = dataset_->calibration().cameras.front().T_BC.inverse();
  std::vector<replay::StampedPose> poses = pose_file_->poses();
  for (auto& pose : poses) pose.T_WB = pose.T_WB * T_CB;
  pose_file_.emplace(pose_file_->format(), std::move(poses));
}

void Pipeline::openOdometry(const PipelineOptions& options) {
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
    const bool knows_up = accuracy.z_up;  // the vertical of other poses is assumed
    const auto serve = [this, knows_up](auto source) {
      pose_at_ = [this, knows_up, source](const FrameStamp& stamp) mutable {
        auto odometry = source.at(stamp);
        if (inference_ && knows_up && odometry) inference_->onOdometry(*odometry);
        return odometry;
      };
    };
    if (options.odometry == "drifting")
      serve(DriftingOdometry(*pose_file_, instanceOf(kVio), session_, accuracy, configs_.drifting));
    else
      serve(PoseOdometry(*pose_file_, instanceOf(kVio), session_, accuracy));
    return openKnownPoses();
  }
  if (!dataset_->calibration().imu) {
    std::string notes;
    for (const std::string& note : dataset_->recording().notes) notes += note + "; ";
    throw StartupError(ExitCode::kUnavailable,
                       "{} has no inertial samples, which vio needs; {}give --odometry a pose file",
                       options.data, notes);
  }
  vio::Outputs sinks;
  sinks.odometry = [this](const Odometry& odometry) {
    new_odometry_.push_back(odometry);
    if (inference_) inference_->onOdometry(odometry);
    rig_watch_->onOdometry(odometry);
  };
  sinks.innovations = [this](const std::vector<vio::Innovation>& all) {
    rig_watch_->onInnovations(all);
  };
  sinks.calibration = [this](const Calibration& estimated) {
    keep(bus::kEstimatedCalibration.name, estimated, TimePoint());
    filter_->onCalibration(estimated);
    outputs_->onEstimatedCamera(estimated.cameras.front());
  };
  constexpr double kWatched_s = 60.0;  // checks the rig in the first 60 s, like perdure doctor
  rig_watch_.emplace(dataset_->calibration().cameras.front(), kWatched_s);
  sinks.landmarks = [this](const Landmarks& landmarks) {
    landmarks_[landmarks.stamp.sequence] = landmarks;
    outputs_->onLandmarks(landmarks);
  };
  vio_ = std::make_unique<vio::Node>(configs_.vio, instanceOf(kVio), std::move(sinks));
  vio_->setWorld(session_);
  vio_->onCalibration(dataset_->calibration());
}

void Pipeline::checkWalk() const {
  if (options_.odometry_walk.empty() || (pose_file_ && !pose_file_->hasSteps())) return;
  const std::string accuracy = pose_file_                        ? "has the covariance of each step"
                               : options_.odometry == "vio"      ? "computes its covariance"
                               : options_.odometry == "drifting" ? "declares its own drift"
                               : options_.odometry == "truth"    ? "is exact"
                                                                 : "has its recorded covariance";
  throw StartupError(ExitCode::kUsage,
                     "--odometry-walk declares the accuracy of a pose file without one, and "
                     "--odometry " +
                         options_.odometry + " " + accuracy + ": leave --odometry-walk away");
}

void Pipeline::checkLandmarks() const {
  if (!options_.landmarks) return;
  const std::string given =
      "--landmarks makes points where poses are given: by a file, truth or "
      "drifting; ";
  if (options_.odometry == "vio") {
    throw StartupError(ExitCode::kUsage, given + "vio makes its own: leave --landmarks away");
  }
  if (options_.odometry == "recorded") {
    throw StartupError(ExitCode::kUsage,
                       given +
                           "--odometry recorded takes the points that were recorded: leave "
                           "--landmarks away. For new points of the recorded images give "
                           "--odometry a pose file, such as the trajectory.tum of that run");
  }
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
    file.numbers = dataset_->recording().numbers;
    for (const auto& camera : dataset_->calibration().cameras) {
      if (file.width == 0.0) file.width = camera.width, file.height = camera.height;
    }
    if (options.outline_boxes) file.boxes = BoxExtent::kOutline;
    if (options.cuboid_boxes) file.boxes = BoxExtent::kCuboid;
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
  inference_->onCalibration(dataset_->calibration());
}

}  // namespace perdure::tools
