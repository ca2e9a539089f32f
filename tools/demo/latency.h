// How old a frame is when its objects arrive, and how much of that is not the network's own time.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>

#include "common/types/detections.h"
#include "common/types/objects.h"

namespace perdure::tools {

/// Of one host: ages are by CLOCK_MONOTONIC of capture. A frame counts once.
class LatencyMeter {
 public:
  /// `now_ns` is when it arrived here.
  void onObjects(const Objects& objects, std::int64_t now_ns);
  void onDetections(const Detections& detections);

  double last_ms() const { return last_ms_; }
  /// {"latency_ms": {"median", "p99"}, "latency_beyond_network_ms": {…}}, from capture's handing
  /// the frame out to the objects' arrival; beyond the network's is without Detections::forward_s,
  /// over the frames whose detections say it.
  nlohmann::ordered_json report() const;

 private:
  struct Frame {
    double age_ms = -1.0;      ///< below 0: no objects yet
    double forward_ms = -1.0;  ///< below 0: not known
  };
  std::map<std::uint64_t, Frame> frames_;  ///< by sequence number
  double last_ms_ = 0.0;
};

}  // namespace perdure::tools
