#include "common/mapping/frames/sight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "common/camera/camera_model.h"
#include "common/mapping/frames/level_pose.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

double azimuthOf(const Eigen::Vector3d& direction) {
  return std::atan2(direction.y(), direction.x());
}

/// Returns the range of azimuths of nine points of the image, in the axes of A.
std::optional<Sight> sightOf(const CameraModel& camera, const Eigen::Matrix3d& R_AC) {
  const double axis = azimuthOf(R_AC.col(2));
  double least = std::numbers::pi, most = -std::numbers::pi;
  for (const double x : {0.0, 0.5, 1.0}) {
    for (const double y : {0.0, 0.5, 1.0}) {
      const auto ray = camera.unproject({x * (camera.width() - 1), y * (camera.height() - 1)});
      if (!ray) continue;
      const double off = wrapAngle(azimuthOf(R_AC * ray->homogeneous()) - axis);
      least = std::min(least, off);
      most = std::max(most, off);
    }
  }
  if (most <= least) return std::nullopt;
  return Sight{wrapAngle(axis + 0.5 * (least + most)), 0.5 * (most - least)};
}

}  // namespace

std::vector<Sight> sightsOf(const Calibration& calibration, const RigidTransform& T_WB,
                            const Eigen::Vector3d& up_W) {
  const Eigen::Matrix3d R_AB = levelled(T_WB, up_W).R().transpose() * T_WB.R();
  std::vector<Sight> sights;
  for (const CameraCalibration& each : calibration.cameras) {
    const CameraModel camera(each);
    if (const auto sight = sightOf(camera, R_AB * camera.T_BC().R())) sights.push_back(*sight);
  }
  return sights;
}

std::string toText(const std::vector<Sight>& sights) {
  std::string text;
  for (const Sight& s : sights) text += fmt::format("{:.6f} {:.6f} ", s.azimuth, s.half_width);
  return text;
}

std::vector<Sight> sightsFrom(const std::string& text) {
  std::istringstream numbers(text);
  std::vector<Sight> sights;
  Sight sight;
  while (numbers >> sight.azimuth >> sight.half_width && sight.half_width > 0.0) {
    sights.push_back(sight);
  }
  return sights;
}

}  // namespace perdure::mapping
