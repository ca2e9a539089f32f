#include "services/vio/core/descriptor.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace perdure::vio {
namespace {

constexpr int kReach = 13, kRadius = kReach + 2;  // of the pattern, and with the box around it

struct Pair {
  int x0, y0, x1, y1;
};

/// Pairs about normally distributed in the patch: sums of uniform draws of a fixed generator.
std::array<Pair, 256> makePattern() {
  std::uint64_t seed = 20111129;
  const auto draw = [&seed] {
    int sum = 0;
    for (int i = 0; i < 4; ++i) {
      seed = seed * 6364136223846793005ull + 1442695040888963407ull;
      sum += static_cast<int>((seed >> 40) % 9);  // 0 … 8
    }
    return std::clamp(sum - 16, -kReach, kReach);
  };
  std::array<Pair, 256> pattern{};
  for (Pair& p : pattern) {
    do {
      p = {draw(), draw(), draw(), draw()};
    } while (p.x0 == p.x1 && p.y0 == p.y1);
  }
  return pattern;
}

}  // namespace

std::optional<Descriptor> descriptorAt(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  static const std::array<Pair, 256> kPattern = makePattern();
  const int x = static_cast<int>(std::lround(pixel.x()));
  const int y = static_cast<int>(std::lround(pixel.y()));
  if (x < kRadius || y < kRadius || x >= image.cols - kRadius || y >= image.rows - kRadius) {
    return std::nullopt;
  }
  // The box looks out of the patch into the image around it.
  cv::Mat smooth;
  cv::blur(image(cv::Rect(x - kReach, y - kReach, 2 * kReach + 1, 2 * kReach + 1)), smooth, {5, 5});
  Descriptor d{};
  for (std::size_t i = 0; i < kPattern.size(); ++i) {
    const Pair& p = kPattern[i];
    const bool bit = smooth.at<std::uint8_t>(kReach + p.y0, kReach + p.x0) <
                     smooth.at<std::uint8_t>(kReach + p.y1, kReach + p.x1);
    d[i / 8] = static_cast<std::uint8_t>(d[i / 8] | (bit << (i % 8)));
  }
  return d;
}

int hammingDistance(const Descriptor& a, const Descriptor& b) {
  int bits = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    bits += std::popcount(static_cast<std::uint8_t>(a[i] ^ b[i]));
  }
  return bits;
}

}  // namespace perdure::vio
