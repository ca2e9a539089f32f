// Corners followed from image to image by pyramidal Lucas-Kanade at half size, seeded with the
// gyroscope's prediction, and then placed by their first sight (patch.h); into the second camera by
// Lucas-Kanade alone. New corners (FAST) where the grid is empty.
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
  std::int64_t pyramid_levels = 3;  ///< above the image itself; 1 at least
  std::int64_t stereo_levels = 4;
  std::int64_t window_px = 11;
  std::int64_t iterations = 20;
  std::int64_t fast_threshold = 15;
  double min_distance_px = 12.0;
  double ransac_px = 1.5;
  double stereo_px = 2.0;    ///< from the epipolar line of the calibration
  double similarity = 0.75;  ///< with the first sight of a point, at least
  double growth = 1.7;       ///< of a patch since its first sight; grown more it is a new point
  std::int64_t memory = 10;  ///< frames over which motion can be asked
};

class Tracker {
 public:
  Tracker(const TrackerOptions& options, const std::vector<CameraModel>& cameras);

  /// Images CV_8UC1; `second` may be empty. R_now_before: rotation of the body, where it is known.
  /// masked: boxes in the first image without points. turn_of_readout: of the body in its frame,
  /// from the first row of the first image to the last; epipolar lines are between middle rows.
  TrackedFrame track(const cv::Mat& first, const cv::Mat& second,
                     const std::optional<Eigen::Matrix3d>& R_now_before,
                     const std::vector<cv::Rect2f>& masked = {},
                     const Eigen::Vector3d& turn_of_readout = Eigen::Vector3d::Zero());
  /// Image motion in pixels from `frames` ago to now, of which the share `quantile` of the points
  /// has less; nothing where too little is known.
  std::optional<double> motionSince(std::size_t frames, double quantile = 0.5) const;
  /// Share of the points that have kept their place for the last `frames` images, to half a pixel;
  /// 0 where those are few or in one place: too little to be a background.
  double stillShare(std::size_t frames) const;
  /// Forgets all tracks; ids go on.
  void reset();
  /// No id below this will be given.
  void continueIdsFrom(std::uint64_t id) { next_id_ = std::max(next_id_, id); }
  std::uint64_t nextId() const { return next_id_; }
  const ReasonCounts& reasons() const { return reasons_; }

 private:
  struct Point {
    std::uint64_t id = 0;
    cv::Point2f pixel, second;  ///< second: in the second camera, when has_second
    bool has_second = false;
    Eigen::Vector2d normalised;
    Eigen::Vector2d at_middle;  ///< the same, turned to where the camera was at the middle row
    std::unique_ptr<Patch> patch;
    cv::Point2f place = pixel;  ///< where it has been to half a pixel, in the last images:
    std::size_t still = 0;
  };
  std::vector<cv::Mat> pyramid(const cv::Mat& image, std::int64_t levels) const;
  struct Images {
    std::vector<cv::Mat> half;    ///< from half size on, as of cv::buildOpticalFlowPyramid
    std::vector<cv::Mat> levels;  ///< the image itself first, each half the one before
  };
  void follow(const Images& now, const std::optional<Eigen::Matrix3d>& R);
  Eigen::Vector2d atMiddle(const ImagePoint& seen) const;
  std::vector<cv::Point2f> seeds(const std::optional<Eigen::Matrix3d>& R) const;
  std::vector<bool> inliers(const std::vector<Match>& matches,
                            const std::optional<Eigen::Matrix3d>& R);
  void detect(const cv::Mat& image, const std::vector<cv::Rect2f>& masked);
  void followIntoSecond(const std::vector<cv::Mat>& first, const std::vector<cv::Mat>& second);
  /// The second image in the first one's size and scale, where their sizes differ.
  cv::Mat asFirst(const cv::Mat& second) const;
  TrackedFrame result() const;

  TrackerOptions options_;
  std::vector<CameraModel> cameras_;
  struct Placed {
    double scale;
    cv::Point2f shift;
  };
  std::optional<Placed> as_first_;  ///< of the second camera's pixels; nothing for equal sizes
  std::vector<Point> points_;
  Eigen::Vector3d turn_ = Eigen::Vector3d::Zero();  ///< of the first camera in C, while read out
  std::vector<cv::Mat> previous_;
  std::deque<std::vector<std::pair<std::uint64_t, cv::Point2f>>> history_;  ///< newest last
  std::uint64_t next_id_ = 1;
  ReasonCounts reasons_;
};

}  // namespace perdure::vio
