// Selects the input size of the network that keeps a frame within a time budget. It decreases at
// once, and increases only after many frames below the budget, to avoid oscillation.
#pragma once

#include <cstddef>
#include <vector>

namespace perdure::inference {

class Budget {
 public:
  static constexpr std::size_t kSlow = 5;    ///< frames whose median must exceed the budget
  static constexpr std::size_t kQuick = 30;  ///< frames whose median must be below the budget
  static constexpr double kRoom = 0.8;       ///< share of the budget that a larger size may take

  /// `shares`: pixels of each size relative to the first one, falling from 1. The time of a frame
  /// is proportional to them. `budget_ms` 0: always the first size.
  Budget(double budget_ms, std::vector<double> shares);

  std::size_t size() const { return size_; }
  /// Adds the time of a frame at the current size. Returns whether the size has changed.
  bool took(double ms);

 private:
  bool shrink(double median_ms);
  bool grow(double median_ms);
  double expected(double median_ms, std::size_t size) const {
    return median_ms * shares_[size] / shares_[size_];
  }

  double budget_ms_;
  std::vector<double> shares_;
  std::size_t size_ = 0;
  std::vector<double> times_;  ///< times of the last frames at this size, at most kQuick
};

}  // namespace perdure::inference
