#include <cmath>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/furniture/cushion.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
namespace {

struct ChairMaterials {
  int frame, seat;
};

/// The chair's front is +x. Dimensions in metres, for a chair of 0.5 × 0.5 × 0.9 m.
void addSeatAndLegs(MeshBuilder& b, const ChairMaterials& m, bool round, Dice& dice) {
  const float splay = dice.uniform(0.0F, 0.04F), thick = dice.uniform(0.015F, 0.024F);
  b.box({-0.21F, -0.22F, 0.43F}, {0.23F, 0.22F, 0.475F}, m.seat);
  for (float x : {1.0F, -1.0F}) {
    for (float y : {1.0F, -1.0F}) {
      const Vec3 top(x * 0.19F, y * 0.19F, 0.44F),
          foot(x * (0.2F + splay), y * (0.2F + splay), 0.0F);
      if (round) {
        b.tube(foot, top, thick * 0.8F, thick * 1.1F, 8, m.frame);
      } else {
        b.tube(foot, top, thick, thick * 1.4F, 4, m.frame);
      }
    }
  }
  if (dice.chance(0.5F)) {
    for (float y : {0.19F, -0.19F})
      b.tube({-0.19F, y, 0.2F}, {0.19F, y, 0.2F}, 0.01F, 0.01F, 6, m.frame);
  }
}

void addBack(MeshBuilder& b, const ChairMaterials& m, Dice& dice) {
  const float lean = dice.uniform(0.03F, 0.1F);
  const auto at = [&](float y, float z) { return Vec3(-0.2F - lean * (z - 0.45F) / 0.45F, y, z); };
  for (float y : {0.19F, -0.19F}) b.tube(at(y, 0.4F), at(y, 0.9F), 0.019F, 0.016F, 6, m.frame);
  const int style = dice.below(3);
  if (style == 0) {  // horizontal slats
    for (float z : {0.6F, 0.72F, 0.84F}) {
      b.box(at(-0.19F, z) - Vec3(0.01F, 0.0F, 0.03F), at(0.19F, z) + Vec3(0.01F, 0.0F, 0.03F),
            m.frame);
    }
  } else if (style == 1) {  // vertical bars
    for (float y : {-0.12F, -0.04F, 0.04F, 0.12F})
      b.tube(at(y, 0.47F), at(y, 0.88F), 0.009F, 0.009F, 6, m.frame);
    b.box(at(-0.2F, 0.88F) - Vec3(0.014F, 0.0F, 0.03F), at(0.2F, 0.88F) + Vec3(0.014F, 0.0F, 0.03F),
          m.frame);
  } else {  // a panel
    b.box(at(-0.185F, 0.72F) - Vec3(0.012F, 0.0F, 0.17F),
          at(0.185F, 0.72F) + Vec3(0.012F, 0.0F, 0.17F), m.seat);
  }
}

void addOffice(MeshBuilder& b, const ChairMaterials& m, Dice& dice) {
  for (int i = 0; i < 5; ++i) {
    const float a = 2.0F * kPi * static_cast<float>(i) / 5.0F + 0.2F;
    const Vec3 tip(0.28F * std::cos(a), 0.28F * std::sin(a), 0.075F);
    b.tube({0.0F, 0.0F, 0.11F}, tip, 0.026F, 0.018F, 5, m.frame);
    b.ellipsoid({tip.x(), tip.y(), 0.03F}, {0.03F, 0.03F, 0.03F}, 6, 4, m.frame);
  }
  b.tube({0.0F, 0.0F, 0.09F}, {0.0F, 0.0F, 0.43F}, 0.028F, 0.02F, 8, m.frame);
  b.ellipsoid({0.02F, 0.0F, 0.47F}, {0.25F, 0.25F, 0.055F}, 12, 6, m.seat);
  b.pipe({{-0.12F, 0.0F, 0.43F}, {-0.27F, 0.0F, 0.46F}, {-0.27F, 0.0F, 0.7F}},
         {0.018F, 0.022F, 0.018F}, 6, m.frame);
  b.ellipsoid({-0.235F, 0.0F, 0.78F}, {0.04F, 0.22F, 0.27F}, 12, 8, m.seat);
  if (dice.chance(0.6F)) {
    for (float y : {0.27F, -0.27F}) {
      b.pipe({{-0.05F, 0.8F * y, 0.44F}, {-0.05F, y, 0.5F}, {-0.05F, y, 0.65F}},
             {0.014F, 0.014F, 0.014F}, 5, m.frame);
      b.box({-0.16F, y - 0.035F, 0.65F}, {0.12F, y + 0.035F, 0.68F}, m.frame);
    }
  }
}

void addArmchair(MeshBuilder& b, const ChairMaterials& m, Dice& dice) {
  const float arm = dice.uniform(0.56F, 0.66F), foot = dice.uniform(0.1F, 0.2F);
  const float wide = dice.uniform(0.08F, 0.12F);
  addCushion(b, {-0.28F, -0.26F, foot}, {0.27F, 0.26F, 0.34F}, 0.02F, m.seat);
  addCushion(b, {-0.22F, -0.3F + wide, 0.32F}, {0.3F, 0.3F - wide, 0.46F}, 0.035F, m.seat);
  addCushion(b, {-0.34F, -0.29F, foot}, {-0.2F, 0.29F, 0.9F}, 0.045F, m.seat);
  for (float side : {1.0F, -1.0F}) {
    const float y0 = side > 0.0F ? 0.31F - wide : -0.31F;
    addCushion(b, {-0.3F, y0, foot}, {0.28F, y0 + wide, arm}, 0.03F, m.seat);
    for (float x : {0.22F, -0.28F}) {
      b.tube({x, side * 0.25F, 0.0F}, {x, side * 0.25F, foot + 0.01F}, 0.015F, 0.022F, 6, m.frame);
    }
  }
}

}  // namespace

Mesh makeChair(const Order& order) {
  Dice dice(order.look_seed ^ 0xC4AULL);
  const std::string shape =
      chosenShape(order, "chair", {"wooden", "kitchen", "office", "armchair"});
  MeshBuilder b;
  ChairMaterials m{};
  const auto wood = sharedTexture(TextureKind::kTimber, order.look_seed, dice, 128);
  const auto cloth = sharedTexture(TextureKind::kFabric, order.look_seed, dice, 128);
  const bool wooden = shape == "wooden" || shape == "armchair";
  m.frame =
      wooden ? b.material(textured(woodColour(dice), wood, 0.15F), 0.8F)
             : b.material(plain(
                   dice.chance(0.5F) ? Vec3(0.03F, 0.03F, 0.03F) : Vec3(0.5F, 0.5F, 0.52F), 0.4F));
  m.seat = shape == "wooden" && dice.chance(0.6F)
               ? m.frame
               : b.material(textured(clothColour(dice), cloth), 0.5F);
  if (shape == "office") {
    addOffice(b, m, dice);
  } else if (shape == "armchair") {
    addArmchair(b, m, dice);
  } else {
    addSeatAndLegs(b, m, shape == "kitchen", dice);
    addBack(b, m, dice);
  }
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes
