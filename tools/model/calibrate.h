// Calibrates a network with labelled frames: temperature, bias, clutter rate, the evidence of
// top-down likelihoods, and the accuracy of boxes (services/inference/README.md).
#pragma once

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
  bool primed_only = false;     ///< keeps temperature, bias and clutter rate
  double primed_floor = 0.002;  ///< least score of a candidate at a predicted measurement
};

struct CalibrationResult {
  inference::Calibration before, fitted;
  Reliability reliability_before;  ///< reliability of all boxes, with the given model.json
  Reliability reliability_after;   ///< reliability of all boxes, each with a fit to other frames
  std::size_t frames = 0, boxes = 0, targets = 0, targets_found = 0;
  double false_boxes = 0.0;                          ///< mean per frame, above the low threshold
  std::size_t asked_there = 0, asked_elsewhere = 0;  ///< places in the top-down fit
  double primed_nats_there = 0.0, primed_nats_elsewhere = 0.0;  ///< mean nats; second < 0
  bool has_primed = false;
  double box_sigma = 0.0;                                    ///< 0: too few clear boxes
  std::map<std::string, std::array<double, 4>> side_insets;  ///< insets of frequent classes
};

/// Runs the service's own node. Throws StartupError for unusable or too few data.
CalibrationResult calibrate(const CalibrateOptions& options,
                            const std::function<void(std::size_t, std::size_t)>& progress);

/// model.json with the fitted values; other keys are unchanged. box_sigma and side_insets are only
/// replaced if the file has them. Throws StartupError (78) if it is not a JSON object.
std::string withCalibration(const std::string& model_json, const CalibrationResult& result);

}  // namespace perdure::tools
