#include "tools/evaluate/object_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/so3.h"
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

std::optional<Estimate> toCamera(const EstimateRow& row, const RigidTransform& T_RW,
                                 const replay::KittiCalibration& calibration) {
  constexpr double kClosest = 0.1;  // metres before the camera, for corners behind it
  const auto project = [&](const Eigen::Vector3d& point) -> Eigen::Vector2d {
    const Eigen::Vector3d front(point.x(), point.y(), std::max(point.z(), kClosest));
    const Eigen::Vector3d pixel = calibration.P2 * front.homogeneous();
    return pixel.head<2>() / pixel.z();
  };
  const double width = calibration.width, height = calibration.height;
  Estimate estimate;
  estimate.id = row.id;
  estimate.class_name = row.class_name;
  estimate.centre = T_RW * row.centre_W;
  if (estimate.centre.z() < kClosest) return std::nullopt;
  const Eigen::Vector2d centre = project(estimate.centre);
  if (centre.x() < 0 || centre.y() < 0 || centre.x() >= width || centre.y() >= height) {
    return std::nullopt;
  }
  const Eigen::Vector3d forward = T_RW.q * Eigen::Vector3d(std::cos(row.yaw), std::sin(row.yaw), 0);
  estimate.heading = std::atan2(-forward.z(), forward.x());
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Box box{kInfinity, kInfinity, -kInfinity, -kInfinity};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d half(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5,
                               corner & 4 ? 0.5 : -0.5);
    const Eigen::Vector3d size(row.length, row.width, row.height);
    const Eigen::Vector3d offset = rotationAboutZ(row.yaw) * half.cwiseProduct(size);
    const Eigen::Vector2d pixel = project(T_RW * (row.centre_W + offset));
    box.x1 = std::min(box.x1, pixel.x()), box.x2 = std::max(box.x2, pixel.x());
    box.y1 = std::min(box.y1, pixel.y()), box.y2 = std::max(box.y2, pixel.y());
  }
  estimate.box = Box{std::clamp(box.x1, 0.0, width), std::clamp(box.y1, 0.0, height),
                     std::clamp(box.x2, 0.0, width), std::clamp(box.y2, 0.0, height)};
  return estimate;
}

ObjectScore scoreObjects(const std::vector<EstimateRow>& rows,
                         const std::map<std::uint64_t, TruthFrame>& truth,
                         const PosesByFrame& poses, const replay::KittiCalibration& calibration,
                         const ScoreOptions& options) {
  std::map<std::uint64_t, ScoredFrame> frames;
  std::uint64_t outside = 0;
  for (const auto& [frame, labels] : truth) frames[frame].truth = labels;
  for (const auto& row : rows) {
    const auto pose = poses.find(row.frame);
    std::optional<Estimate> estimate;
    if (pose != poses.end()) {
      estimate = toCamera(row, calibration.T_RI * pose->second.inverse(), calibration);
    }
    if (estimate)
      frames[row.frame].estimates.push_back(*estimate);
    else
      ++outside;
  }
  ObjectScore score = scoreFrames(frames, options);
  score.outside = outside;
  return score;
}

}  // namespace perdure::tools
