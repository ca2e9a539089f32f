// The inference service's own node over all frames of a dataset, its answers as a CSV.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>

#include "common/types/detections.h"
#include "services/inference/config.h"

namespace perdure::tools {

struct DetectOptions {
  std::filesystem::path data, out;
  std::string sequence;  ///< of KITTI tracking, and of a 7-Scenes folder with several
  inference::Config inference;
};

struct DetectSummary {
  std::uint64_t frames = 0, failed = 0, boxes = 0;
  double cpu_ms_median = 0.0;  ///< of a frame, all threads: picture to detections
};

/// frame,class,x1,y1,x2,y2,score,azimuth,sigma_azimuth,logit:<class>…; score and class are the
/// largest of the soft-max of the K+1 activations that is no clutter.
void writeDetectionHeader(std::ostream& out, const ModelInfo& model);
void writeDetection(std::ostream& out, const ModelInfo& model, std::uint64_t frame,
                    const Detection& detection);

/// Throws StartupError where the data, the network or `out` cannot be used. `report` may be empty.
DetectSummary detect(const DetectOptions& options,
                     const std::function<void(std::uint64_t done, std::uint64_t all)>& report);

}  // namespace perdure::tools
