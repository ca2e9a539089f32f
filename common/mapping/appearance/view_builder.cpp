#include "common/mapping/appearance/view_builder.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace perdure::mapping {
namespace {

constexpr double kKept_m = 40.0;         // a landmark is removed after this distance travelled
constexpr double kRelative = 0.1;        // largest error of a point relative to its distance
constexpr double kFarthest_m = 60;       // largest distance from the body
constexpr std::size_t kMostKept = 2000;  // largest number of landmarks, also for a body at rest

}  // namespace

void ViewBuilder::add(const Landmarks& landmarks, const Eigen::Vector3d& p_WB, double way_m) {
  for (const Landmark& landmark : landmarks.landmarks) {
    if (landmark.descriptor == Descriptor{}) continue;
    const double distance = (landmark.p_W - p_WB).norm();
    const double sigma = std::sqrt(landmark.covariance.trace() / 3.0);
    if (!(distance < kFarthest_m) || !(sigma < kRelative * distance)) continue;
    seen_[landmark.id] = {landmark.p_W, sigma, sigma / distance, way_m, landmark.descriptor};
  }
  std::erase_if(seen_, [&](const auto& each) { return way_m - each.second.way_m > kKept_m; });
  while (seen_.size() > kMostKept) seen_.erase(seen_.begin());  // ids increase with time
}

View ViewBuilder::viewFrom(const RigidTransform& T_WA, double way_m, double back_m) const {
  std::vector<const Seen*> recent;
  for (const auto& [id, seen] : seen_) {
    if (way_m - seen.way_m <= back_m) recent.push_back(&seen);
  }
  std::stable_sort(recent.begin(), recent.end(),
                   [](const Seen* a, const Seen* b) { return a->relative < b->relative; });
  if (recent.size() > kMostPoints) recent.resize(kMostPoints);
  const RigidTransform T_AW = T_WA.inverse();
  View view;
  for (const Seen* seen : recent) {
    view.push_back(
        {(T_AW * seen->p_W).cast<float>(), static_cast<float>(seen->sigma), seen->descriptor});
  }
  return view;
}

}  // namespace perdure::mapping
