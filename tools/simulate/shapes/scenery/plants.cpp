#include <cmath>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
namespace {

Vec3 direction(Dice& dice) {
  const float z = dice.uniform(-1.0F, 1.0F), a = dice.uniform(0.0F, 2.0F * kPi);
  const float r = std::sqrt(std::max(0.0F, 1.0F - z * z));
  return {r * std::cos(a), r * std::sin(a), z};
}

std::array<int, 2> leafMaterials(MeshBuilder& b, const Order& order, Dice& dice) {
  std::array<int, 2> leaves{};
  for (int& m : leaves) {
    Material material = textured(Vec3::Ones() * dice.uniform(0.7F, 1.1F),
                                 sharedTexture(TextureKind::kLeaves, order.look_seed, dice, 256));
    material.two_sided = true;
    m = b.material(material, 1.3F);
  }
  return leaves;
}

/// Adds an irregular ball, which is the dark, opaque inside of a cluster.
void addLump(MeshBuilder& b, const Vec3& centre, const Vec3& radii, int material, Dice& dice) {
  constexpr int kSides = 7;
  std::vector<Ring> rings;
  for (float latitude : {-1.2F, -0.5F, 0.2F, 0.9F, 1.4F}) {
    Ring ring = circle(Vec3::UnitZ() * std::sin(latitude), Vec3::UnitZ(), std::cos(latitude),
                       kSides, dice.uniform(0.0F, 1.0F));
    for (Vec3& p : ring) p = centre + dice.uniform(0.75F, 1.1F) * p.cwiseProduct(radii);
    rings.push_back(std::move(ring));
  }
  b.loft(rings, material, 80.0F);
}

/// Adds leaves at the surface of a cluster: small sheets in random orientations.
void addSheets(MeshBuilder& b, const Vec3& centre, const Vec3& radii, int count, float size,
               const std::array<int, 2>& leaves, Dice& dice) {
  for (int i = 0; i < count; ++i) {
    const Vec3 out = direction(dice);
    const Vec3 at = centre + dice.uniform(0.8F, 1.2F) * radii.cwiseProduct(out);
    const Vec3 normal = (out + 0.9F * direction(dice)).normalized();
    const Vec3 u = normal.cross(direction(dice)).normalized() * size * dice.uniform(0.5F, 1.3F);
    const Vec3 v = normal.cross(u) * dice.uniform(0.5F, 0.9F);
    b.begin(5.0F);
    b.triangle(at - u - 0.6F * v, at + u - 0.6F * v, at + 1.1F * v, dice.pick(leaves));
  }
}

struct Cluster {
  Vec3 centre, radii;
};

std::vector<Cluster> crownOf(const Vec3& s, float crown_low, int count, Dice& dice) {
  const Vec3 middle(0.0F, 0.0F, 0.5F * (s.z() + crown_low));
  const Vec3 half(0.5F * s.x(), 0.5F * s.y(), 0.5F * (s.z() - crown_low));
  std::vector<Cluster> clusters{{middle, 0.6F * half}};
  for (int i = 0; i < count; ++i) {
    const float z = 1.7F * (static_cast<float>(i) + 0.5F) / static_cast<float>(count) - 0.85F;
    const float a = 2.4F * static_cast<float>(i) + dice.uniform(-0.4F, 0.4F);
    const float r = 0.68F * std::sqrt(std::max(0.05F, 1.0F - z * z));
    const Vec3 at(r * std::cos(a), r * std::sin(a), 0.72F * z);
    clusters.push_back({middle + half.cwiseProduct(at), half * dice.uniform(0.24F, 0.36F)});
  }
  return clusters;
}

void addTrunk(MeshBuilder& b, const Vec3& s, float crown_low, const std::vector<Cluster>& crown,
              int bark, Dice& dice) {
  const float r = std::min(0.028F * s.z(), 0.12F * s.x());
  const Vec3 fork(dice.uniform(-0.02F, 0.02F) * s.z(), dice.uniform(-0.02F, 0.02F) * s.z(),
                  crown_low);
  b.pipe({Vec3::Zero(), {0.0F, 0.0F, 0.04F * s.z()}, 0.5F * fork, fork, crown.front().centre},
         {1.5F * r, r, 0.85F * r, 0.7F * r, 0.2F * r}, 8, bark);
  for (std::size_t i = 1; i < crown.size(); i += 2) {
    b.pipe({fork, 0.5F * (fork + crown[i].centre), crown[i].centre},
           {0.45F * r, 0.3F * r, 0.1F * r}, 5, bark);
  }
}

}  // namespace

Mesh makeTree(const Order& order) {
  Dice dice(order.look_seed ^ 0x73EEULL);
  MeshBuilder b;
  const auto leaves = leafMaterials(b, order, dice);
  const int bark = b.material(
      textured(Vec3::Ones(), sharedTexture(TextureKind::kBark, order.look_seed, dice, 256)), 0.7F);
  const Vec3 s = order.size.cast<float>();
  const float crown_low = dice.uniform(0.24F, 0.38F) * s.z();
  const auto crown = crownOf(s, crown_low, 10 + dice.below(4), dice);
  addTrunk(b, s, crown_low, crown, bark, dice);
  const float sheet = 0.05F * (s.x() + s.y()) / 2.0F + 0.05F;
  for (const Cluster& c : crown) {
    addLump(b, c.centre, 0.95F * c.radii, dice.pick(leaves), dice);
    addSheets(b, c.centre, c.radii, 64, sheet, leaves, dice);
  }
  return b.finish(order.size);
}

Mesh makeHedge(const Order& order) {
  Dice dice(order.look_seed ^ 0x4ED6EULL);
  MeshBuilder b;
  const auto leaves = leafMaterials(b, order, dice);
  const Vec3 s = order.size.cast<float>(), half = s / 2.0F;
  b.box(-0.9F * half + Vec3(0.0F, 0.0F, -0.1F * half.z()), 0.9F * half, leaves[0]);
  const float area = 2.0F * (s.x() + s.y()) * s.z() + s.x() * s.y();
  const int count = std::clamp(static_cast<int>(area * 45.0F), 100, 1000);
  const float sheet = std::clamp(0.75F * std::sqrt(area / static_cast<float>(count)), 0.05F, 0.3F);
  for (int i = 0; i < count; ++i) {
    Vec3 at(dice.uniform(-1.0F, 1.0F), dice.uniform(-1.0F, 1.0F), dice.uniform(-1.0F, 1.0F));
    const float where = dice.uniform(0.0F, area);
    const Eigen::Index axis = where < s.x() * s.y()                    ? 2
                              : where < s.x() * (s.y() + 2.0F * s.z()) ? 1
                                                                       : 0;
    at[axis] = axis == 2 || dice.chance(0.5F) ? 1.0F : -1.0F;
    const Vec3 normal = (Vec3::Unit(axis) * at[axis] + 0.9F * direction(dice)).normalized();
    const Vec3 u = normal.cross(direction(dice)).normalized() * sheet * dice.uniform(0.5F, 1.1F);
    const Vec3 v = normal.cross(u) * dice.uniform(0.5F, 0.9F);
    const Vec3 centre = 0.92F * half.cwiseProduct(at);
    b.begin(5.0F);
    b.triangle(centre - u, centre + u, centre + 1.2F * v, dice.pick(leaves));
  }
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes
