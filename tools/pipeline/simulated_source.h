// Draws detections from a simulated folder's truth, as messages like those of inference.
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

/// The configuration of the detector model. Pairs of confused classes have the form
/// "first/second=share".
struct DetectorConfig {
  sim::DetectorModel model;
  std::int64_t seed = 1;
  std::string boxes = "outline";
  std::vector<std::string> confusion{"car/van=0.08", "chair/couch=0.05"};
};
void describe(DetectorConfig& config, config::Fields& fields);
/// Returns the detector model with the seed and the confused classes of `config`. Throws
/// StartupError(kConfiguration) for a malformed pair.
sim::DetectorModel modelOf(const DetectorConfig& config);

class SimulatedDetections {
 public:
  /// Throws StartupError(kUnavailable) if the folder has no truth.
  SimulatedDetections(const DetectorConfig& config, const std::string& folder,
                      const replay::Dataset& dataset, InstanceId instance);

  ModelInfo info() const;
  /// Draws the detections of a frame, which are due `latency_s` later. Ignores frames without a
  /// true pose.
  void look(const Frame& frame);
  /// Removes and returns the detections that are due at `now`, in the order of frames.
  std::vector<Detections> due(TimePoint now);

 private:
  sim::SimulatedDetector detector_;
  replay::PoseFile body_;
  InstanceId instance_;
  Duration latency_;
  std::map<TimePoint, Detections> waiting_;
};

}  // namespace perdure::tools
