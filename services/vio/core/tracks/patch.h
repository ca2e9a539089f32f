// Appearance of a corner at its first observation, and its warp, gain and offset since then, found
// by inverse-compositional Gauss-Newton (Baker & Matthews, IJCV 2004).
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

  /// Cuts a patch from a CV_8UC1 image. Returns nothing if the patch exceeds the image or has too
  /// little texture.
  static std::optional<Patch> cut(const cv::Mat& image, const cv::Point2f& pixel);

  /// Finds the patch from `seed` on. Each of `levels` has half the size of the one before. Returns
  /// nothing, and leaves the warp unchanged, if the patch leaves the image or the search does not
  /// converge.
  std::optional<Found> find(const std::vector<cv::Mat>& levels, const cv::Point2f& seed);

  /// Returns the ratio of the present size to that at the first observation.
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
