// Options of `perdure pipeline`, and the configurations of its services.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/inference/config.h"
#include "services/map_store/config.h"
#include "services/semantic_filter/config.h"
#include "services/vio/config.h"
#include "tools/pipeline/drifting_odometry.h"
#include "tools/pipeline/simulated_source.h"

namespace perdure::tools {

struct PipelineOptions {
  std::string data, sequence, rig, out;
  std::string map;          ///< a stored map to start from; empty: start with an empty map
  std::string odometry;     ///< vio, truth, drifting, recorded, or a pose file
  std::string odometry_of;  ///< frame of a pose file: "body", "camera"; empty: body, checked
  std::string odometry_walk;  ///< drift of a pose file, "m/√m,rad/√m"; empty: the map store's keys
  std::string detections;     ///< "model", "simulated", "recorded", "none", or a CSV file
  std::string model, class_name;
  std::vector<std::uint32_t> image_size;
  std::vector<std::string> topics;  ///< topics of a ROS recording: "cam0=/left/image_raw"
  double box_origin = 0.0;
  bool outline_boxes = false, cuboid_boxes = false;
  bool landmarks = false;  ///< with given poses: also compute landmarks from the images
  std::size_t every = 1;   ///< use every N-th frame only
  double from = 0.0;       ///< start, seconds after the first frame
  std::optional<double> seconds;
  std::optional<std::int64_t> seed;      ///< for --detections simulated and --odometry drifting
  std::vector<std::string> configs;      ///< service=FILE
  std::vector<std::string> assignments;  ///< service.key=value
  bool quiet = false;
  bool record = false;    ///< also write run.mcap
  bool pictures = false;  ///< also write overlay.mp4; map.png and evolution.png are always written
};

/// The services' configurations after files and assignments.
struct ServiceConfigs {
  vio::Config vio;
  semantic_filter::Config semantic_filter;
  inference::Config inference;
  map_store::Config map_store;  ///< the path of the file is always OUT/map.sqlite
  DetectorConfig detector;      ///< for --detections simulated; service `detector`
  DriftConfig drifting;         ///< for --odometry drifting
  std::uint64_t digest = 0;     ///< digest of all values
};

/// Reads SERVICE.yaml in the configuration folder, if it exists, or the file of --config. The file
/// of the simulated detector is simulated_detector.yaml. Throws StartupError: kConfiguration with
/// all errors, kUsage for an unknown service or a malformed walk.
ServiceConfigs readServiceConfigs(const PipelineOptions& options);

}  // namespace perdure::tools
