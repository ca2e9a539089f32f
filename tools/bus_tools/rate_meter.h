// The rate of a topic's messages over a window of arrivals.
#pragma once

#include <cstddef>
#include <deque>

namespace perdure::tools {

struct RateSummary {
  std::size_t messages = 0;                               ///< messages in the window
  double rate_hz = 0;                                     ///< 0 if the window has fewer than two
                                                          ///< messages
  double shortest_s = 0, longest_s = 0, deviation_s = 0;  ///< statistics of the intervals
};

class RateMeter {
 public:
  explicit RateMeter(double window_s = 10.0) : window_s_(window_s) {}
  /// Adds the arrival of a message at `time_s`, which must not decrease.
  void arrived(double time_s);
  RateSummary summary(double now_s);

 private:
  void forget(double now_s);

  double window_s_;
  std::deque<double> arrivals_;
};

}  // namespace perdure::tools
