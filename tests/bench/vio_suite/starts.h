// Starts in motion: a clip is cut at random times, and vio starts there without earlier data.
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
  /// Time from the cut to the first output; −1: no output within five seconds.
  double moving_s = -1.0;
  double scale = 0.0;    ///< scale over the three seconds after the first output
  double error_m = 0.0;  ///< position error, three seconds after the first output
  NeesAt nees;           ///< errors one second after the first output
  double velocity_error = 0.0, velocity_sigma = 0.0;  ///< errors at the first output, m/s
  bool reset = false;
  /// True if the start is wrong but its covariance is small: after three seconds the error exceeds
  /// three standard deviations and a tenth of the distance travelled.
  bool wrong = false;
};

std::vector<StartRow> startsOf(const Clip& clip, const std::filesystem::path& folder,
                               const std::vector<Variant>& variants, int cuts);

}  // namespace perdure::bench
