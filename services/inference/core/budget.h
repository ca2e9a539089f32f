// The size of the network's input that keeps a frame within a time budget: smaller at once where
// frames take too long, larger only after many that leave room, so that it does not swing.
#pragma once

#include <cstddef>
#include <vector>

namespace perdure::inference {

class Budget {
 public:
  static constexpr std::size_t kSlow = 5;    ///< frames whose median must be too long
  static constexpr std::size_t kQuick = 30;  ///< frames whose median must leave room
  static constexpr double kRoom = 0.8;       ///< share of the budget that a larger size may take

  /// `shares`: pixels of each size over those of the first one, falling from 1; the time of a frame
  /// goes with them. `budget_ms` 0: always the first size.
  Budget(double budget_ms, std::vector<double> shares);

  /// The size to look with.
  std::size_t size() const { return size_; }
  /// A frame took so long with it; whether the size is another one now.
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
  std::vector<double> times_;  ///< of the last frames at this size, at most kQuick
};

}  // namespace perdure::inference
