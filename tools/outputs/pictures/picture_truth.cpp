#include "tools/outputs/pictures/picture_truth.h"

#include <algorithm>

#include "common/math/so3.h"

namespace perdure::tools {

std::optional<TruthTrack::Key> TruthTrack::at(TimePoint time) const {
  if (time < present_from || time >= present_until) return std::nullopt;
  const auto after = std::ranges::find_if(keys, [time](const Key& key) { return key.time > time; });
  if (!moves) return after == keys.begin() ? keys.front() : *(after - 1);
  if (after == keys.begin()) return std::nullopt;
  const Key& before = *(after - 1);
  if (before.time == time) return before;
  if (after == keys.end()) return std::nullopt;
  const double s = toSeconds(time - before.time) / toSeconds(after->time - before.time);
  return Key{time, before.centre_W + s * (after->centre_W - before.centre_W),
             wrapAngle(before.yaw + s * wrapAngle(after->yaw - before.yaw))};
}

PictureTruth turned(const RigidTransform& T_AB, PictureTruth truth) {
  const double turn = yawOf(T_AB.R());
  for (auto& [frame, p] : truth.path) p = T_AB * p;
  for (TruthTrack& track : truth.objects) {
    for (TruthTrack::Key& key : track.keys) {
      key.centre_W = T_AB * key.centre_W;
      key.yaw = wrapAngle(key.yaw + turn);
    }
  }
  return truth;
}

}  // namespace perdure::tools
