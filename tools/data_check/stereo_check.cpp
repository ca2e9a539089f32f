#include "tools/data_check/stereo_check.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "common/camera/camera_model.h"

namespace perdure::tools {
namespace {

using Eigen::Vector3d;
using replay::DataFinding;
using replay::Recording;

constexpr std::size_t kPairs = 8, kFewestMatches = 60;

struct Match {
  Vector3d first, second;  ///< unit rays in C0 and C1
};

/// Corners of the first image that are found in the second one, and from there where they were.
void addMatches(const CameraModel& first, const CameraModel& second, const cv::Mat& image_0,
                const cv::Mat& image_1, std::vector<Match>& matches) {
  std::vector<cv::Point2f> from, to, back;
  cv::goodFeaturesToTrack(image_0, from, 150, 0.01, 0.02 * image_0.cols + 2.0);
  if (from.empty()) return;
  std::vector<uchar> found, found_back;
  std::vector<float> error;
  const cv::Size window(21, 21);
  cv::calcOpticalFlowPyrLK(image_0, image_1, from, to, found, error, window, 4);
  cv::calcOpticalFlowPyrLK(image_1, image_0, to, back, found_back, error, window, 4);
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (found[i] == 0 || found_back[i] == 0 || cv::norm(back[i] - from[i]) > 0.5) continue;
    const auto a = first.unproject({from[i].x, from[i].y});
    const auto b = second.unproject({to[i].x, to[i].y});
    if (!a || !b) continue;
    matches.push_back({a->homogeneous().normalized(), b->homogeneous().normalized()});
  }
}

std::vector<Match> matchesOf(const Recording& recording, const CameraModel& first,
                             const CameraModel& second) {
  std::vector<std::pair<const Recording::FrameFile*, const Recording::FrameFile*>> pairs;
  const Recording::FrameFile* last = nullptr;
  for (const auto& frame : recording.frames) {
    if (!frame.load && frame.path.empty()) continue;
    if (frame.camera == 0) last = &frame;
    if (frame.camera == 1 && last && last->index == frame.index) pairs.emplace_back(last, &frame);
  }
  std::vector<Match> matches;
  const std::size_t count = std::min(kPairs, pairs.size());
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [a, b] = pairs[(2 * i + 1) * pairs.size() / (2 * count)];
    const auto image_0 = replay::monoImageOf(*a), image_1 = replay::monoImageOf(*b);
    const auto fits = [](const Result<cv::Mat>& image, const CameraModel& camera) {
      return image && image->cols == camera.width() && image->rows == camera.height();
    };
    if (!fits(image_0, first) || !fits(image_1, second)) continue;
    addMatches(first, second, *image_0, *image_1, matches);
  }
  return matches;
}

double medianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

replay::DataFindings checkStereo(const Recording& recording) {
  const auto& cameras = recording.calibration.cameras;
  if (cameras.size() < 2) return {};
  const CameraModel first(cameras[0]), second(cameras[1]);
  const RigidTransform T_C1C0 = second.T_BC().inverse() * first.T_BC();
  const std::string of = fmt::format("T_BS of {}", cameras[1].name);
  const std::vector<Match> matches = matchesOf(recording, first, second);
  if (matches.size() < kFewestMatches) return {};
  constexpr double kSamePlace_m = 1e-3;
  if (T_C1C0.p.norm() < kSamePlace_m) {
    return {{DataFinding::Grade::kWarning, "stereo_same_place",
             fmt::format("{} has it at the place of {}: write where each camera is on the IMU", of,
                         cameras[0].name)}};
  }
  const Eigen::Matrix3d R = T_C1C0.R();
  const Vector3d t = T_C1C0.p.normalized();
  std::vector<double> off_px;
  std::size_t before = 0, behind = 0;
  for (const Match& match : matches) {
    const Vector3d ray = R * match.first;  // in C1, from where the first camera is
    const Vector3d normal = t.cross(ray);
    constexpr double kAlongBaseline = 0.1;
    if (normal.norm() < kAlongBaseline) continue;
    const double sine = std::min(1.0, std::abs(normal.normalized().dot(match.second)));
    off_px.push_back(cameras[1].fx * std::asin(sine));
    // Of what is before the cameras: towards t, as ray + t / depth has it.
    const double parallax = -normal.normalized().dot(ray.cross(match.second));
    if (std::abs(parallax) * cameras[1].fx < 2.0) continue;
    ++(parallax > 0.0 ? before : behind);
  }
  if (off_px.size() < kFewestMatches) return {};
  constexpr double kFarOff_px = 4.0;
  if (const double median = medianOf(off_px); median > kFarOff_px) {
    return {{DataFinding::Grade::kWarning, "stereo_epipolar",
             fmt::format("{} does not fit that of {}: what both see lies {:.0f} px from its "
                         "epipolar line; write where each camera is on the IMU (not relative to "
                         "the other camera, nor the inverse), or calibrate",
                         of, cameras[0].name, median)}};
  }
  if (behind > kFewestMatches && behind > 2 * before) {
    return {{DataFinding::Grade::kWarning, "stereo_wrong_side",
             fmt::format("{} has it on the wrong side of {}: what both see would be behind them; "
                         "are the folders, or the signs of the baseline, exchanged?",
                         of, cameras[0].name)}};
  }
  return {};
}

}  // namespace perdure::tools
