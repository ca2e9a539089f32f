#include "tools/evaluate/kitti_score.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/so3.h"

namespace perdure::tools {

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
