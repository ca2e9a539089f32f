// Frames in, evidence out: the likelihood of eq. 6 and 7, by a network.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/types/detections.h"
#include "common/types/sensors.h"
#include "services/inference/config.h"
#include "services/inference/core/decode/prime.h"
#include "services/inference/core/network/network.h"
#include "services/inference/model_file.h"

namespace perdure::inference {

class Node {
 public:
  /// Loads, warms and tests the network. Throws StartupError with the mend.
  Node(const Config& config, InstanceId instance);

  /// What the activations mean; classes are those that are reported.
  const ModelInfo& model() const { return info_; }

  const ModelDescription& description() const { return description_; }
  /// What computes the network, for people.
  std::string backend() const;

  /// Boxes in pixels of the frame, as the network extrapolates them (not clipped to the image).
  /// An empty list is a result: nothing is there. `expected` says where objects should be: each
  /// that no box meets gets a primed answer (core/decode/prime.h), where the model is calibrated
  /// for it and the predictions fit the frame. Reasons: "frame_malformed", "model_failed",
  /// "model_output_shape", "model_output_not_finite".
  Result<Detections> infer(const Frame& frame, const Predictions& expected = {});

  /// Seconds of a steady clock, for Detections::forward_s; without one it stays 0, not known.
  void timeBy(std::function<double()> clock_s) { clock_s_ = std::move(clock_s); }

  /// Pixels of each input size that the network takes over those of its own, falling from 1. More
  /// than one where there is a time budget.
  std::vector<double> sizeShares() const;
  /// Which of them to look with from now on.
  void useSize(std::size_t size);
  /// Input width over the network's own.
  double inputScale() const;

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

  /// The network at one size of its input.
  struct Size {
    ModelDescription description;
    std::unique_ptr<Network> network;
  };
  void addSmallerSizes(const ModelFile& file);
  const ModelDescription& at() const { return sizes_[size_].description; }

  Config config_;
  ModelDescription description_;  ///< at its own size
  std::vector<Size> sizes_;       ///< its own first, smaller ones where there is a budget
  std::size_t size_ = 0;
  std::function<double()> clock_s_;
  double forward_s_ = 0.0;  ///< of the last frame
  DecodeOptions options_;
  ModelInfo info_;
};

}  // namespace perdure::inference
