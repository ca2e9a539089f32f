#include "services/inference/core/budget.h"

#include <algorithm>

#include "common/base/check.h"

namespace perdure::inference {
namespace {

double medianOfLast(const std::vector<double>& values, std::size_t count) {
  std::vector<double> last(values.end() - static_cast<std::ptrdiff_t>(count), values.end());
  const auto middle = last.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(last.begin(), middle, last.end());
  return *middle;
}

}  // namespace

Budget::Budget(double budget_ms, std::vector<double> shares)
    : budget_ms_(budget_ms), shares_(std::move(shares)) {
  check(!shares_.empty(), "there is at least one size");
}

bool Budget::took(double ms) {
  if (budget_ms_ <= 0.0) return false;
  if (times_.size() == kQuick) times_.erase(times_.begin());
  times_.push_back(ms);
  bool changed = false;
  if (times_.size() >= kSlow) changed = shrink(medianOfLast(times_, kSlow));
  if (!changed && times_.size() == kQuick) changed = grow(medianOfLast(times_, kQuick));
  if (changed) times_.clear();
  return changed;
}

bool Budget::shrink(double median_ms) {
  if (median_ms <= budget_ms_ || size_ + 1 == shares_.size()) return false;
  std::size_t next = size_ + 1;
  while (next + 1 < shares_.size() && expected(median_ms, next) > kRoom * budget_ms_) ++next;
  size_ = next;
  return true;
}

bool Budget::grow(double median_ms) {
  if (size_ == 0 || expected(median_ms, size_ - 1) > kRoom * budget_ms_) return false;
  --size_;
  return true;
}

}  // namespace perdure::inference
