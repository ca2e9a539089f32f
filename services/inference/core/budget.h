// Selects the network's input size that keeps the time of a frame within a budget. The size
// decreases after few slow frames, but increases only after many fast ones, to avoid oscillation.
#pragma once

#include <cstddef>
#include <vector>

namespace perdure::inference {

class Budget {
 public:
  static constexpr std::size_t kSlow = 5;    ///< frames whose median must exceed the budget
  static constexpr std::size_t kQuick = 30;  ///< frames whose median must be below the budget
  static constexpr double kRoom = 0.8;       ///< share of the budget that a new size may take

  /// `shares` are the numbers of pixels of the sizes relative to the first one, falling from 1. The
  /// time of a frame is assumed to be proportional to them. If `budget_ms` is 0, the first size is
  /// always used.
  Budget(double budget_ms, std::vector<double> shares);

  std::size_t size() const { return size_; }
  /// Adds the time of a frame at the current size. Returns true if the size changes.
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
  std::vector<double> times_;  ///< ms, of the last frames at this size, at most kQuick
};

}  // namespace perdure::inference
