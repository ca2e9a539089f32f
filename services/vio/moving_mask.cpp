#include "services/vio/moving_mask.h"

#include <algorithm>
#include <optional>

#include "common/math/so3.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

constexpr double kNear = 0.2;    // m: edges are clipped at this depth
constexpr float kMargin = 4.0F;  // px; a point's patch extends beyond it

/// Returns the bounding box, in px, of a cuboid with the centre p_C and the half axes `axes`
/// (columns, in C).
std::optional<cv::Rect2f> boundingBox(const CameraModel& camera, const Vector3d& p_C,
                                      const Eigen::Matrix3d& axes) {
  std::vector<Vector3d> seen;
  const auto corner = [&](int i) {
    return Vector3d(p_C +
                    axes * Vector3d(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0));
  };
  for (int i = 0; i < 8; ++i) {
    const Vector3d a = corner(i);
    if (a.z() >= kNear) seen.push_back(a);
    for (const int axis : {1, 2, 4}) {
      if (i & axis) continue;
      const Vector3d b = corner(i | axis);
      if ((a.z() < kNear) == (b.z() < kNear)) continue;
      seen.emplace_back(a + (kNear - a.z()) / (b.z() - a.z()) * (b - a));
    }
  }
  if (seen.empty()) return std::nullopt;
  const auto width = static_cast<float>(camera.calibration().width);
  const auto height = static_cast<float>(camera.calibration().height);
  float x1 = width, y1 = height, x2 = 0, y2 = 0;
  for (const Vector3d& p : seen) {
    // Directions are limited, because lens models are not monotonic far outside the image.
    Vector3d bounded = p / p.z();
    bounded.head<2>() = bounded.head<2>().cwiseMax(-1.5).cwiseMin(1.5);
    const auto pixel = camera.project(bounded);
    if (!pixel) continue;
    x1 = std::min(x1, static_cast<float>(pixel->x())),
    x2 = std::max(x2, static_cast<float>(pixel->x()));
    y1 = std::min(y1, static_cast<float>(pixel->y())),
    y2 = std::max(y2, static_cast<float>(pixel->y()));
  }
  const cv::Rect2f box =
      cv::Rect2f(x1 - kMargin, y1 - kMargin, x2 - x1 + 2 * kMargin, y2 - y1 + 2 * kMargin) &
      cv::Rect2f(0, 0, width, height);
  if (x2 <= x1 || box.area() <= 0) return std::nullopt;
  return box;
}

}  // namespace

void MovingMask::onObjects(const Objects& objects) {
  if (!options_.enabled) return;
  world_ = objects.world;
  time_ = objects.stamp.time;
  up_W_ = objects.up_W;
  moving_.clear();
  for (const ObjectBelief& o : objects.objects) {
    if (o.moving >= options_.probability && o.existence >= options_.probability) {
      moving_.push_back(o);
    }
  }
}

std::vector<cv::Rect2f> MovingMask::boxes(const CameraModel& camera, const WorldId& world,
                                          const RigidTransform& T_WB, TimePoint now) const {
  std::vector<cv::Rect2f> result;
  const double age = toSeconds(now - time_);
  if (moving_.empty() || world != world_ || age < 0.0 || age > options_.longest_s) return result;
  const RigidTransform T_CW = (T_WB * camera.T_BC()).inverse();
  const Eigen::Matrix3d R_WU = levelling(up_W_).toRotationMatrix().transpose();
  for (const ObjectBelief& o : moving_) {
    const Vector7d& x = o.best().mean;
    const Vector3d p_W = x.head<3>() + age * o.velocity;
    const Eigen::Matrix3d R_CO = T_CW.R() * R_WU * rotationAboutZ(x[3]);
    const Vector3d half = 0.5 * x.tail<3>().array().exp();
    if (const auto box = boundingBox(camera, T_CW * p_W, R_CO * half.asDiagonal())) {
      result.push_back(*box);
    }
  }
  return result;
}

}  // namespace perdure::vio
