// Starts in motion: a clip is cut at random places, and vio begins there with nothing but what
// comes after.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/bench/vio_suite/clips.h"
#include "tests/bench/vio_suite/play.h"

namespace perdure::bench {

struct StartRow {
  std::string clip, variant;
  double cut_s = 0.0;
  double moving_s = -1.0;  ///< from the cut to the first output; −1: none came in five seconds
  double scale = 0.0;      ///< of the three seconds that follow
  double error_m = 0.0;    ///< at the end of these, position
  NeesAt nees;             ///< of a second after the first output
  double velocity_error = 0.0, velocity_sigma = 0.0;  ///< at the first output, m/s
  bool reset = false;
  /// Wrong and believed: after three seconds more than three deviations and a tenth of the way off.
  bool wrong = false;
};

std::vector<StartRow> startsOf(const Clip& clip, const std::filesystem::path& folder,
                               const std::vector<Variant>& variants, int cuts);

}  // namespace perdure::bench
