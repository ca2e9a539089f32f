#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
namespace {

void addRectangular(MeshBuilder& b, const Vec3& s, int top, int legs, Dice& dice) {
  const float x = s.x() / 2.0F, y = s.y() / 2.0F, thick = dice.uniform(0.025F, 0.05F);
  const float leg = dice.uniform(0.03F, 0.05F), in = leg + dice.uniform(0.01F, 0.08F);
  b.box({-x, -y, s.z() - thick}, {x, y, s.z()}, top);
  for (float i : {1.0F, -1.0F}) {
    for (float j : {1.0F, -1.0F}) {
      const Vec3 foot(i * (x - in), j * (y - in), 0.0F);
      b.box(foot - Vec3(leg, leg, 0.0F), foot + Vec3(leg, leg, s.z() - thick), legs);
    }
    b.box({-x + in, i * (y - in) - 0.012F, s.z() - thick - 0.09F},
          {x - in, i * (y - in) + 0.012F, s.z() - thick}, legs);
    b.box({i * (x - in) - 0.012F, -y + in, s.z() - thick - 0.09F},
          {i * (x - in) + 0.012F, y - in, s.z() - thick}, legs);
  }
}

void addRound(MeshBuilder& b, const Vec3& s, int top, int legs, Dice& dice) {
  const float thick = dice.uniform(0.025F, 0.045F);
  b.placing = Eigen::Affine3f(Eigen::Scaling(s.x() / 2.0F, s.y() / 2.0F, 1.0F));
  b.tube({0.0F, 0.0F, s.z() - thick}, {0.0F, 0.0F, s.z()}, 1.0F, 1.0F, 28, top);
  b.tube({0.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 0.03F}, 0.5F, 0.46F, 20, legs);
  b.placing.setIdentity();
  b.pipe({{0.0F, 0.0F, 0.02F},
          {0.0F, 0.0F, 0.12F},
          {0.0F, 0.0F, 0.6F * s.z()},
          {0.0F, 0.0F, s.z() - thick}},
         {0.12F, 0.05F, 0.045F, 0.13F}, 12, legs);
}

void addTrestle(MeshBuilder& b, const Vec3& s, int top, int legs, Dice& dice) {
  const float x = s.x() / 2.0F, y = s.y() / 2.0F, thick = dice.uniform(0.03F, 0.06F);
  b.box({-x, -y, s.z() - thick}, {x, y, s.z()}, top);
  for (float i : {1.0F, -1.0F}) {
    const float at = i * 0.68F * x;
    for (float j : {1.0F, -1.0F}) {
      for (float spread : {0.16F, -0.16F}) {
        b.tube({at + spread, j * 0.8F * y, 0.0F},
               {at + 0.2F * spread, j * 0.7F * y, s.z() - thick - 0.03F}, 0.028F, 0.028F, 4, legs);
      }
    }
    b.box({at - 0.04F, -0.85F * y, s.z() - thick - 0.06F}, {at + 0.04F, 0.85F * y, s.z() - thick},
          legs);
    b.box({at - 0.015F, -0.74F * y, 0.25F}, {at + 0.015F, 0.74F * y, 0.29F}, legs);
  }
}

/// Adds up to three items such as plates on the table; they count for its height.
void addThings(MeshBuilder& b, const Vec3& s, Dice& dice) {
  const int count = dice.below(4);
  for (int i = 0; i < count; ++i) {
    const int m = b.material(plain(paintColour(dice), 0.4F));
    const Vec3 at(dice.uniform(-0.3F, 0.3F) * s.x(), dice.uniform(-0.3F, 0.3F) * s.y(), s.z());
    const float tall = dice.uniform(0.02F, 0.1F), wide = dice.uniform(0.04F, 0.11F);
    b.tube(at, at + Vec3(0.0F, 0.0F, tall), 0.7F * wide, wide, 10, m);
  }
}

}  // namespace

Mesh makeTable(const Order& order) {
  Dice dice(order.look_seed ^ 0x7AB1EULL);
  const std::string shape = chosenShape(order, "dining table", {"rectangular", "round", "trestle"});
  MeshBuilder b;
  const auto wood = sharedTexture(TextureKind::kTimber, order.look_seed, dice, 256);
  const Vec3 tint = woodColour(dice);
  const int top = dice.chance(0.75F) ? b.material(textured(tint, wood, 0.25F), 1.1F)
                                     : b.material(plain({0.75F, 0.74F, 0.72F}, 0.3F));
  const int legs = dice.chance(0.6F) ? b.material(textured(tint, wood, 0.15F), 1.1F)
                                     : b.material(plain({0.05F, 0.05F, 0.05F}, 0.3F));
  const Vec3 size = order.size.cast<float>();
  if (shape == "round") {
    addRound(b, size, top, legs, dice);
  } else if (shape == "trestle") {
    addTrestle(b, size, top, legs, dice);
  } else {
    addRectangular(b, size, top, legs, dice);
  }
  if (dice.chance(0.3F)) addThings(b, size, dice);
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes
