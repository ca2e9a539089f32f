#include "services/semantic_filter/core/found_rate.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {
namespace {

constexpr double kSameView = 0.5;  // change of view below which looks are counted together

}  // namespace

void FoundRate::addTo(Counts& counts, const Count& count, const ViewScales& scales) {
  const auto same = std::find_if(counts.begin(), counts.end(), [&](const Count& c) {
    return viewChange(c.from, count.from, scales) < kSameView;
  });
  if (same != counts.end()) {
    same->expected += count.expected;
    same->found += count.found;
    return;
  }
  if (counts.size() == kMostViews) counts.erase(counts.begin());  // the oldest
  counts.push_back(count);
}

void FoundRate::add(const Aspect& from, double expected, bool found, const ViewScales& scales) {
  addTo(now_, {from, static_cast<float>(expected), found ? 1.0F : 0.0F}, scales);
}

void FoundRate::beginVisit(const ViewScales& scales) {
  for (const Count& c : now_) addTo(before_, c, scales);
  now_.clear();
}

double FoundRate::factor(const Aspect& from, double prior, const ViewScales& scales) const {
  double expected = prior, found = prior;
  for (const Count& c : before_) {
    const double weight = std::exp(-viewChange(c.from, from, scales));
    expected += weight * c.expected;
    found += weight * c.found;
  }
  return found / expected;
}

void FoundRate::join(const FoundRate& other, const ViewScales& scales) {
  for (const Count& c : other.before_) addTo(before_, c, scales);
  for (const Count& c : other.now_) addTo(now_, c, scales);
}

}  // namespace perdure::semantic_filter
