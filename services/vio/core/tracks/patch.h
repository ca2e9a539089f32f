// What a corner looked like when it was first seen, and how that has turned, grown and leant since:
// an affine warp with gain and offset of brightness, found by inverse-compositional Gauss-Newton
// (Baker & Matthews, "Lucas-Kanade 20 years on", IJCV 2004). Because each image is compared with
// the first one, errors do not add up along a track.
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
    float similarity = 0;  ///< −1 … 1: normalised cross-correlation with the first sight
  };

  /// Around `pixel` of a CV_8UC1 image; nothing where that reaches out of the image or is too
  /// plain to be found again.
  static std::optional<Patch> cut(const cv::Mat& image, const cv::Point2f& pixel);

  /// Where it is now, sought from `seed` on. Each of `levels` is half the size of the one
  /// before. Nothing where it leaves the image or does not settle; the warp is then as before.
  std::optional<Found> find(const std::vector<cv::Mat>& levels, const cv::Point2f& seed);

  /// Pixels now per pixel at first sight.
  float growth() const;

 private:
  Patch() = default;
  Eigen::Matrix<float, kPixels, 1> value_;     ///< of mean 0
  Eigen::Matrix<float, kPixels, 6> steepest_;  ///< by [x, y, a_xx, a_xy, a_yx, a_yy]
  Eigen::Matrix<float, 6, 6> inverse_hessian_;
  float norm_ = 0;
  Eigen::Matrix2f warp_ = Eigen::Matrix2f::Identity();  ///< from first sight to now
};

}  // namespace perdure::vio
