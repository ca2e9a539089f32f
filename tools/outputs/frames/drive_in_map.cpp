#include "tools/outputs/frames/drive_in_map.h"

#include <algorithm>

namespace perdure::tools {
namespace {

using Along = std::vector<std::pair<TimePoint, RigidTransform>>;

Along::const_iterator firstAfter(const Along& along, TimePoint time) {
  return std::ranges::upper_bound(along, time, {}, &Along::value_type::first);
}

}  // namespace

RigidTransform DriveInMap::T_MB(const replay::StampedPose& pose) const {
  const auto next = firstAfter(along, pose.time);
  if (next == along.begin() || next == along.end()) return T_MW(pose.time) * pose.T_WB;
  // Interpolates the corrected poses and not T_MW, because the origin of W may be far away.
  const auto& [t0, from] = *std::prev(next);
  const auto& [t1, to] = *next;
  const double s = toSeconds(pose.time - t0) / toSeconds(t1 - t0);
  return interpolate(from * pose.T_WB, to * pose.T_WB, s);
}

RigidTransform DriveInMap::T_MW(TimePoint time) const {
  if (along.empty()) return {};
  const auto next = firstAfter(along, time);
  return next == along.begin() ? next->second : std::prev(next)->second;
}

RigidTransform DriveInMap::T_MW_begin() const {
  return along.empty() ? RigidTransform() : along.front().second;
}

}  // namespace perdure::tools
