#include "services/semantic_filter/core/belief/detection_rate.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {
namespace {

constexpr double kSameView = 0.5;  // view change below which observations share one count

template <class Count>
double change(const Count& a, const Count& b, const ViewScales& scales) {
  return (a.ray_W - b.ray_W).norm() / scales.angle +
         std::abs(a.log_distance - b.log_distance) / scales.log_distance;
}

}  // namespace

void DetectionRate::addTo(Counts& counts, const Count& count, const ViewScales& scales) {
  const auto same = std::find_if(counts.begin(), counts.end(), [&](const Count& c) {
    return change(c, count, scales) < kSameView;
  });
  if (same != counts.end()) {
    same->expected += count.expected;
    same->found += count.found;
    return;
  }
  if (counts.size() == kMostViews) counts.erase(counts.begin());  // remove the oldest
  counts.push_back(count);
}

void DetectionRate::add(const ViewRay& from, double expected, bool found,
                        const ViewScales& scales) {
  const Count count{from.ray_W.cast<float>(), static_cast<float>(from.log_distance),
                    static_cast<float>(expected), found ? 1.0F : 0.0F};
  addTo(now_, count, scales);
}

void DetectionRate::beginVisit(const ViewScales& scales) {
  if (now_.empty()) return;
  Counts all = before_ ? *before_ : Counts{};
  for (const Count& c : now_) addTo(all, c, scales);
  before_ = std::make_shared<const Counts>(std::move(all));
  now_.clear();
}

double DetectionRate::factor(const ViewRay& from, double prior, const ViewScales& scales) const {
  if (!before_) return 1.0;
  const Count here{from.ray_W.cast<float>(), static_cast<float>(from.log_distance)};
  double expected = prior, found = prior;
  for (const Count& c : *before_) {
    const double weight = std::exp(-change(c, here, scales));
    expected += weight * c.expected;
    found += weight * c.found;
  }
  return found / expected;
}

void DetectionRate::join(const DetectionRate& other, const ViewScales& scales) {
  if (other.before_) {
    Counts all = before_ ? *before_ : Counts{};
    for (const Count& c : *other.before_) addTo(all, c, scales);
    before_ = std::make_shared<const Counts>(std::move(all));
  }
  for (const Count& c : other.now_) addTo(now_, c, scales);
}

}  // namespace perdure::semantic_filter
