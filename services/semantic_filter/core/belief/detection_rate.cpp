#include "services/semantic_filter/core/belief/detection_rate.h"

#include <algorithm>

namespace perdure::semantic_filter {

constexpr double kSameView = 0.5;  // view change below which observations share one count
constexpr std::size_t kRoom = 32;  // initial capacity, enough for most visits

void DetectionRate::addTo(Counts& counts, const Count& count, const ViewScales& scales) {
  const auto same = std::find_if(counts.begin(), counts.end(), [&](const Count& c) {
    return viewChange(c.from, count.from, scales) < kSameView;
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
  addTo(now_.write(kRoom), {from, expected, found ? 1.0 : 0.0}, scales);
}

void DetectionRate::beginVisit(const ViewScales& scales) {
  if (now_.empty()) return;
  Counts all = before_ ? *before_ : Counts{};
  for (const Count& c : now_.read()) addTo(all, c, scales);
  before_ = std::make_shared<const Counts>(std::move(all));
  now_.clear();
}

double DetectionRate::factor(const ViewRay& from, double prior, const ViewScales& scales) const {
  if (!before_) return 1.0;
  double expected = prior, found = prior;
  for (const Count& c : *before_) {
    const double weight = viewCorrelation(c.from, from, scales);
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
  for (const Count& c : other.now_.read()) addTo(now_.write(), c, scales);
}

}  // namespace perdure::semantic_filter
