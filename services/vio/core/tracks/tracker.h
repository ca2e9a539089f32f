// Tracks corners by pyramidal Lucas-Kanade from the gyroscope's prediction, and compares them with
// their first observation. New corners (FAST) fill a grid.
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
  double growth = 1.7;       ///< a patch that grows more begins a new point
  std::int64_t memory = 10;  ///< number of frames over which motion can be queried
};

class Tracker {
 public:
  Tracker(const TrackerOptions& options, const std::vector<CameraModel>& cameras);

  /// Tracks the points into the next images (CV_8UC1); `second` may be empty. R_now_before is the
  /// rotation of the body, if known. No points are used inside the boxes `masked` of the first
  /// image. turn_of_readout is the body's rotation vector, in B, from the first to the last row of
  /// that image.
  TrackedFrame track(const cv::Mat& first, const cv::Mat& second,
                     const std::optional<Eigen::Matrix3d>& R_now_before,
                     const std::vector<cv::Rect2f>& masked = {},
                     const Eigen::Vector3d& turn_of_readout = Eigen::Vector3d::Zero());
  /// Returns a quantile of the image motion, in px, over the last `frames` frames, of the points
  /// that were tracked before; infinite if that many of them were lost. A moving camera soon loses
  /// the near points and keeps those at the horizon. Returns nothing if there are too few frames,
  /// or if fewer than ten points were tracked.
  std::optional<double> motionSince(std::size_t frames, double quantile = 0.5) const;
  /// Returns the share of points that have moved less than half a pixel for `frames` images; 0 if
  /// these are fewer than eight or close together.
  double stillShare(std::size_t frames) const;
  /// Replaces the cameras by others of the same sizes, and undistorts the points again.
  void setCameras(std::vector<CameraModel> cameras);
  /// Removes all points. New points do not reuse ids.
  void reset();
  /// Sets the least id of new points.
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
    cv::Point2f place = pixel;  ///< the point is still within half a pixel of it
    std::size_t still = 0;
  };
  const CameraModel& camera(std::size_t c) const { return (*shared_)[c]; }
  std::vector<cv::Mat> pyramid(const cv::Mat& image, std::int64_t levels) const;
  struct Images {
    std::vector<cv::Mat> half;    ///< cv::buildOpticalFlowPyramid, from half size on
    std::vector<cv::Mat> levels;  ///< the image itself, then each of half the previous size
  };
  void follow(const Images& now, const std::optional<Eigen::Matrix3d>& R);
  Eigen::Vector2d atMiddle(const ImagePoint& seen) const;
  std::vector<cv::Point2f> seeds(const std::optional<Eigen::Matrix3d>& R) const;
  std::vector<bool> inliers(const std::vector<Match>& matches,
                            const std::optional<Eigen::Matrix3d>& R);
  void detect(const cv::Mat& image, const std::vector<cv::Rect2f>& masked);
  void followIntoSecond(const std::vector<cv::Mat>& first, const std::vector<cv::Mat>& second);
  /// Returns the second image, converted to the size and scale of the first if their sizes differ.
  cv::Mat asFirst(const cv::Mat& second) const;
  TrackedFrame result() const;

  TrackerOptions options_;
  SharedCameras shared_;
  struct Placed {
    double scale;
    cv::Point2f shift;
  };
  /// Scale and shift from pixels of the second image to asFirst(); empty if the sizes are equal.
  std::optional<Placed> as_first_;
  std::vector<Point> points_;
  Eigen::Vector3d turn_ = Eigen::Vector3d::Zero();  ///< rotation of camera 0 during read-out, in C
  std::vector<cv::Mat> previous_;
  std::deque<std::vector<std::pair<std::uint64_t, cv::Point2f>>> history_;  ///< newest last
  std::uint64_t next_id_ = 1;
  ReasonCounts reasons_;
};

}  // namespace perdure::vio
