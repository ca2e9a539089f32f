#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
namespace {

struct MonitorMaterials {
  int shell, screen, stand;
};

/// The panel faces +x; `s` is the size of the whole monitor.
void addPanel(MeshBuilder& b, const Vec3& s, const MonitorMaterials& m, float low, float bezel) {
  const float y = s.y() / 2.0F, front = 0.1F * s.x();
  b.box({front - 0.02F, -y, low}, {front, y, s.z()}, m.shell);
  b.box({front - 0.05F, -0.6F * y, low + 0.2F * (s.z() - low)},
        {front - 0.019F, 0.6F * y, s.z() - 0.2F * (s.z() - low)}, m.shell);
  b.begin();
  const float x = front + 0.0015F, in = y - bezel;
  b.picture({x, -in, low + 1.6F * bezel}, {x, in, low + 1.6F * bezel}, {x, in, s.z() - bezel},
            {x, -in, s.z() - bezel}, m.screen);
}

void addStand(MeshBuilder& b, const Vec3& s, const MonitorMaterials& m, float low, bool round) {
  const float x = 0.5F * s.x(), neck = 0.03F;
  if (round) {
    b.placing = Eigen::Affine3f(Eigen::Scaling(x, 0.26F * s.y(), 1.0F));
    b.tube({0.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 0.014F}, 1.0F, 0.96F, 20, m.stand);
    b.placing.setIdentity();
  } else {
    b.box({-x, -0.25F * s.y(), 0.0F}, {x, 0.25F * s.y(), 0.014F}, m.stand);
  }
  const float back = 0.1F * s.x() - 0.07F;
  b.box({back, -neck, 0.01F}, {back + 0.025F, neck, low + 0.35F * (s.z() - low)}, m.stand);
}

void addFeet(MeshBuilder& b, const Vec3& s, const MonitorMaterials& m, float low) {
  const float x = 0.5F * s.x();
  for (float y : {0.33F * s.y(), -0.33F * s.y()}) {
    b.tube({-x, y, 0.008F}, {0.0F, y, low + 0.02F}, 0.008F, 0.012F, 5, m.stand);
    b.tube({x, y, 0.008F}, {0.0F, y, low + 0.02F}, 0.008F, 0.012F, 5, m.stand);
  }
}

}  // namespace

Mesh makeMonitor(const Order& order) {
  Dice dice(order.look_seed ^ 0x303ULL);
  const std::string shape = chosenShape(order, "monitor", {"desk", "television"});
  MeshBuilder b;
  const auto picture = sharedTexture(TextureKind::kScreen, order.look_seed, dice, 256);
  Material screen = textured({0.9F, 0.9F, 0.9F}, picture, 0.3F);
  screen.emission = dice.uniform(0.5F, 1.0F);
  const float tone = dice.chance(0.75F) ? dice.uniform(0.01F, 0.04F) : dice.uniform(0.5F, 0.75F);
  MonitorMaterials m{};
  m.shell = b.material(plain({tone, tone, tone}, 0.25F));
  m.screen = b.material(screen);
  m.stand = dice.chance(0.3F) ? b.material(chrome()) : m.shell;
  const Vec3 size = order.size.cast<float>();
  const bool television = shape == "television";
  const float low =
      size.z() * (television ? dice.uniform(0.06F, 0.12F) : dice.uniform(0.18F, 0.3F));
  addPanel(b, size, m, low, dice.uniform(0.006F, 0.018F));
  if (television) {
    addFeet(b, size, m, low);
  } else {
    addStand(b, size, m, low, dice.chance(0.5F));
  }
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes
