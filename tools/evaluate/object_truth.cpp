#include "tools/evaluate/object_truth.h"

#include <algorithm>

#include "tools/base/quantile.h"

namespace perdure::tools {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Eigen::Vector3d median(Points::const_iterator begin, Points::const_iterator end) {
  Eigen::Vector3d result;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (auto point = begin; point != end; ++point) values.push_back((*point)(axis));
    result(axis) = quantile(std::move(values), 0.5);
  }
  return result;
}

bool standsStill(const Points& points) {
  constexpr double kDrift = 1.5, kStray = 2.0;  // metres
  const auto fifth = static_cast<std::ptrdiff_t>((points.size() + 4) / 5);
  const Eigen::Vector3d first = median(points.begin(), points.begin() + fifth);
  const Eigen::Vector3d last = median(points.end() - fifth, points.end());
  const Eigen::Vector3d middle = median(points.begin(), points.end());
  return (first - last).norm() < kDrift &&
         std::ranges::all_of(points, [&](const auto& p) { return (p - middle).norm() <= kStray; });
}

}  // namespace

std::set<std::int64_t> staticTracks(const std::vector<replay::KittiLabel>& labels,
                                    const RigidTransform& T_RI, const PosesByFrame& poses) {
  const RigidTransform T_IR = T_RI.inverse();
  std::map<std::int64_t, Points> tracks;
  for (const auto& label : labels) {
    const auto pose = poses.find(label.frame);
    if (label.dontCare() || pose == poses.end()) continue;
    tracks[label.track].push_back(pose->second * (T_IR * label.centre));
  }
  std::set<std::int64_t> result;
  for (const auto& [track, points] : tracks) {
    if (standsStill(points)) result.insert(track);
  }
  return result;
}

std::map<std::uint64_t, TruthFrame> sortTruth(const std::vector<replay::KittiLabel>& labels,
                                              const std::set<std::int64_t>& static_tracks) {
  std::map<std::uint64_t, TruthFrame> frames;
  for (const auto& label : labels) {
    TruthFrame& frame = frames[label.frame];
    if (label.dontCare()) {
      frame.dont_care.push_back(label.box);
      continue;
    }
    const bool counts = label.type == "Car" && label.occluded == 0 && label.truncated == 0 &&
                        label.box.height() >= kMinHeight_px && static_tracks.contains(label.track);
    (counts ? frame.counted : frame.ignored)
        .push_back({label.track, "", label.centre, label.rotation_y, label.box});
  }
  return frames;
}

}  // namespace perdure::tools
