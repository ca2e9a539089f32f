#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/shapes.h"
#include "tools/simulate/shapes/vehicles/vehicle_body.h"
#include "tools/simulate/shapes/vehicles/vehicle_parts.h"

namespace perdure::tools::shapes {
namespace {

BodyProfile panelVan() {
  BodyProfile p;
  p.top = {{0.0F, 0.38F},   {0.02F, 0.44F}, {0.06F, 0.49F}, {0.17F, 0.56F}, {0.29F, 0.92F},
           {0.34F, 0.975F}, {0.45F, 1.0F},  {0.97F, 0.99F}, {1.0F, 0.97F}};
  p.belt = {{0.0F, 0.36F}, {0.06F, 0.44F}, {0.18F, 0.5F}, {1.0F, 0.53F}};
  p.windscreen = {0.172F, 0.29F};
  p.rear_glass = {};
  p.side_glass = {{0.2F, 0.35F}};
  p.seams = {0.19F, 0.365F, 0.6F};
  p.front_axle = 0.17F;
  p.rear_axle = 0.78F;
  p.wheel_radius = 0.155F;
  p.sill = 0.11F;
  p.roof_width = 0.87F;
  p.nose_taper = 0.16F;
  p.tail_taper = 0.03F;
  p.rear_doors_with_glass = true;
  return p;
}

BodyProfile minibus() {
  BodyProfile p = panelVan();
  p.side_glass = {{0.2F, 0.35F}, {0.375F, 0.58F}, {0.6F, 0.77F}, {0.79F, 0.95F}};
  return p;
}

/// The cab of a box van ends behind its door.
BodyProfile cab() {
  BodyProfile p = panelVan();
  p.top = {{0.0F, 0.33F},  {0.02F, 0.38F}, {0.06F, 0.42F},  {0.16F, 0.48F}, {0.27F, 0.76F},
           {0.31F, 0.79F}, {0.37F, 0.8F},  {0.375F, 0.36F}, {0.98F, 0.36F}, {1.0F, 0.35F}};
  p.belt = {{0.0F, 0.3F},   {0.06F, 0.37F}, {0.18F, 0.43F},
            {0.37F, 0.44F}, {0.38F, 0.25F}, {1.0F, 0.25F}};
  p.windscreen = {0.165F, 0.27F};
  p.side_glass = {{0.19F, 0.335F}};
  p.seams = {0.18F, 0.345F};
  p.rear_doors_with_glass = false;
  p.wheel_radius = 0.14F;
  return p;
}

void addBox(MeshBuilder& b, const Vec3& size, const Order& order, Dice& dice) {
  const auto sheet = sharedTexture(TextureKind::kMetal, order.look_seed, dice, 128);
  const int skin =
      b.material(textured(Vec3::Constant(dice.uniform(0.75F, 0.95F)), sheet, 0.2F), 2.0F);
  const int stripe = b.material(plain(paintColour(dice), 0.3F));
  const float x0 = -0.5F * size.x(), x1 = 0.11F * size.x(), y = 0.5F * size.y();
  const float z0 = 0.3F * size.z(), z1 = size.z();
  b.box({x0, -y, z0}, {x1, y, z1}, skin);
  const float low = dice.uniform(0.4F, 0.6F) * size.z(),
              tall = dice.uniform(0.06F, 0.2F) * size.z();
  for (float side : {1.0F, -1.0F}) {
    b.box({0.96F * x0, side * y - 0.004F, low}, {0.9F * x1, side * y + 0.004F, low + tall}, stripe);
  }
}

}  // namespace

Mesh makeVan(const Order& order) {
  Dice dice(order.look_seed ^ 0xFA4ULL);
  const std::string shape = chosenShape(order, "van", {"panel van", "minibus", "box van"});
  BodyProfile profile = shape == "minibus" ? minibus() : shape == "box van" ? cab() : panelVan();
  profile.wheel_radius *= dice.uniform(0.95F, 1.05F);
  profile.roof_width += dice.uniform(-0.02F, 0.03F);
  profile.split_grille = dice.chance(0.6F);
  MeshBuilder builder;
  addVehicle(builder, profile, order, dice, false);
  if (shape == "box van") {
    addBox(builder, order.size.cast<float>().cwiseProduct(Vec3(1.0F, 0.97F, 1.0F)), order, dice);
  }
  return builder.finish(order.size);
}

}  // namespace perdure::tools::shapes
