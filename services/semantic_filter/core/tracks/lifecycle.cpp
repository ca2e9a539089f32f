#include "services/semantic_filter/core/tracks/lifecycle.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"

namespace perdure::semantic_filter {

namespace {

/// Detected a few times and then no more, where nothing can be asked of it: what nobody was told
/// of, and what is mostly not there, is not kept for it to come back.
bool forgettable(const Object& o, const TendParameters& parameters) {
  if (o.once_confirmed || o.hits > static_cast<std::uint32_t>(parameters.confirm_hits))
    return false;
  const TimePoint last = std::max(o.hidden.last, o.away.last);
  const bool unasked = o.hidden.count + o.away.count > 0;
  return unasked && toSeconds(last - o.last_seen) > parameters.tentative_s;
}

}  // namespace

bool established(const Object& object, const FrameContext& frame) {
  const TendParameters& tend = frame.parameters->tend;
  return object.existence >= tend.confirm && object.hits >= tend.confirm_hits &&
         placeSigma(object.best(), frame.pose_error.covariance) < tend.confirm_sigma_m;
}

std::vector<Object> confirmAndBury(std::vector<Object>& objects, const FrameContext& frame) {
  const TendParameters& parameters = frame.parameters->tend;
  for (auto& o : objects) {
    if (o.visible_fraction <= 0.0) continue;
    const double sigma = placeSigma(o, frame.pose_error.covariance);
    if (o.existence < 0.5 || sigma > 2.0 * parameters.confirm_sigma_m) {
      o.confirmed = false;
      continue;
    }
    if (established(o, frame) && sigma < parameters.confirm_sigma_m) {
      o.confirmed = o.once_confirmed = true;
    }
  }
  std::vector<Object> buried;
  std::erase_if(objects, [&](Object& o) {
    if (forgettable(o, parameters)) return true;
    if (o.existence >= (o.hits > 1 ? parameters.gone : parameters.gone_tentative)) return false;
    buried.push_back(std::move(o));
    return true;
  });
  const auto limit = static_cast<std::size_t>(parameters.max_objects);
  if (objects.size() <= limit) return buried;
  std::stable_sort(objects.begin(), objects.end(),
                   [](const auto& a, const auto& b) { return a.existence > b.existence; });
  objects.resize(limit);
  return buried;
}

}  // namespace perdure::semantic_filter
