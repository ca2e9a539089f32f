// The services' nodes in one process, lock-step: a frame is taken only when everything that follows
// from the one before is done. No clock enters, instance ids are fixed: two runs give the same
// bytes.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "common/bus/once.h"
#include "common/replay/data_check.h"
#include "common/replay/dataset.h"
#include "common/replay/files/detection_file.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/recording_writer.h"
#include "services/inference/node.h"
#include "services/semantic_filter/node.h"
#include "services/vio/known_pose_node.h"
#include "services/vio/node.h"
#include "tools/calibrate/rig_check.h"
#include "tools/outputs/output_writer.h"
#include "tools/outputs/stage_timer.h"
#include "tools/pipeline/map_follower.h"
#include "tools/pipeline/map_memory.h"
#include "tools/pipeline/settings.h"

namespace perdure::tools {

/// What went through, for report.json and the progress line.
struct PipelineCounts {
  std::uint64_t frames = 0, frames_unreadable = 0, odometry = 0, inferred = 0, detections = 0,
                objects = 0;
  std::vector<double> latency_ms;  ///< wall time from a decoded frame to its `objects`
};

/// Throws StartupError(kUsage) where --out or --record would write over the data.
void refuseOut(const PipelineOptions& options);

class Pipeline {
 public:
  /// Throws StartupError with the mend: data, poses, detections, model, configuration.
  explicit Pipeline(const PipelineOptions& options);
  ~Pipeline();

  /// Is told each `objects` as it is published, beside what is written.
  void listen(std::function<void(const Objects&)> listener) { listener_ = std::move(listener); }
  /// Until the data or --seconds end; `progress` is called after each frame of cam0.
  void run(const std::function<void(const PipelineCounts&)>& progress);
  /// Writes every file but report.json. Throws StartupError(kInputOutput) where one is not whole.
  void finish();
  /// Throws StartupError(kData) with the cause and the mend where nothing came out: no frame could
  /// be used, no pose came, or there were to be detections and nothing is on the map.
  void refuseNothing() const;
  /// Writes overlay.mp4; returns what became of it, as a sentence. After finish().
  std::string drawOverlay(const std::function<void(std::size_t, std::size_t)>& progress) const;

  const PipelineCounts& counts() const { return counts_; }
  const replay::Dataset& dataset() const { return *dataset_; }
  const OutputWriter& outputs() const { return *outputs_; }
  OutputWriter& outputs() { return *outputs_; }
  std::uint64_t configurationDigest() const { return configs_.digest; }
  /// What was doubtful of the data before the run.
  const replay::DataFindings& findings() const { return findings_; }
  /// Index of the first frame of the data that is used.
  std::uint64_t firstFrame() const { return first_index_; }
  /// Of the first frame that --seconds left out.
  std::optional<std::uint64_t> endFrame() const { return end_index_; }
  /// Where odometry and detections are recorded ones: the frames that the filter heard of, by the
  /// numbers that they had when they were recorded.
  const std::optional<std::set<std::uint64_t>>& recordedFrames() const { return heard_frames_; }
  bool usesVio() const { return uses_vio_; }
  bool usesModel() const { return inference_ != nullptr; }
  /// A sentence where the poses that were given contradict the images; else empty.
  std::string doubtOfPoses() const;
  /// What was counted in the run and must be told, a sentence each.
  std::vector<std::string> doubts() const;
  /// Counted reasons by service.
  std::map<std::string, ReasonCounts> reasons() const;

 private:
  // In pipeline_open.cpp.
  void openOdometry(const PipelineOptions& options);
  void checkLandmarks() const;
  void openKnownPoses();
  void openDetections(const PipelineOptions& options);
  void openData();
  InstanceId instanceOf(InstanceId service) const;
  void openFilter();
  void openRun();
  replay::DatasetOptions dataOptions() const;
  // In pipeline.cpp.
  void learn(const ModelInfo& model);
  void hear(const ModelInfo& model);
  void remember();
  void keepMap(const MapFrame& frame);
  void askForGraph();
  // In pipeline_checks.cpp.
  void checkData();
  void checkDetectionFile() const;
  void refuseUnwritten() const;
  // In pipeline_recorded.cpp.
  void checkRecorded();
  void runRecorded(const std::function<void(const PipelineCounts&)>& progress);
  void handleRecorded(const replay::RecordedMessage& message);
  /// Into OUT/run.mcap, where that is asked for. Log times are those of the sensors.
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
  std::map<std::string, ShapePoints> shapes_;  ///< of the class priors
  std::unique_ptr<replay::RecordingWriter> run_;
  std::int64_t run_ns_ = 0;
  std::optional<TimePoint> graph_kept_;  ///< in run.mcap, when last
  std::uint64_t graphs_asked_ = 0;
  bool graph_waits_ = false;                                           ///< it has changed since
  std::function<std::optional<Odometry>(const FrameStamp&)> pose_at_;  ///< none: vio's
  std::optional<replay::PoseFile> pose_file_;
  std::optional<replay::DetectionFile> detection_file_;
  std::unique_ptr<inference::Node> inference_;
  std::unique_ptr<SimulatedDetections> simulated_;
  std::unique_ptr<vio::Node> vio_;
  std::optional<calibrate::RigWatch> rig_watch_;     ///< of vio
  std::unique_ptr<vio::KnownPoseNode> known_poses_;  ///< landmarks where the poses are given
  std::unique_ptr<semantic_filter::Node> filter_;
  std::unique_ptr<MapMemory> map_;
  std::optional<MapFollower> in_map_;  ///< where the map has a graph
  bool uses_vio_ = false;
  bool recorded_ = false;    // odometry and detections come from the recording
  bus::Once odometry_once_;  // of the recording, as the service has it
  std::uint64_t model_hash_ = 0;
  std::optional<TimePoint> first_frame_;
  std::uint64_t first_index_ = 0;  ///< in the data, by --from
  std::optional<std::uint64_t> end_index_;
  std::optional<std::set<std::uint64_t>> heard_frames_;
  double frames_seconds_ = 0.0;                   // of the recording, since its first frame
  std::vector<Odometry> new_odometry_;            // of vio, not yet handed on
  std::vector<Odometry> held_;                    // given, until their landmarks are there
  std::map<std::uint64_t, Landmarks> landmarks_;  // by frame, waiting for the filter
  std::map<std::uint64_t, Detections> waiting_;   // detections whose odometry has not come
  std::set<std::uint64_t> waits_for_detections_;  // frames whose odometry has come
  std::map<std::uint64_t, double> started_ms_;    // wall clock, by frame
  ReasonCounts reasons_;
  Predictions expected_;  // where objects should be seen in the next frame
  PipelineCounts counts_;
  std::function<void(const Objects&)> listener_;
};

}  // namespace perdure::tools
