// Measures the age of a frame when its objects arrive, with and without inference.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>

#include "common/types/detections.h"
#include "common/types/objects.h"

namespace perdure::tools {

/// Works on one host only, because ages use the CLOCK_MONOTONIC of capture. Counts each frame once.
class LatencyMeter {
 public:
  /// `now_ns`: time of arrival at this process.
  void onObjects(const Objects& objects, std::int64_t now_ns);
  void onDetections(const Detections& detections);

  double last_ms() const { return last_ms_; }
  /// {"latency_ms": {"median", "p99"}, "latency_beyond_network_ms": {…}}: from capture to the
  /// arrival of objects; the second without Detections::forward_s.
  nlohmann::ordered_json report() const;

 private:
  struct Frame {
    double age_ms = -1.0;      ///< below 0: no objects yet
    double forward_ms = -1.0;  ///< below 0: unknown
  };
  std::map<std::uint64_t, Frame> frames_;  ///< key: sequence number
  double last_ms_ = 0.0;
};

}  // namespace perdure::tools
