#include "tools/bus_tools/rate_meter.h"

#include <algorithm>
#include <cmath>

namespace perdure::tools {

void RateMeter::arrived(double time_s) {
  arrivals_.push_back(time_s);
  forget(time_s);
}

RateSummary RateMeter::summary(double now_s) {
  forget(now_s);
  RateSummary result;
  result.messages = arrivals_.size();
  if (arrivals_.size() < 2) return result;
  const auto n = static_cast<double>(arrivals_.size() - 1);
  const double mean = (arrivals_.back() - arrivals_.front()) / n;
  double variance = 0;
  result.shortest_s = arrivals_[1] - arrivals_[0];
  for (std::size_t i = 1; i < arrivals_.size(); ++i) {
    const double interval = arrivals_[i] - arrivals_[i - 1];
    result.shortest_s = std::min(result.shortest_s, interval);
    result.longest_s = std::max(result.longest_s, interval);
    variance += (interval - mean) * (interval - mean) / n;
  }
  result.rate_hz = mean > 0 ? 1.0 / mean : 0.0;
  result.deviation_s = std::sqrt(variance);
  return result;
}

void RateMeter::forget(double now_s) {
  while (!arrivals_.empty() && now_s - arrivals_.front() > window_s_) arrivals_.pop_front();
}

}  // namespace perdure::tools
