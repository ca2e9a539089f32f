// Detections drawn from a simulated folder's truth, as the pipeline gets them from inference.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/config/fields.h"
#include "common/replay/dataset.h"
#include "common/sim/detector.h"

namespace perdure::tools {

/// The detector model as people configure it; pairs that are confused are "first/second=share".
struct DetectorConfig {
  sim::DetectorModel model;
  std::int64_t seed = 1;
  std::vector<std::string> confusion{"car/van=0.08", "chair/couch=0.05"};
};
void describe(DetectorConfig& config, config::Fields& fields);
/// With the seed and the pairs taken in. Throws StartupError(kConfiguration) for a pair that is
/// none.
sim::DetectorModel modelOf(const DetectorConfig& config);

class SimulatedDetections {
 public:
  /// Throws StartupError(kUnavailable) where the folder has no truth.
  SimulatedDetections(const DetectorConfig& config, const std::string& folder,
                      const replay::Dataset& dataset, InstanceId instance);

  ModelInfo info() const;
  /// Looks at the frame; what it saw is due `latency_s` later. A frame without a true pose is not
  /// looked at.
  void look(const Frame& frame);
  /// What is due up to then, in the order of frames.
  std::vector<Detections> due(TimePoint now);

 private:
  sim::SimulatedDetector detector_;
  replay::PoseFile body_;
  InstanceId instance_;
  Duration latency_;
  std::map<TimePoint, Detections> waiting_;
};

}  // namespace perdure::tools
