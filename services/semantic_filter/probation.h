// Delayed detections of a new inference process that misses everything (README, roll-backs).
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "common/types/detections.h"

namespace perdure::semantic_filter {

class Probation {
 public:
  /// Most delayed frames. The old process decides within fewer; the history can repeat more.
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

}  // namespace perdure::semantic_filter
