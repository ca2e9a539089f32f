// Plays a clip through vio under several settings at once; each image is decoded once.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/replay/dataset.h"
#include "services/vio/config.h"
#include "tests/bench/vio_suite/score.h"

namespace perdure::bench {

struct Variant {
  std::string name;
  vio::Config config;
};

struct Outcome {
  Accuracy accuracy;
  double first_s = 0.0;                   ///< time from the first frame to the first usable output
  double ms = 0.0, ms_p99 = 0.0;          ///< CPU time of this thread per frame, without decoding
  double klt_ms = 0.0, klt_ms_p99 = 0.0;  ///< OpenCV's Lucas-Kanade with 200 points; 0: not
                                          ///< measured
  Innovations innovations;                ///< filled only on request
  std::size_t frames = 0, resets = 0;
  double readout_s = 0.0;  ///< vio's final estimate for the first camera
  std::map<std::string, std::uint64_t> reasons;
};

struct PlayOptions {
  double from_s = 0.0, until_s = 1e9;  ///< limits in the clip's time
  bool klt = true, innovations = false;
  std::optional<double> readout_s = {};  ///< overrides the read-out time in the cameras'
                                         ///< calibration
};

/// Returns the outcomes in the order of `variants`. `progress` receives the share of the clip that
/// is done.
std::vector<Outcome> play(const std::filesystem::path& folder, const std::vector<Variant>& variants,
                          const PlayOptions& options, const std::function<void(double)>& progress);

/// Reads gt_tum.txt of the folder, or the dataset's own truth.
replay::PoseFile truthOf(const std::filesystem::path& folder, const replay::Dataset& dataset);

}  // namespace perdure::bench
