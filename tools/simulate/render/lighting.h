// Light on surfaces by Lambert's law: sun, sky, ground, contact shadows, gloss and haze.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tools/simulate/render/sky.h"
#include "tools/simulate/render/world.h"

namespace perdure::tools {

struct Hit {
  std::uint32_t instance = kNothing;  ///< kNothing: the sky
  std::uint32_t material = 0;
  float distance = 0.0F;
  Eigen::Vector3f position, normal;  ///< W; the normal has unit length and points to the eye
  Eigen::Vector2f uv;
  float repeats_per_metre = 0.0F;
  const Material* surface = nullptr;
};

class Lighting {
 public:
  explicit Lighting(const sim::Scene& scene);
  void setTime(const World& world);

  const Eigen::Vector3f& sun() const { return sun_W_; }
  /// Linear RGB radiance from the hit towards `origin`. `ray`: unit direction; `pixel_angle`:
  /// radians.
  Eigen::Vector3f shade(const Eigen::Vector3f& origin, const Eigen::Vector3f& ray, const Hit& hit,
                        bool in_sun, float pixel_angle) const;
  const Sky& sky() const { return sky_; }

 private:
  struct Footprint {
    std::uint32_t instance = 0;
    Eigen::Vector2f centre, along;  ///< along: unit x axis of the object
    Eigen::Vector2f half;           ///< half length, half width
    float bottom = 0.0F, height = 0.0F;
  };
  float contact(const Hit& hit) const;
  Eigen::Vector3f ambient(const Hit& hit) const;
  Eigen::Vector3f gloss(const Eigen::Vector3f& ray, const Hit& hit, bool in_sun) const;
  std::size_t cellOf(float x, float y) const;

  Sky sky_;
  Eigen::Vector3f sun_W_, sun_colour_, sky_colour_, bounce_colour_;
  std::vector<Footprint> footprints_;
  std::vector<std::vector<std::uint32_t>> cells_;  ///< footprints near a cell, hashed
};

}  // namespace perdure::tools
