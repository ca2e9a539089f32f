#include "tools/simulate/render/lighting.h"

#include <algorithm>
#include <cmath>

#include "tools/simulate/render/counter_noise.h"
#include "tools/simulate/shapes/patterns/pattern.h"

namespace perdure::tools {
namespace {

using shapes::smoothStep;

constexpr float kCell = 4.0F, kReach = 1.0F;
constexpr std::size_t kCells = 4096;
constexpr float kHazeDistance = 900.0F;

}  // namespace

Lighting::Lighting(const sim::Scene& scene)
    : sky_(scene), sun_W_(scene.sun_W.normalized().cast<float>()), cells_(kCells) {
  const auto sun = static_cast<float>(scene.sun_strength);
  const auto sky = static_cast<float>(scene.sky_strength);
  if (sky_.indoors()) {
    sun_colour_ = Eigen::Vector3f(1.0F, 0.96F, 0.9F) * (0.9F * sun);
    sky_colour_ = Eigen::Vector3f(1.0F, 0.97F, 0.92F) * (1.3F * sky);
    bounce_colour_ = Eigen::Vector3f(0.62F, 0.57F, 0.5F) * (1.3F * sky);
  } else {
    sun_colour_ = Eigen::Vector3f(1.0F, 0.94F, 0.84F) * (2.2F * sun);
    sky_colour_ = Eigen::Vector3f(0.82F, 0.92F, 1.1F) * (1.2F * sky);
    bounce_colour_ = Eigen::Vector3f(0.42F, 0.40F, 0.37F) * (0.6F * sky + 0.4F * sun);
  }
}

std::size_t Lighting::cellOf(float x, float y) const {
  const auto column = static_cast<std::uint32_t>(static_cast<int>(std::floor(x / kCell)));
  const auto row = static_cast<std::uint32_t>(static_cast<int>(std::floor(y / kCell)));
  return mixBits(static_cast<std::uint64_t>(column) << 32 | row) % kCells;
}

void Lighting::setTime(const World& world) {
  footprints_.clear();
  for (auto& cell : cells_) cell.clear();
  for (std::size_t i = 1; i < world.instances().size(); ++i) {
    const Instance& instance = world.instances()[i];
    if (!instance.present) continue;
    const Eigen::Vector3f size = world.scene().objects[i - 1].size.cast<float>();
    Footprint f;
    f.instance = static_cast<std::uint32_t>(i);
    f.centre = instance.p.head<2>();
    f.along = instance.R.col(0).head<2>().normalized();
    f.half = 0.5F * size.head<2>();
    f.bottom = instance.p.z() - 0.5F * size.z();
    f.height = size.z();
    const float radius = f.half.norm() + kReach;
    std::vector<std::size_t> touched;
    for (float x = f.centre.x() - radius; x < f.centre.x() + radius + kCell; x += kCell) {
      for (float y = f.centre.y() - radius; y < f.centre.y() + radius + kCell; y += kCell) {
        touched.push_back(cellOf(x, y));
      }
    }
    std::ranges::sort(touched);
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    for (const auto cell : touched) {
      cells_[cell].push_back(static_cast<std::uint32_t>(footprints_.size()));
    }
    footprints_.push_back(f);
  }
}

/// Share of the sky's light that nearby objects leave on level ground; 1 on steep surfaces.
float Lighting::contact(const Hit& hit) const {
  if (hit.normal.z() < 0.7F) return 1.0F;
  float left = 1.0F;
  for (const auto index : cells_[cellOf(hit.position.x(), hit.position.y())]) {
    const Footprint& f = footprints_[index];
    if (f.instance == hit.instance || std::abs(hit.position.z() - f.bottom) > 0.08F) continue;
    const Eigen::Vector2f d = hit.position.head<2>() - f.centre;
    const Eigen::Vector2f local(std::abs(d.dot(f.along)),
                                std::abs(f.along.x() * d.y() - f.along.y() * d.x()));
    const Eigen::Vector2f beyond = local - f.half;
    const float outside = beyond.cwiseMax(0.0F).norm();
    const float inside = std::min(0.0F, beyond.maxCoeff());
    const float reach = std::min(kReach, 0.45F * f.height);
    left *= 1.0F - 0.45F * (1.0F - smoothStep(0.0F, reach, outside)) -
            0.35F * smoothStep(0.0F, 0.4F * reach, -inside);
  }
  return left;
}

Eigen::Vector3f Lighting::ambient(const Hit& hit) const {
  const float up = 0.5F + 0.5F * hit.normal.z();
  const float low = 0.75F + 0.25F * smoothStep(0.0F, 0.5F, hit.position.z());
  const float open = hit.normal.z() > 0.7F ? contact(hit) : low;
  return (sky_colour_ * up + bounce_colour_ * (1.0F - up)) * open;
}

/// Reflection of sky and sun in a glossy surface (Schlick's approximation).
Eigen::Vector3f Lighting::gloss(const Eigen::Vector3f& ray, const Hit& hit, bool in_sun) const {
  const float cosine = std::clamp(-ray.dot(hit.normal), 0.0F, 1.0F);
  const Eigen::Vector3f mirrored = ray + 2.0F * cosine * hit.normal;
  const float grazing = 1.0F - cosine;
  const float grazing2 = grazing * grazing;
  const float share = hit.surface->gloss * (0.05F + 0.75F * grazing2 * grazing2 * grazing);
  const Eigen::Vector3f around = sky_.radiance(hit.position, mirrored);
  const float open = smoothStep(0.0F, 0.35F, mirrored.z());
  Eigen::Vector3f seen = bounce_colour_ * (0.5F * (1.0F - open)) + around * open;
  if (in_sun) {
    const float spot = mirrored.dot(sun_W_);
    if (spot > 0.96F) seen += sun_colour_ * (12.0F * std::pow(spot, 250.0F));
  }
  return share * seen;
}

Eigen::Vector3f Lighting::shade(const Eigen::Vector3f& origin, const Eigen::Vector3f& ray,
                                const Hit& hit, bool in_sun, float pixel_angle) const {
  if (hit.instance == kNothing) return sky_.radiance(origin, ray);
  const Material& material = *hit.surface;
  Eigen::Vector3f albedo = material.colour;
  if (material.texture) {
    const float slant = std::max(0.05F, std::abs(ray.dot(hit.normal)));
    const float width = hit.distance * pixel_angle / std::sqrt(slant);
    albedo = albedo.cwiseProduct(material.texture->sample(hit.uv, width * hit.repeats_per_metre));
  }
  Eigen::Vector3f light = ambient(hit);
  if (in_sun) light += sun_colour_ * std::max(0.0F, hit.normal.dot(sun_W_));
  Eigen::Vector3f out = albedo.cwiseProduct(light) + material.emission * albedo;
  if (material.gloss > 0.0F) out += gloss(ray, hit, in_sun);
  if (sky_.indoors()) return out;
  const float haze = 1.0F - std::exp(-hit.distance / kHazeDistance);
  return out + (sky_.horizon() - out) * haze;
}

}  // namespace perdure::tools
