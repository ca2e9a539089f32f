#include "tools/data_check/image_turn.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "common/base/algorithms/median.h"

namespace perdure::tools {
namespace {

constexpr std::size_t kFewestCorners = 15;

Eigen::Matrix3d crossOf(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

constexpr double kLeastScale = 1e-5, kLeastStep = 1e-6;  // rad

/// A rotation, the direction of translation, and the median error of the predicted flow.
struct Motion {
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero(), way = Eigen::Vector3d::UnitX();
  double error = 0.0;  ///< median, rad
};

/// Solves step = ray × rotation by robust least squares over all points.
Motion withoutWay(const std::vector<Flow>& flow) {
  Motion motion;
  double scale = 1.0;  // the first round is ordinary least squares
  for (int round = 0; round < 8; ++round) {
    Eigen::Matrix3d A = 1e-12 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    std::vector<double> errors;
    for (const Flow& one : flow) {
      const Eigen::Matrix3d X = crossOf(one.ray);
      const double error = (one.step - X * motion.rotation).norm() / scale;
      const double weight = round == 0 ? 1.0 : 1.0 / (1.0 + error * error);
      A += weight * X.transpose() * X;
      b += weight * X.transpose() * one.step;
    }
    motion.rotation = A.ldlt().solve(b);
    for (const Flow& one : flow) {
      errors.push_back((one.step - one.ray.cross(motion.rotation)).norm());
    }
    motion.error = medianOf(std::move(errors));
    scale = std::max(kLeastScale, motion.error);
  }
  return motion;
}

/// Distance of a point's flow from its epipolar line, and its derivatives.
struct Off {
  double value;
  Eigen::Vector3d by_rotation, by_way;
};

Off offOf(const Flow& one, const Motion& motion) {
  // A point near the focus of expansion has no epipolar line; its weight tends to zero.
  constexpr double kNear = 0.05;
  const Eigen::Vector3d left = one.step - one.ray.cross(motion.rotation);
  const Eigen::Vector3d normal = motion.way.cross(one.ray);
  const double length = std::sqrt(normal.squaredNorm() + kNear * kNear);
  return {normal.dot(left) / length, -normal.cross(one.ray) / length, one.ray.cross(left) / length};
}

/// Estimates rotation and translation from `start` by Gauss-Newton with robust weights.
Motion withWay(const std::vector<Flow>& flow, const Motion& start) {
  Motion motion = start;
  motion.way.normalize();
  for (int round = 0; round < 12; ++round) {
    std::vector<double> errors;
    for (const Flow& one : flow) errors.push_back(std::abs(offOf(one, motion).value));
    motion.error = medianOf(std::move(errors));
    const double scale = std::max(kLeastScale, 1.5 * motion.error);
    Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero(), row;
    for (const Flow& one : flow) {
      const Off off = offOf(one, motion);
      const double weight = 1.0 / (1.0 + off.value * off.value / (scale * scale));
      row << off.by_rotation, off.by_way;
      A += weight * row * row.transpose();
      b -= weight * off.value * row;
    }
    A.bottomRightCorner<3, 3>() += A.trace() * motion.way * motion.way.transpose();
    A.diagonal().array() += 1e-4 * A.diagonal().mean() + 1e-12;
    const Eigen::Matrix<double, 6, 1> step = A.ldlt().solve(b);
    motion.rotation += step.head<3>();
    motion.way = (motion.way + step.tail<3>()).normalized();
    if (step.norm() < kLeastStep) break;
  }
  return motion;
}

const cv::Size kWindow(15, 15);
constexpr int kLevels = 4;

}  // namespace

FollowedImage::FollowedImage(const cv::Mat& grey) : image(grey) {
  if (!grey.empty()) cv::buildOpticalFlowPyramid(grey, pyramid, kWindow, kLevels);
}

std::vector<cv::Point2f> cornersOf(const FollowedImage& image) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(image.image, corners, 150, 0.01, 0.02 * image.image.cols + 2.0);
  return corners;
}

std::vector<std::optional<cv::Point2f>> follow(const FollowedImage& first,
                                               const FollowedImage& second,
                                               const std::vector<cv::Point2f>& from) {
  std::vector<std::optional<cv::Point2f>> followed(from.size());
  if (from.empty()) return followed;
  std::vector<cv::Point2f> to, back;
  std::vector<uchar> found, found_back;
  std::vector<float> error;
  const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 0.03);
  cv::calcOpticalFlowPyrLK(first.pyramid, second.pyramid, from, to, found, error, kWindow, kLevels,
                           until);
  // Rejects points that backward tracking does not return to their origin.
  cv::calcOpticalFlowPyrLK(second.pyramid, first.pyramid, to, back, found_back, error, kWindow,
                           kLevels, until);
  constexpr double kBack_px = 1.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const bool good = found[i] != 0 && found_back[i] != 0;
    if (good && cv::norm(back[i] - from[i]) <= kBack_px) followed[i] = to[i];
  }
  return followed;
}

std::vector<Flow> flowBetween(const CameraModel& camera, const FollowedImage& first,
                              const FollowedImage& second) {
  const auto from = cornersOf(first);
  if (from.size() < kFewestCorners) return {};
  const auto followed = follow(first, second, from);
  std::vector<Flow> flow;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!followed[i]) continue;
    const auto a = camera.unproject({from[i].x, from[i].y});
    const auto b = camera.unproject({followed[i]->x, followed[i]->y});
    if (!a || !b) continue;
    const Eigen::Vector3d ray = a->homogeneous().normalized();
    flow.push_back({ray, b->homogeneous().normalized() - ray});
  }
  if (flow.size() < kFewestCorners) return {};
  return flow;
}

Eigen::Vector3d rotationOf(const std::vector<Flow>& flow) {
  const Motion plain = withoutWay(flow);
  Motion best = plain;
  constexpr double kApart = 2.0;  // least ratio of errors at which the translation is significant
  best.error = plain.error / kApart;
  constexpr std::array<std::array<double, 3>, 7> kWays{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {-1, 1, 1}, {1, -1, 1}, {1, 1, -1}}};
  for (const auto& way : kWays) {
    Motion start = plain;
    start.way = Eigen::Vector3d(way[0], way[1], way[2]);
    const Motion motion = withWay(flow, start);
    if (motion.error < best.error) best = motion;
  }
  return best.rotation;
}

}  // namespace perdure::tools
