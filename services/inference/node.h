// Computes evidence from frames with a network: the likelihood of the paper's eq. 6 and 7.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/types/detections.h"
#include "common/types/odometry.h"
#include "common/types/sensors.h"
#include "services/inference/config.h"
#include "services/inference/core/decode/prime.h"
#include "services/inference/core/network/image_fit.h"
#include "services/inference/core/network/network.h"
#include "services/inference/model_file.h"

namespace perdure::inference {

class Node {
 public:
  /// Loads, warms up and tests the network. Throws StartupError with the fix if it cannot be used.
  Node(const Config& config, InstanceId instance);

  /// Returns the description of the activations and of the reported classes. Each turn of the
  /// images has its own description, because the insets of the boxes differ.
  const ModelInfo& model() const { return info_; }

  const ModelDescription& description() const { return description_; }
  std::string backend() const;

  /// Calibration and odometry determine the turn of the next frames (core/network/image_fit.h).
  void onCalibration(const perdure::Calibration& calibration) { calibration_ = calibration; }
  void onOdometry(const Odometry& odometry);

  /// Returns boxes in pixels of the frame, not clipped to the image. An empty list is a valid
  /// result. Each object of `expected` without a matching box gets a top-down answer
  /// (core/decode/prime.h), if the model is calibrated for answers and the predictions match the
  /// frame. Fails with "frame_malformed", "model_failed", "model_output_shape" or
  /// "model_output_not_finite".
  Result<Detections> infer(const Frame& frame, const Predictions& expected = {});

  /// Sets a steady clock in seconds, which measures Detections::forward_s. Without a clock,
  /// forward_s is 0 (unknown).
  void timeBy(std::function<double()> clock_s) { clock_s_ = std::move(clock_s); }

  /// Returns the numbers of pixels of the usable input sizes relative to the network's own size,
  /// falling from 1.
  std::vector<double> sizeShares() const;
  void useSize(std::size_t size);
  /// Returns the input width relative to the network's own.
  double inputScale() const;

  /// Returns all boxes whose best reported class has at least the score `floor`, in pixels of the
  /// network's input, before overlaps are merged. Fails like infer().
  Result<std::vector<Candidate>> candidatesIn(const Frame& frame, double floor);

 private:
  Node(const Config& config, InstanceId instance, ModelFile file);
  void chooseClasses();
  void describe();
  void testItself();
  void turnFor(const Frame& frame);
  ImageFit fitTo(const Frame& frame) const;
  bool primes(const Predictions& expected, const Frame& frame) const;
  std::vector<Expectation> expectationsOf(const Predictions& expected, const Frame& frame) const;
  void addPrimed(const Predictions& expected, const Frame& frame,
                 const std::vector<Candidate>& reported, const std::vector<Candidate>& candidates,
                 Detections& out) const;

  struct Size {
    ModelDescription description;
    std::unique_ptr<Network> network;
  };
  void addSmallerSizes(const ModelFile& file);
  const ModelDescription& at() const { return sizes_[size_].description; }

  Config config_;
  ModelDescription description_;  ///< description at the network's own size
  /// The network's own size first, then smaller sizes if there is a budget.
  std::vector<Size> sizes_;
  std::size_t size_ = 0;
  int quarters_ = 0;  ///< clockwise quarter turns of the images
  perdure::Calibration calibration_;
  std::optional<Eigen::Vector3d> up_B_;  ///< points against gravity, in B
  std::function<double()> clock_s_;
  double forward_s_ = 0.0;  ///< of the last frame
  DecodeOptions options_;
  std::string identity_;  ///< identity of the network, without a turn
  ModelInfo info_;
};

}  // namespace perdure::inference
