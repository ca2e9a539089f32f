// Runs the services' nodes in one process, in lock-step: a frame is taken only when all effects of
// the previous frame are processed. No clock is used and instance ids are fixed, so two runs give
// the same bytes.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "common/bus/once.h"
#include "common/replay/data_check.h"
#include "common/replay/dataset.h"
#include "common/replay/files/boxes/detection_file.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/recording_writer.h"
#include "services/inference/node.h"
#include "services/semantic_filter/node.h"
#include "services/semantic_filter/priors.h"
#include "services/vio/known_pose_node.h"
#include "services/vio/node.h"
#include "tools/calibrate/rig_check.h"
#include "tools/outputs/box_sizes.h"
#include "tools/outputs/output_writer.h"
#include "tools/outputs/run_doubts.h"
#include "tools/outputs/stage_timer.h"
#include "tools/pipeline/map_follower.h"
#include "tools/pipeline/map_memory.h"
#include "tools/pipeline/settings.h"

namespace perdure::tools {

/// Counts of processed data, for report.json and the progress line.
struct PipelineCounts {
  std::uint64_t frames = 0, odometry = 0, inferred = 0, detections = 0, objects = 0;
  std::vector<double> latency_ms;  ///< wall time from a decoded frame to its `objects`
};

/// Throws StartupError(kUsage) if --out or --record would overwrite the data.
void refuseOut(const PipelineOptions& options);

class Pipeline {
 public:
  /// Throws StartupError with the fix if data, poses, detections, network or configuration are
  /// unusable.
  explicit Pipeline(const PipelineOptions& options);
  ~Pipeline();

  /// The listener receives each published `objects`, in addition to the files.
  void listen(std::function<void(const Objects&)> listener) { listener_ = std::move(listener); }
  /// Runs to the end of the data or of --seconds. Calls `progress` after each frame of cam0.
  void run(const std::function<void(const PipelineCounts&)>& progress);
  /// Writes all files except report.json. Throws StartupError(kInputOutput) if one is incomplete.
  void finish();
  /// Throws StartupError(kData) with the cause and the fix if there are no results: no usable
  /// frame, no pose, or no object on the map although detections were expected.
  void refuseNothing() const;
  /// Writes overlay.mp4 and returns the result as a sentence. Must be called after finish().
  std::string drawOverlay(const std::function<void(std::size_t, std::size_t)>& progress) const;

  const PipelineCounts& counts() const { return counts_; }
  const replay::Dataset& dataset() const { return *dataset_; }
  const OutputWriter& outputs() const { return *outputs_; }
  OutputWriter& outputs() { return *outputs_; }
  std::uint64_t configurationDigest() const { return configs_.digest; }
  /// Findings in the data before the run, and about the rig after a doubtful one.
  const replay::DataFindings& findings() const { return findings_; }
  /// Index of the first frame of the data in use.
  std::uint64_t firstFrame() const { return first_index_; }
  /// Index of the first frame after the end set by --seconds; empty if the run used all frames.
  std::optional<std::uint64_t> endFrame() const { return end_index_; }
  /// The recording's sequence numbers of the frames that the filter received; empty unless odometry
  /// and detections are recorded ones.
  const std::optional<std::set<std::uint64_t>>& recordedFrames() const { return heard_frames_; }
  bool usesModel() const { return inference_ != nullptr; }
  /// Returns a sentence if the given poses contradict the images; otherwise an empty string.
  std::string doubtOfPoses() const;
  /// Returns the problems of the run as sentences for the user.
  Doubts doubts() const;
  /// Returns the counted reasons by service.
  std::map<std::string, ReasonCounts> reasons() const;

 private:
  // These functions are in pipeline_open.cpp.
  void openOdometry(const PipelineOptions& options);
  void checkWalk() const;
  void turnPosesToBody();
  void checkLandmarks() const;
  void openKnownPoses();
  void openDetections(const PipelineOptions& options);
  void openData();
  InstanceId instanceOf(InstanceId service) const;
  void openFilter();
  void openRun();
  replay::DatasetOptions dataOptions() const;
  // These functions are in pipeline.cpp.
  void learn(const ModelInfo& model);
  void hear(const ModelInfo& model);
  void remember();
  void keepMap(const MapFrame& frame);
  void askForGraph();
  // These functions are in pipeline_checks.cpp.
  void checkData();
  void checkDetectionFile();
  void checkClasses();
  std::vector<EstimatedHeight> estimatedHeights() const;
  void judgeMotion();
  void refuseUnwritten() const;
  // These functions are in pipeline_recorded.cpp.
  void checkRecorded();
  void runRecorded(const std::function<void(const PipelineCounts&)>& progress);
  void handleRecorded(const replay::RecordedMessage& message);
  /// Writes a message to OUT/run.mcap if --record is given. Log times are sensor times.
  template <class T>
  void keep(const std::string& topic, const T& value, TimePoint time) {
    if (!run_) return;
    run_ns_ = std::max(run_ns_, toNanoseconds(time));
    const auto kept = run_->add(topic, value, static_cast<std::uint64_t>(run_ns_));
    if (!kept) reasons_.add("run_" + topic + "_" + kept.error().code);
  }
  void handle(const replay::Message& message);
  void handleFrame(const Frame& frame);
  void givePose(const Frame& frame);
  void releasePoses();
  void noteLatency(const FrameStamp& stamp);
  void detect(const Frame& frame);
  void offer(Detections detections);
  void offerDue(TimePoint now);
  void deliver();
  void deliverDetections(std::uint64_t frame);

  PipelineOptions options_;
  WorldId session_{1, 0};
  ServiceConfigs configs_;
  StageTimer timer_;
  std::unique_ptr<replay::Dataset> dataset_;
  replay::DataFindings findings_;
  std::unique_ptr<OutputWriter> outputs_;
  std::optional<Doubt> box_doubt_;  ///< boxes that move otherwise than objects at rest
  semantic_filter::ClassPriors priors_;
  std::map<std::string, ShapePoints> shapes_;  ///< shapes of the class priors
  std::unique_ptr<replay::RecordingWriter> run_;
  std::int64_t run_ns_ = 0;
  std::optional<TimePoint> graph_kept_;  ///< time of the last graph in run.mcap
  std::uint64_t graphs_asked_ = 0;
  bool graph_waits_ = false;  ///< run.mcap lacks the newest graph
  /// Returns the pose of a frame; empty if vio computes the poses.
  std::function<std::optional<Odometry>(const FrameStamp&)> pose_at_;
  std::optional<replay::PoseFile> pose_file_;
  std::optional<replay::DetectionFile> detection_file_;
  std::unique_ptr<inference::Node> inference_;
  std::unique_ptr<SimulatedDetections> simulated_;
  std::unique_ptr<vio::Node> vio_;
  std::optional<calibrate::RigWatch> rig_watch_;     ///< checks vio's estimates of the rig
  std::unique_ptr<vio::KnownPoseNode> known_poses_;  ///< computes landmarks if poses are given
  std::unique_ptr<semantic_filter::Node> filter_;
  std::unique_ptr<MapMemory> map_;
  std::optional<MapFollower> in_map_;  ///< empty if the map has no graph
  bool recorded_ = false;              // odometry and detections come from the recording
  bus::Once odometry_once_;  // detects repeated messages in the recording, as the service does
  std::uint64_t model_hash_ = 0;
  std::optional<TimePoint> first_frame_;
  std::uint64_t first_index_ = 0;  ///< index in the data of the first frame after --from
  std::optional<std::uint64_t> end_index_;
  std::optional<std::set<std::uint64_t>> heard_frames_;
  double frames_seconds_ = 0.0;         // seconds since the first frame of the recording
  std::vector<Odometry> new_odometry_;  // odometry of vio that is not yet delivered
  std::vector<Odometry> held_;          // given poses that wait for their landmarks
  // landmarks by frame that are not yet delivered to the filter
  std::map<std::uint64_t, Landmarks> landmarks_;
  std::map<std::uint64_t, Detections> waiting_;   // detections whose odometry has not arrived
  std::set<std::uint64_t> waits_for_detections_;  // frames whose odometry has arrived
  std::map<std::uint64_t, double> started_ms_;    // wall time of decoding, by frame
  ReasonCounts reasons_;
  Predictions expected_;  // expected boxes in the next frame
  PipelineCounts counts_;
  std::function<void(const Objects&)> listener_;
};

}  // namespace perdure::tools
