// Runs the node of `inference` over a dataset and writes the detections as CSV.
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
  std::string sequence;  ///< sequence of KITTI tracking, or of a 7-Scenes folder
  inference::Config inference;
};

struct DetectSummary {
  std::uint64_t frames = 0, failed = 0, boxes = 0;
  double cpu_ms_median = 0.0;  ///< per frame, all threads, from image to detections
};

/// Writes the columns frame,class,x1,y1,x2,y2,score,azimuth,sigma_azimuth,logit:<class>…. The score
/// is the largest soft-max of the K+1 activations, clutter excluded; the class is the one that has
/// it.
void writeDetectionHeader(std::ostream& out, const ModelInfo& model);
void writeDetection(std::ostream& out, const ModelInfo& model, std::uint64_t frame,
                    const Detection& detection);

/// Runs the detector. Throws StartupError if the data, the network or `out` cannot be used.
/// `report` may be empty.
DetectSummary detect(const DetectOptions& options,
                     const std::function<void(std::uint64_t done, std::uint64_t all)>& report);

}  // namespace perdure::tools
