// What a network's activations are worth, from labelled frames: temperature, bias, clutter, the
// evidence of primed answers, and how sharp its boxes are (services/inference/README.md).
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "services/inference/config.h"
#include "tools/model/calibration_fit.h"
#include "tools/model/labelled_frames.h"

namespace perdure::tools {

struct CalibrateOptions {
  inference::Config inference;  ///< network, description, threshold, merging: as deployed
  std::vector<LabelRequest> data;
  bool primed_only = false;     ///< temperature, bias and clutter rate stay as they are
  double primed_floor = 0.002;  ///< least score of a candidate that may answer a prediction
};

struct CalibrationResult {
  inference::Calibration before, fitted;
  Reliability reliability_before;  ///< of all boxes, by the model.json as it is
  Reliability reliability_after;   ///< of all boxes, each by a fit to other frames
  std::size_t frames = 0, boxes = 0, targets = 0, targets_found = 0;
  double false_boxes = 0.0;                          ///< a frame, above the lax threshold
  std::size_t asked_there = 0, asked_elsewhere = 0;  ///< places of the primed fit
  double primed_nats_there = 0.0, primed_nats_elsewhere = 0.0;  ///< means; elsewhere it is < 0
  bool has_primed = false;
  double box_sigma = 0.0;                                    ///< 0: too few clear boxes
  std::map<std::string, std::array<double, 4>> side_insets;  ///< of classes with enough of them
};

/// Through the service's own node. Throws StartupError where the network, the data or the labels
/// cannot be used, or hold too little. `progress` may be empty.
CalibrationResult calibrate(const CalibrateOptions& options,
                            const std::function<void(std::size_t, std::size_t)>& progress);

/// model.json with the fitted values in it; other keys stay as they are. box_sigma and side_insets
/// change only where the file has them. Throws StartupError (78) where it is no JSON object.
std::string withCalibration(const std::string& model_json, const CalibrationResult& result);

/// Reliability diagrams before and after. Throws StartupError (69) where it cannot be written.
void drawReliability(const CalibrationResult& result, const std::filesystem::path& file);

}  // namespace perdure::tools
