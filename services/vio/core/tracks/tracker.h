// Tracks corners: pyramidal Lucas-Kanade from the gyroscope's prediction, then comparison with the
// first observation. New corners (FAST) fill a grid.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/camera/camera_model.h"
#include "services/vio/core/tracks/patch.h"
#include "services/vio/core/tracks/ransac.h"
#include "services/vio/core/tracks/tracks.h"

namespace perdure::vio {

struct TrackerOptions {
  std::int64_t max_points = 130;
  std::int64_t grid_columns = 8, grid_rows = 6;
  std::int64_t pyramid_levels = 3;  ///< levels above the image itself, at least 1
  std::int64_t stereo_levels = 4;
  std::int64_t window_px = 11;
  std::int64_t iterations = 20;
  std::int64_t fast_threshold = 15;
  double min_distance_px = 12.0;
  double ransac_px = 1.5;
  double stereo_px = 2.0;    ///< largest distance from the calibration's epipolar line
  double similarity = 0.75;  ///< smallest similarity to the first observation of a point
  double growth = 1.7;       ///< largest growth of a patch; above it, a new point begins
  std::int64_t memory = 10;  ///< number of frames over which motion can be queried
};

class Tracker {
 public:
  Tracker(const TrackerOptions& options, const std::vector<CameraModel>& cameras);

  /// Images are CV_8UC1; `second` may be empty. R_now_before: rotation of the body, if known.
  /// masked: boxes of the first image in which no points are used. turn_of_readout: rotation of the
  /// body, in its frame, from the first to the last row of the first image. Epipolar lines refer to
  /// middle rows.
  TrackedFrame track(const cv::Mat& first, const cv::Mat& second,
                     const std::optional<Eigen::Matrix3d>& R_now_before,
                     const std::vector<cv::Rect2f>& masked = {},
                     const Eigen::Vector3d& turn_of_readout = Eigen::Vector3d::Zero());
  /// Quantile of the points' image motion, px, over the last `frames`. Empty for too few points.
  std::optional<double> motionSince(std::size_t frames, double quantile = 0.5) const;
  /// Share of points still within half a pixel for `frames` images; 0 if few or close together.
  double stillShare(std::size_t frames) const;
  /// Clears all tracks. Ids continue.
  void reset();
  /// Sets the lowest id for new tracks.
  void continueIdsFrom(std::uint64_t id) { next_id_ = std::max(next_id_, id); }
  std::uint64_t nextId() const { return next_id_; }
  const ReasonCounts& reasons() const { return reasons_; }

 private:
  struct Point {
    std::uint64_t id = 0;
    cv::Point2f pixel, second;  ///< second: position in the second camera, valid if has_second
    bool has_second = false;
    Eigen::Vector2d normalised;
    Eigen::Vector2d at_middle;  ///< normalised, rotated to the camera's attitude at the middle row
    std::unique_ptr<Patch> patch;
    cv::Point2f place = pixel;  ///< the point has moved by less than half a pixel from here
    std::size_t still = 0;
  };
  std::vector<cv::Mat> pyramid(const cv::Mat& image, std::int64_t levels) const;
  struct Images {
    std::vector<cv::Mat> half;    ///< cv::buildOpticalFlowPyramid from half size on
    std::vector<cv::Mat> levels;  ///< the image itself, then each of half the previous size
  };
  void follow(const Images& now, const std::optional<Eigen::Matrix3d>& R);
  Eigen::Vector2d atMiddle(const ImagePoint& seen) const;
  std::vector<cv::Point2f> seeds(const std::optional<Eigen::Matrix3d>& R) const;
  std::vector<bool> inliers(const std::vector<Match>& matches,
                            const std::optional<Eigen::Matrix3d>& R);
  void detect(const cv::Mat& image, const std::vector<cv::Rect2f>& masked);
  void followIntoSecond(const std::vector<cv::Mat>& first, const std::vector<cv::Mat>& second);
  /// Returns the second image with the size and scale of the first, if their sizes differ.
  cv::Mat asFirst(const cv::Mat& second) const;
  TrackedFrame result() const;

  TrackerOptions options_;
  std::vector<CameraModel> cameras_;
  struct Placed {
    double scale;
    cv::Point2f shift;
  };
  /// Table for pixels of the second camera; empty if the images have equal sizes.
  std::optional<Placed> as_first_;
  std::vector<Point> points_;
  Eigen::Vector3d turn_ = Eigen::Vector3d::Zero();  ///< rotation of camera 0 during read-out, in C
  std::vector<cv::Mat> previous_;
  std::deque<std::vector<std::pair<std::uint64_t, cv::Point2f>>> history_;  ///< newest last
  std::uint64_t next_id_ = 1;
  ReasonCounts reasons_;
};

}  // namespace perdure::vio
