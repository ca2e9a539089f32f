#include "tools/data_check/stereo/stereo_matches.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "common/replay/data_check.h"

namespace perdure::tools {
namespace {

using replay::Recording;

constexpr double kWidth_px = 640.0;  // larger images are scaled down to this width

CameraModel scaled(const CameraModel& camera, double scale) {
  CameraCalibration c = camera.calibration();
  c.width = static_cast<std::uint32_t>(std::lround(scale * c.width));
  c.height = static_cast<std::uint32_t>(std::lround(scale * c.height));
  c.fx *= scale, c.fy *= scale;
  c.cx = scale * (c.cx + 0.5) - 0.5, c.cy = scale * (c.cy + 0.5) - 0.5;
  return CameraModel(c);
}

cv::Size sizeOf(const CameraModel& camera) {
  return {static_cast<int>(camera.width()), static_cast<int>(camera.height())};
}

cv::Mat resized(const cv::Mat& image, const CameraModel& to) {
  cv::Mat small;
  if (image.size() == sizeOf(to)) return image;
  cv::resize(image, small, sizeOf(to), 0, 0, cv::INTER_AREA);
  return small;
}

/// For each pixel of the first image, the pixel in the second of a point at infinity; −1e4 if it is
/// not visible there.
cv::Mat whereFar(const CameraModel& first, const CameraModel& second, const Eigen::Matrix3d& R) {
  const cv::Size size = sizeOf(first);
  cv::Mat where(size, CV_32FC2, cv::Scalar(-1e4, -1e4));
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const auto ray = first.unproject({u, v});
      if (!ray) continue;
      const auto pixel = second.project(R * ray->homogeneous().normalized());
      if (!pixel || !second.inImage(*pixel)) continue;
      where.at<cv::Vec2f>(v, u) =
          cv::Vec2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
    }
  }
  return where;
}

/// Mask for corner detection: the area that both cameras cover, without its border.
cv::Mat seenByBoth(const cv::Mat& where) {
  constexpr int kBorder_px = 12;
  cv::Mat across, seen, inner;
  cv::extractChannel(where, across, 0);
  seen = across >= 0.0f;
  const cv::Mat square =
      cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * kBorder_px + 1, 2 * kBorder_px + 1));
  cv::erode(seen, inner, square, cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  return inner;
}

/// Normalises the image by the local mean and contrast, so that exposure and gamma have no effect.
cv::Mat evened(const cv::Mat& image) {
  constexpr double kNoise = 2.0, kContrast = 40.0;
  const cv::Size about(31, 31);
  cv::Mat grey, mean, squares, result;
  image.convertTo(grey, CV_32F);
  cv::boxFilter(grey, mean, -1, about);
  cv::sqrBoxFilter(grey, squares, CV_32F, about);
  cv::Mat deviation = squares - mean.mul(mean);
  cv::sqrt(cv::max(deviation, 0.0), deviation);
  cv::Mat(kContrast * (grey - mean) / (deviation + kNoise) + 128.0).convertTo(result, CV_8U);
  return result;
}

void flipImage(cv::Mat& image, Flip flip) {
  if (flip == Flip::kNone) return;
  cv::Mat flipped;
  cv::flip(image, flipped, flip == Flip::kSideways ? 1 : flip == Flip::kUpright ? 0 : -1);
  image = flipped;
}

/// Adds the corners of the first image that can be tracked to the second and back to their origin.
void addMatches(const CameraModel& camera, const Eigen::Matrix3d& R, const cv::Mat& first,
                const cv::Mat& second, const cv::Mat& seen, StereoMatches& all) {
  std::vector<cv::Point2f> from, to, back;
  cv::goodFeaturesToTrack(first, from, 150, 0.01, 0.02 * first.cols + 2.0, seen);
  if (from.empty()) return;
  all.tried += from.size();
  std::vector<uchar> found, found_back;
  std::vector<float> error;
  const cv::Size window(21, 21);
  cv::calcOpticalFlowPyrLK(first, second, from, to, found, error, window, 4);
  cv::calcOpticalFlowPyrLK(second, first, to, back, found_back, error, window, 4);
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (found[i] == 0 || found_back[i] == 0 || cv::norm(back[i] - from[i]) > 0.5) continue;
    const auto a = camera.unproject({from[i].x, from[i].y});
    const auto b = camera.unproject({to[i].x, to[i].y});
    if (!a || !b) continue;
    all.matches.push_back({a->homogeneous().normalized(), R * b->homogeneous().normalized()});
  }
}

}  // namespace

std::vector<StereoImages> someStereoImages(const Recording& recording, std::size_t most) {
  const auto& cameras = recording.calibration.cameras;
  std::vector<std::pair<const Recording::FrameFile*, const Recording::FrameFile*>> files;
  const Recording::FrameFile* last = nullptr;
  for (const auto& frame : recording.frames) {
    if (!frame.load && frame.path.empty()) continue;
    if (frame.camera == 0) last = &frame;
    if (frame.camera == 1 && last && last->index == frame.index) files.emplace_back(last, &frame);
  }
  const auto fits = [](const Result<cv::Mat>& image, const CameraCalibration& camera) {
    return image && image->cols == static_cast<int>(camera.width) &&
           image->rows == static_cast<int>(camera.height);
  };
  std::vector<StereoImages> pairs;
  const std::size_t count = std::min(most, files.size());
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [a, b] = files[(2 * i + 1) * files.size() / (2 * count)];
    const auto first = replay::monoImageOf(*a), second = replay::monoImageOf(*b);
    if (fits(first, cameras[0]) && fits(second, cameras[1])) pairs.push_back({*first, *second});
  }
  return pairs;
}

bool areSameImages(const std::vector<StereoImages>& pairs) {
  constexpr double kLeastContrast = 5.0, kNoise = 0.5;  // grey values; allows for a JPEG copy
  std::size_t same = 0;
  for (const auto& [first, second] : pairs) {
    if (first.size() != second.size()) return false;
    cv::Scalar mean, deviation;
    cv::meanStdDev(first, mean, deviation);
    const double apart = cv::norm(first, second, cv::NORM_L1) /
                         static_cast<double>(std::max<std::size_t>(1, first.total()));
    same += deviation[0] > kLeastContrast && apart < kNoise ? 1 : 0;
  }
  return 4 * same > 3 * pairs.size();
}

StereoMatches matchesOf(const std::vector<StereoImages>& pairs, const CameraModel& first,
                        const CameraModel& second, const Eigen::Matrix3d& R_C1C0, Flip flip) {
  const double scale = std::min(1.0, kWidth_px / first.width());
  const CameraModel small = scaled(first, scale);
  const CameraModel other = scaled(second, std::min(1.0, scale * first.fx() / second.fx()));
  const cv::Mat where = whereFar(small, other, R_C1C0);
  const cv::Mat seen = seenByBoth(where);
  StereoMatches all;
  if (cv::countNonZero(seen) == 0) return all;
  for (const auto& pair : pairs) {
    cv::Mat image = resized(pair.second, other), turned;
    flipImage(image, flip);
    cv::remap(image, turned, where, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    addMatches(small, R_C1C0, evened(resized(pair.first, small)), evened(turned), seen, all);
  }
  return all;
}

}  // namespace perdure::tools
