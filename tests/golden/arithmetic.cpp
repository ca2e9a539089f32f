#include "tests/golden/arithmetic.h"

#include <ceres/version.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/version.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string_view>
#include <vector>

#include "common/base/ids.h"

namespace perdure::test {
namespace {

/// Collects the bytes of all results.
class Bits {
 public:
  void take(double x) { bytes_.append(reinterpret_cast<const char*>(&x), sizeof(x)); }
  void take(const float* x, std::size_t count) {
    bytes_.append(reinterpret_cast<const char*>(x), count * sizeof(*x));
  }
  void take(std::string_view text) { bytes_ += text; }
  std::string digestOf() const { return toHex(digest(bytes_)); }

 private:
  std::string bytes_;
};

/// The arguments are volatile, because the compiler would otherwise compute exact results.
void takeFunctions(Bits& bits) {
  for (int i = 1; i <= 200; ++i) {
    const volatile double x = 0.0371 * i, y = 1.0 / (0.3 + i);
    bits.take(std::exp(-x));
    bits.take(std::log(x));
    bits.take(std::pow(x, y));
    bits.take(std::sin(x * x));
    bits.take(std::cos(x * x));
    bits.take(std::atan2(x - 3.0, y));
    bits.take(std::erfc(x - 2.0));
    bits.take(std::lgamma(x));
  }
}

/// Returns a symmetric positive definite matrix without round numbers.
Eigen::MatrixXd definite(int size) {
  Eigen::MatrixXd m(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) m(i, j) = std::sin(1.7 * i + 0.3 * j * j + 0.1);
  }
  return m * m.transpose() + 0.1 * Eigen::MatrixXd::Identity(size, size);
}

/// Uses small matrices, and one large enough for Eigen's blocked kernels.
void takeMatrices(Bits& bits) {
  for (const int size : {3, 7, 48}) {
    const Eigen::MatrixXd m = definite(size), inverse = m.llt().solve(definite(size).col(0) * m);
    for (Eigen::Index i = 0; i < inverse.size(); ++i) bits.take(inverse.data()[i]);
    bits.take(m.llt().matrixL().toDenseMatrix().norm());
  }
}

cv::Mat waves(double shift) {
  cv::Mat image(120, 160, CV_8U);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double value =
          std::sin(0.21 * (x + shift)) * std::cos(0.17 * y) + std::sin(0.05 * x * y);
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(128.0 + 60.0 * value);
    }
  }
  return image;
}

void takePictures(Bits& bits) {
  const cv::Mat before = waves(0.0), after = waves(1.3);
  std::vector<cv::Point2f> points, moved;
  for (int i = 0; i < 40; ++i) {
    points.emplace_back(20.0F + 2.9F * static_cast<float>(i), 30.0F + 1.3F * static_cast<float>(i));
  }
  std::vector<std::uint8_t> found;
  cv::calcOpticalFlowPyrLK(before, after, points, moved, found, cv::noArray(), {15, 15}, 2);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    if (found[i] != 0) bits.take(&moved[i].x, 2);
  }
  cv::Mat system(9, 9, CV_64F);
  for (int i = 0; i < 81; ++i) system.at<double>(i / 9, i % 9) = std::sin(0.9 * i * i + 0.2);
  const cv::SVD parts(system);
  for (const cv::Mat& part : {parts.u, parts.w, parts.vt}) {
    for (int i = 0; i < static_cast<int>(part.total()); ++i) {
      bits.take(part.at<double>(i / part.cols, i % part.cols));
    }
  }
}

std::string machine() {
#if defined(__x86_64__)
  std::string name = "x86_64";
#elif defined(__aarch64__)
  std::string name = "aarch64";
#else
  std::string name = "other";
#endif
#if defined(__clang__)
  name += "-clang" __clang_version__;
#else
  name += "-gcc" __VERSION__;
#endif
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
  name += "-fma";
#endif
#if defined(__OPTIMIZE__)
  name += "-O";
#endif
  std::erase(name, ' ');
  return name;
}

Bits numbers() {
  Bits bits;
  for (const int part : {EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION}) {
    bits.take(part);
  }
  bits.take(CERES_VERSION_STRING);
  takeFunctions(bits);
  takeMatrices(bits);
  return bits;
}

}  // namespace

std::string arithmeticOfNumbers() { return machine() + "-" + numbers().digestOf(); }

std::string arithmeticOfPictures() {
  Bits bits = numbers();
  bits.take(CV_VERSION);
  takePictures(bits);
  return machine() + "-" + bits.digestOf();
}

}  // namespace perdure::test
