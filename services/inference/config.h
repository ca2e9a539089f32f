// Configuration of inference.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/config/fields.h"

namespace perdure::inference {

struct ModelConfig {
  std::string path;         ///< .onnx, or .cfg with its .weights
  std::string description;  ///< empty: see readModelFile()
  std::string backend = "auto";
  std::int64_t threads = 1;
  double budget_ms = 0.0;  ///< time per frame; 0: no budget, always the network's own input size
};

struct DetectionConfig {
  std::string camera = "cam0";
  std::string turn = "auto";  ///< clockwise turn of the images in degrees, or "auto"
  double score_threshold = 0.05;
  double merge_iou = 0.5;
  std::int64_t limit = 100;
  std::vector<std::string> classes;  ///< empty: all classes of the network
  bool prime = true;                 ///< answer predicted boxes (core/decode/prime.h)
};

struct OwnershipConfig {
  std::int64_t strength = 10;
  bool standby = false;
  double period_s = 0.1;
  double probation_s = 0.0;
};

struct Config {
  ModelConfig model;
  DetectionConfig detection;
  OwnershipConfig ownership;
};

void describe(Config& config, config::Fields& fields);

/// Returns the lease of `detections`: three periods, but at least 100 ms.
double leaseSeconds(const OwnershipConfig& ownership);

}  // namespace perdure::inference
