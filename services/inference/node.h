// Frames in, evidence out: the likelihood of eq. 6 and 7, by a network that OpenCV runs.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/result.h"
#include "common/types/detections.h"
#include "common/types/sensors.h"
#include "services/inference/config.h"
#include "services/inference/core/network.h"
#include "services/inference/core/prime.h"
#include "services/inference/model_file.h"

namespace perdure::inference {

class Node {
 public:
  /// Loads, warms and tests the network. Throws StartupError with the mend.
  Node(const Config& config, InstanceId instance);

  /// What the activations mean; classes are those that are reported.
  const ModelInfo& model() const { return info_; }

  const ModelDescription& description() const { return description_; }

  /// Boxes in pixels of the frame, as the network extrapolates them (not clipped to the image).
  /// An empty list is a result: nothing is there. `expected` says where objects should be: each
  /// that no box meets gets a primed answer (core/prime.h), where the model is calibrated for it
  /// and the predictions fit the frame. Reasons: "frame_malformed", "model_failed",
  /// "model_output_shape", "model_output_not_finite".
  Result<Detections> infer(const Frame& frame, const Predictions& expected = {});

  /// Every box whose best reported class scores `floor` or more, in pixels of the network's input,
  /// before overlaps are merged. Reasons as of infer().
  Result<std::vector<Candidate>> candidatesIn(const Frame& frame, double floor);

 private:
  Node(const Config& config, InstanceId instance, ModelFile file);
  void chooseClasses();
  void testItself();
  bool primes(const Predictions& expected, const Frame& frame) const;
  std::vector<Expectation> expectationsOf(const Predictions& expected, const Frame& frame) const;
  void addPrimed(const Predictions& expected, const Frame& frame,
                 const std::vector<Candidate>& reported, const std::vector<Candidate>& candidates,
                 Detections& out) const;

  Config config_;
  ModelDescription description_;
  Network network_;
  DecodeOptions options_;
  ModelInfo info_;
};

}  // namespace perdure::inference
