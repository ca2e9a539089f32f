
#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/furniture/cushion.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
Mesh makeCouch(const Order& order) {
  Dice dice(order.look_seed ^ 0xC0CULL);
  const std::string shape = chosenShape(order, "couch", {"two seats", "three seats"});
  MeshBuilder b;
  const auto cloth = sharedTexture(TextureKind::kFabric, order.look_seed, dice, 256);
  const Vec3 colour = clothColour(dice);
  const bool leather = dice.chance(0.3F);
  const int cover =
      leather ? b.material(plain(colour, 0.35F)) : b.material(textured(colour, cloth), 0.8F);
  const int pillow = b.material(textured(clothColour(dice), cloth), 0.5F);
  const int feet = b.material(plain({0.04F, 0.03F, 0.02F}, 0.2F));
  const Vec3 s = order.size.cast<float>();
  const float x = s.x() / 2.0F, y = s.y() / 2.0F, arm = dice.uniform(0.12F, 0.22F);
  const float foot = dice.uniform(0.04F, 0.13F), back = dice.uniform(0.18F, 0.24F);
  const float seat = 0.5F * s.z(), arm_top = dice.uniform(0.62F, 0.78F) * s.z(), round = 0.035F;
  addCushion(b, {-x, -y, foot}, {0.96F * x, y, 0.62F * seat}, 0.02F, cover);
  addCushion(b, {-x, -y + 0.7F * arm, foot}, {-x + back, y - 0.7F * arm, 0.93F * s.z()}, round,
             cover);
  addCushion(b, {-x, y - arm, foot}, {0.95F * x, y, arm_top}, round, cover);
  addCushion(b, {-x, -y, foot}, {0.95F * x, -y + arm, arm_top}, round, cover);
  const int seats = shape == "two seats" ? 2 : 3;
  const float width = (s.y() - 2.0F * arm) / static_cast<float>(seats);
  for (int i = 0; i < seats; ++i) {
    const float from = -y + arm + width * static_cast<float>(i) + 0.006F,
                to = from + width - 0.012F;
    addCushion(b, {-x + 0.7F * back, from, 0.6F * seat}, {x, to, seat}, round, cover);
    addCushion(b, {-x + 0.8F * back, from, seat - 0.01F}, {-x + 1.8F * back, to, s.z()},
               1.4F * round, cover);
    if (!dice.chance(0.25F)) continue;
    addCushion(b, {-x + 1.75F * back, from + 0.1F * width, seat},
               {-x + 2.3F * back, from + 0.75F * width, seat + 0.32F * s.z()}, round, pillow);
  }
  for (float i : {0.85F, -0.9F}) {
    for (float j : {0.92F, -0.92F})
      b.tube({i * x, j * y, 0.0F}, {i * x, j * y, foot + 0.01F}, 0.02F, 0.028F, 6, feet);
  }
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes
