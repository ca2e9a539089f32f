// Background for rays without a hit: a sky with clouds outdoors, a ceiling with lamps indoors.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/sim/scene.h"

namespace perdure::tools {

class Sky {
 public:
  explicit Sky(const sim::Scene& scene);
  /// Linear RGB radiance in unit direction `d_W` from `origin_W`.
  Eigen::Vector3f radiance(const Eigen::Vector3f& origin_W, const Eigen::Vector3f& d_W) const;
  bool indoors() const { return indoors_; }
  /// Colour of distant haze.
  const Eigen::Vector3f& horizon() const { return horizon_; }

 private:
  Eigen::Vector3f outdoors(const Eigen::Vector3f& d_W) const;
  Eigen::Vector3f ceiling(const Eigen::Vector3f& origin_W, const Eigen::Vector3f& d_W) const;
  void paintOutdoors(std::uint64_t seed);

  bool indoors_;
  float strength_;
  Eigen::Vector3f sun_W_, horizon_;
  /// kSize × kSize: direction d at (d.x, d.y) / (1 + d.z), from -1 to 1 across the square.
  std::vector<Eigen::Vector4f> map_;
};

}  // namespace perdure::tools
