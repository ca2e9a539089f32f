// What `perdure pipeline` is told, and the configuration of the services that it runs.
#pragma once

#include <cstdint>
#include <filesystem>
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
  std::string map;         ///< a stored map to begin with; empty: an empty one
  std::string odometry;    ///< vio, truth, drifting, recorded, or a pose file
  std::string detections;  ///< model, simulated, recorded, none, or a CSV
  std::string model, class_name;
  std::vector<std::uint32_t> image_size;
  std::vector<std::string> topics;  ///< of a recording of ROS: "cam0=/left/image_raw"
  double box_origin = 0.0;
  bool outline_boxes = false;
  bool landmarks = false;  ///< with poses that are given: points from the images too
  std::size_t every = 1;   ///< each N-th frame alone
  double from = 0.0;       ///< seconds after the first frame at which to begin
  std::optional<double> seconds;
  std::optional<std::int64_t> seed;      ///< of --detections simulated and --odometry drifting
  std::vector<std::string> configs;      ///< service=FILE
  std::vector<std::string> assignments;  ///< service.key=value
  bool quiet = false;
  bool record = false;    ///< run.mcap too
  bool pictures = false;  ///< overlay.mp4; map.png and evolution.png come always
};

/// The services' configurations after files and assignments.
struct ServiceConfigs {
  vio::Config vio;
  semantic_filter::Config semantic_filter;
  inference::Config inference;
  map_store::Config map_store;  ///< its path is OUT/map.sqlite, whatever it says
  DetectorConfig detector;      ///< of --detections simulated; service `detector`
  DriftConfig drifting;         ///< of --odometry drifting
  std::uint64_t digest = 0;     ///< of all values
};

/// Throws StartupError: kConfiguration with all that is wrong, kUsage for an unknown service.
/// Files: config/SERVICE.yaml of the configuration folder where there is one, or --config; the
/// simulated detector's is simulated_detector.yaml.
ServiceConfigs readServiceConfigs(const PipelineOptions& options);

/// The folder `config`: $PERDURE_CONFIG_DIR, else the one of the working directory, of the source
/// tree or installation above the program. Throws StartupError(kUnavailable) with the mend.
std::filesystem::path configFolder();

}  // namespace perdure::tools
