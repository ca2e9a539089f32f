// Writes the files of `perdure pipeline` and the demo. The same messages give the same bytes.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/replay/files/pose_file.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"
#include "tools/outputs/frames/drive_in_map.h"
#include "tools/outputs/object_history.h"
#include "tools/outputs/pictures/drive_log.h"
#include "tools/outputs/pictures/loop_chart.h"
#include "tools/outputs/pictures/map_picture.h"
#include "tools/outputs/pictures/picture_truth.h"

namespace perdure::tools {

class OutputWriter {
 public:
  /// Creates the folder. Throws StartupError(kUnavailable) if that fails. `sequence`: the value of
  /// the tables' column of this name.
  OutputWriter(std::filesystem::path folder, std::string sequence);

  void setShapes(std::map<std::string, ShapePoints> shapes) {
    history_.setShapes(std::move(shapes));
  }
  void onCalibration(const Calibration& calibration);
  void onOdometry(const Odometry& odometry);
  void onObjects(const Objects& objects);
  void onEvent(const Event& event);
  void onDetections(const Detections& detections) { log_.add(detections); }
  void onEstimatedCamera(const CameraCalibration& camera) { log_.add(camera); }
  /// Stores the points for map.png whose standard deviation is at most 1 m.
  void onLandmarks(const Landmarks& landmarks);
  /// Sets the ground truth for the pictures, in W. Must be called before finish().
  void setTruth(PictureTruth truth) { truth_ = std::move(truth); }
  /// Makes finish() write map.png and map.geojson in M, and trajectory_map.tum with the trajectory
  /// by the map's final graph. Must be called before finish().
  void setInMap(DriveInMap in_map) { in_map_ = std::move(in_map); }

  /// Writes all files except events.jsonl and odometry.csv, which are written as messages arrive.
  /// Throws StartupError(kInputOutput) with the file that is incomplete.
  void finish();
  /// Writes an additional file, such as timing.json or report.json.
  void writeJson(const std::string& name, const nlohmann::ordered_json& json) const;

  const ObjectHistory& history() const { return history_; }
  const DriveLog& log() const { return log_; }
  /// Poses of the usable odometry messages, by frame.
  const std::map<std::uint64_t, replay::StampedPose>& poses() const { return poses_; }
  std::size_t odometryFrames() const { return poses_.size(); }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  void open(std::ofstream& stream, const char* name) const;
  void writeTable(const std::string& name, const std::vector<ObjectRow>& rows) const;
  void writeTrajectory() const;
  void writeMapTrajectory() const;
  void writeObjects() const;
  void writeGeoJson() const;
  void writePictures() const;
  MapContent mapContent() const;
  /// The last beliefs, transformed to M if the run has a map frame; otherwise in W.
  std::vector<ObjectBelief> beliefsInMap() const;
  std::optional<RigidTransform> poseAtAnchor() const;

  std::filesystem::path folder_;
  std::string sequence_;
  ObjectHistory history_;
  DriveLog log_;
  std::map<std::uint64_t, replay::StampedPose> poses_;
  struct SparsePoint {
    TimePoint time;
    Eigen::Vector3f p_W = Eigen::Vector3f::Zero();
  };
  std::map<std::pair<InstanceId, std::uint64_t>, SparsePoint> landmarks_;
  std::optional<PictureTruth> truth_;
  DriveInMap in_map_;
  std::vector<BodyErrors::Mark> loop_marks_;
  std::optional<GeoAnchor> anchor_;
  std::ofstream events_, odometry_;
};

nlohmann::ordered_json toJson(const Event& event);
nlohmann::ordered_json toJson(const ObjectBelief& belief);

}  // namespace perdure::tools
