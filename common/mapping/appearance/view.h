// The appearance of an anchor: landmarks observed between this anchor and the next one.
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

/// A view has at most kMostPoints points of 48 bytes each.
using View = std::vector<SeenPoint>;
inline constexpr std::size_t kMostPoints = 48;

}  // namespace perdure::mapping
