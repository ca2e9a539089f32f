// Appearance of a corner at its first observation, and warp, gain and offset since then
// (inverse-compositional Gauss-Newton, Baker & Matthews, IJCV 2004).
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace perdure::vio {

class Patch {
 public:
  static constexpr int kHalf = 6, kSide = 2 * kHalf + 1, kPixels = kSide * kSide;

  struct Found {
    cv::Point2f pixel;
    float similarity = 0;  ///< −1 … 1: normalised cross-correlation with the first observation
  };

  /// Cuts a patch of a CV_8UC1 image. Empty beyond the image or with too little texture.
  static std::optional<Patch> cut(const cv::Mat& image, const cv::Point2f& pixel);

  /// Finds the patch, starting from `seed`, in images each of half the size of the previous. Empty,
  /// with an unchanged warp, outside the image or without convergence.
  std::optional<Found> find(const std::vector<cv::Mat>& levels, const cv::Point2f& seed);

  /// Current size in pixels relative to the first observation.
  float growth() const;

 private:
  Patch() = default;
  Eigen::Matrix<float, kPixels, 1> value_;     ///< zero mean
  Eigen::Matrix<float, kPixels, 6> steepest_;  ///< derivatives by [x, y, a_xx, a_xy, a_yx, a_yy]
  Eigen::Matrix<float, 6, 6> inverse_hessian_;
  float norm_ = 0;
  /// Warp from the first to the current image.
  Eigen::Matrix2f warp_ = Eigen::Matrix2f::Identity();
};

}  // namespace perdure::vio
