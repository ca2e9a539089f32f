#include "tools/demo/latency.h"

#include <cmath>
#include <vector>

#include "tools/outputs/stage_timer.h"

namespace perdure::tools {
namespace {

nlohmann::ordered_json quantilesOf(const std::vector<double>& values) {
  const auto rounded = [&](double q) { return std::round(1000.0 * quantile(values, q)) / 1000.0; };
  return {{"median", rounded(0.5)}, {"p99", rounded(0.99)}};
}

}  // namespace

void LatencyMeter::onObjects(const Objects& objects, std::int64_t now_ns) {
  Frame& frame = frames_[objects.stamp.sequence];
  if (frame.age_ms >= 0.0) return;
  frame.age_ms = static_cast<double>(now_ns - objects.stamp.captured_ns) * 1e-6;
  last_ms_ = frame.age_ms;
}

void LatencyMeter::onDetections(const Detections& detections) {
  if (!(detections.forward_s > 0.0)) return;
  Frame& frame = frames_[detections.stamp.sequence];
  if (frame.forward_ms < 0.0) frame.forward_ms = 1e3 * detections.forward_s;
}

nlohmann::ordered_json LatencyMeter::report() const {
  std::vector<double> whole, beyond;
  for (const auto& [sequence, frame] : frames_) {
    if (frame.age_ms < 0.0) continue;
    whole.push_back(frame.age_ms);
    if (frame.forward_ms >= 0.0) beyond.push_back(frame.age_ms - frame.forward_ms);
  }
  return {{"latency_ms", quantilesOf(whole)}, {"latency_beyond_network_ms", quantilesOf(beyond)}};
}

}  // namespace perdure::tools
