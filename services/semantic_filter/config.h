// The configuration of the semantic filter.
#pragma once

#include <cstdint>
#include <string>

#include "common/config/fields.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

struct HistoryConfig {
  std::int64_t frames = 32;  ///< number of past frames to which a late detection is still applied
  bool wait_for_detections = true;  ///< publish a frame with its detections, or at the next frame
};

struct RestoreConfig {
  double timeout_s = 5.0;  ///< s; longest wait at the start for the map store's answer
};

struct Config {
  std::string class_priors = "config/class_priors.yaml";
  HistoryConfig history;
  RestoreConfig restore;
  Parameters filter;
};

void describe(Config& config, config::Fields& fields);

}  // namespace perdure::semantic_filter
