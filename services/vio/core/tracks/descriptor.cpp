#include "services/vio/core/tracks/descriptor.h"

#include <algorithm>
#include <cmath>

namespace perdure::vio {
namespace {

constexpr int kReach = 13, kRadius = kReach + 2;  // px, pattern without and with the box

// Rows are longer than the patch, so that the compiler can vectorise the loops.
constexpr std::size_t kSide = 2 * kReach + 1, kStride = 32, kOuter = 2 * kRadius + 1;
using Smooth = std::array<std::uint16_t, kSide * kStride>;

constexpr std::uint16_t index(int x, int y) {
  return static_cast<std::uint16_t>((y + kReach) * static_cast<int>(kStride) + x + kReach);
}

/// Indices in Smooth of the two values of a bit.
struct Pair {
  std::uint16_t first, second;
};

/// Returns pairs of pixels with approximately normal coordinates: sums of draws from a fixed
/// generator.
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
      const int x0 = draw(), y0 = draw(), x1 = draw(), y1 = draw();
      p = {index(x0, y0), index(x1, y1)};
    } while (p.first == p.second);
  }
  return pattern;
}

/// Smooths the patch around (x, y) with a 5×5 box. At the border, the box includes pixels outside
/// the patch.
Smooth smoothAround(const cv::Mat& image, int x, int y) {
  std::array<std::uint16_t, kOuter * kStride> sums{};
  for (std::size_t r = 0; r < kOuter; ++r) {
    const std::uint8_t* in =
        image.ptr<std::uint8_t>(y - kRadius + static_cast<int>(r)) + (x - kRadius);
    unsigned sum = 0u + in[0] + in[1] + in[2] + in[3];
    for (std::size_t c = 0; c < kSide; ++c) {
      sum += in[c + 4];
      sums[r * kStride + c] = static_cast<std::uint16_t>(sum);
      sum -= in[c];
    }
  }
  Smooth smooth;
  for (std::size_t i = 0; i < smooth.size(); ++i) {
    const unsigned sum = 0u + sums[i] + sums[i + kStride] + sums[i + 2 * kStride] +
                         sums[i + 3 * kStride] + sums[i + 4 * kStride];
    smooth[i] = static_cast<std::uint16_t>((sum + 12) / 25);
  }
  return smooth;
}

}  // namespace

std::optional<Descriptor> descriptorAt(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  static const std::array<Pair, 256> kPattern = makePattern();
  const int x = static_cast<int>(std::lround(pixel.x()));
  const int y = static_cast<int>(std::lround(pixel.y()));
  if (x < kRadius || y < kRadius || x >= image.cols - kRadius || y >= image.rows - kRadius) {
    return std::nullopt;
  }
  const Smooth smooth = smoothAround(image, x, y);
  Descriptor d{};
  auto pair = kPattern.begin();
  for (std::uint8_t& byte : d) {
    unsigned bits = 0;
    for (unsigned k = 0; k < 8; ++k, ++pair) {
      bits |= static_cast<unsigned>(smooth[pair->first] < smooth[pair->second]) << k;
    }
    byte = static_cast<std::uint8_t>(bits);
  }
  return d;
}

Landmarks landmarksMessage(const FrameStamp& stamp, InstanceId instance, const WorldId& world,
                           const std::string& camera, std::vector<Landmark> landmarks,
                           const cv::Mat& image) {
  std::erase_if(landmarks, [](const Landmark& l) {
    return !l.p_W.allFinite() || !l.covariance.allFinite() || !l.cross_pose.allFinite();
  });
  for (Landmark& l : landmarks) {
    l.descriptor = descriptorAt(image, l.pixel).value_or(Descriptor{});
  }
  return {stamp, instance, world, camera, std::move(landmarks)};
}

}  // namespace perdure::vio
