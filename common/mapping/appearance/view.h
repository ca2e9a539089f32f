// The appearance of an anchor: landmarks observed on the trajectory from it to the next anchor.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace perdure::mapping {

/// 256-bit BRIEF descriptor of a landmark.
using Descriptor = std::array<std::uint8_t, 32>;

struct SeenPoint {
  Eigen::Vector3f p = Eigen::Vector3f::Zero();  ///< position in the anchor's axes, m
  float sigma = 0.0F;                           ///< σ of p given the body's pose, m
  Descriptor descriptor{};
  bool operator==(const SeenPoint&) const = default;
};

/// At most kMostPoints points of 48 bytes each.
using View = std::vector<SeenPoint>;
inline constexpr std::size_t kMostPoints = 48;

}  // namespace perdure::mapping
