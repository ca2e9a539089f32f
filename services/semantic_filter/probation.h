// Detections of a newcomer among inference processes that are kept back: where it sees nothing of
// what is known to be in visibility, either it is blind or the things are gone, and the process
// that it follows will soon say which (services/inference/README.md, roll-backs).
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/types/detections.h"
#include "common/types/objects.h"

namespace perdure::semantic_filter {

class Probation {
 public:
  /// Frames that are kept back at most; the old process judges after fewer, and a step can be
  /// repeated for more (history.frames).
  static constexpr std::size_t kLongest = 24;

  void begin(InstanceId newcomer) { newcomer_ = newcomer; }
  void end() { newcomer_ = 0; }
  bool isOf(InstanceId instance) const { return newcomer_ != 0 && instance == newcomer_; }

  void keep(const Detections& detections) { kept_.push_back(detections); }
  bool full() const { return kept_.size() >= kLongest; }
  std::vector<Detections> take() { return std::exchange(kept_, {}); }

 private:
  InstanceId newcomer_ = 0;
  std::vector<Detections> kept_;
};

/// One of them at least is likely to be seen, and no detection lies at any of the likely ones.
bool missesAll(const std::vector<Prediction>& expected, const Detections& detections);

}  // namespace perdure::semantic_filter
