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
  inference::Config inference;  ///< network, threshold, merging: as in the service
  std::vector<LabelRequest> data;
  bool primed_only = false;     ///< do not change temperature, bias and clutter rate
  double primed_floor = 0.002;  ///< least score of a candidate at a predicted measurement
};

struct CalibrationResult {
  inference::Calibration before, fitted;
  Reliability reliability_before;  ///< reliability of all boxes, with the given model.json
  Reliability reliability_after;   ///< reliability of all boxes, each calibrated on other frames
  std::size_t frames = 0, boxes = 0, targets = 0, targets_found = 0;
  double false_boxes = 0.0;                          ///< mean number per frame, above the threshold
  std::size_t asked_there = 0, asked_elsewhere = 0;  ///< number of places in the fit
  double primed_nats_there = 0.0, primed_nats_elsewhere = 0.0;  ///< mean nats; second below 0
  bool has_primed = false;
  double box_sigma = 0.0;                                    ///< 0: too few clear boxes
  std::map<std::string, std::array<double, 4>> side_insets;  ///< insets of frequent classes
};

/// Fits a calibration, with the outputs of the service's own node. Throws StartupError if the data
/// are unusable or too few.
CalibrationResult calibrate(const CalibrateOptions& options,
                            const std::function<void(std::size_t, std::size_t)>& progress);

/// Returns model.json with the fitted values. Other keys are unchanged; box_sigma and side_insets
/// are replaced only if the file has them. Throws StartupError (78) if `model_json` is not a JSON
/// object.
std::string withCalibration(const std::string& model_json, const CalibrationResult& result);

}  // namespace perdure::tools
