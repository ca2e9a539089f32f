// Frames in, evidence out: the likelihood of eq. 6 and 7, by a network that OpenCV runs.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/result.h"
#include "common/types/detections.h"
#include "common/types/sensors.h"
#include "services/inference/config.h"
#include "services/inference/core/network.h"
#include "services/inference/model_file.h"

namespace perdure::inference {

class Node {
 public:
  /// Loads, warms and tests the network. Throws StartupError with the mend.
  Node(const Config& config, InstanceId instance);

  /// What the activations mean; classes are those that are reported.
  const ModelInfo& model() const { return info_; }

  /// Boxes in pixels of the frame, as the network extrapolates them (not clipped to the image).
  /// An empty list is a result: nothing is there. Reasons: "frame_malformed", "model_failed",
  /// "model_output_shape", "model_output_not_finite".
  Result<Detections> infer(const Frame& frame);

 private:
  Node(const Config& config, InstanceId instance, ModelFile file);
  void chooseClasses();
  void testItself();
  Result<std::vector<Candidate>> candidatesIn(const Frame& frame);

  Config config_;
  ModelDescription description_;
  Network network_;
  DecodeOptions options_;
  ModelInfo info_;
};

}  // namespace perdure::inference
