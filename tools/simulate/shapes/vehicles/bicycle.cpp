#include <cmath>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
namespace {

constexpr float kWheel = 0.335F;

struct Bicycle {
  int frame, rubber, metal, spokes, saddle;
};

/// Adds a wheel; its spokes are thin two-sided strips in the wheel's plane.
void addWheel(MeshBuilder& b, const Bicycle& m, float x) {
  const Vec3 hub(x, 0.0F, kWheel);
  b.torus(hub, Vec3::UnitY(), kWheel - 0.02F, 0.02F, 22, 5, m.rubber);
  b.torus(hub, Vec3::UnitY(), kWheel - 0.043F, 0.008F, 22, 4, m.metal);
  b.tube(hub - Vec3(0.0F, 0.04F, 0.0F), hub + Vec3(0.0F, 0.04F, 0.0F), 0.022F, 0.022F, 6, m.metal);
  b.begin(5.0F);
  constexpr int kSpokes = 12;
  for (int i = 0; i < kSpokes; ++i) {
    const float a = 2.0F * kPi * static_cast<float>(i) / kSpokes;
    const Vec3 along(std::cos(a), 0.0F, std::sin(a)), side(-std::sin(a), 0.0F, std::cos(a));
    const Vec3 from = hub + 0.015F * along, to = hub + (kWheel - 0.045F) * along;
    b.quad(from - 0.0025F * side, to - 0.0025F * side, to + 0.0025F * side, from + 0.0025F * side,
           m.spokes);
  }
}

void addFrame(MeshBuilder& b, const Bicycle& m, float drop) {
  const Vec3 rear(-0.52F, 0.0F, kWheel), front(0.55F, 0.0F, kWheel), crank(-0.08F, 0.0F, 0.29F);
  const Vec3 seat(-0.22F, 0.0F, 0.83F), head(0.38F, 0.0F, 0.86F), head_low(0.41F, 0.0F, 0.72F);
  const Vec3 top = seat + drop * (crank - seat);
  b.tube(top, head, 0.018F, 0.018F, 6, m.frame);
  b.tube(crank, head_low, 0.021F, 0.021F, 6, m.frame);
  b.tube(crank, seat, 0.017F, 0.017F, 6, m.frame);
  b.tube(head_low, head + 0.06F * (head - head_low).normalized(), 0.021F, 0.021F, 6, m.frame);
  for (float side : {1.0F, -1.0F}) {
    const Vec3 off(0.0F, side * 0.05F, 0.0F);
    b.tube(rear + off, crank + 0.4F * off, 0.01F, 0.01F, 5, m.frame);
    b.tube(rear + off, seat + 0.3F * off - Vec3(0.0F, 0.0F, 0.06F), 0.009F, 0.009F, 5, m.frame);
    b.pipe({front + off, head_low + off * 0.9F}, {0.011F, 0.014F}, 5, m.frame);
    b.tube(crank + 0.9F * off, crank + 1.3F * off + Vec3(side * 0.12F, 0.0F, -side * 0.1F), 0.01F,
           0.01F, 4, m.metal);
    const Vec3 pedal = crank + 1.3F * off + Vec3(side * 0.12F, side * 0.05F, -side * 0.1F);
    b.box(pedal - Vec3(0.045F, 0.045F, 0.01F), pedal + Vec3(0.045F, 0.045F, 0.01F), m.rubber);
  }
  b.tube(crank - Vec3(0.0F, 0.045F, 0.0F), crank - Vec3(0.0F, 0.035F, 0.0F), 0.09F, 0.09F, 12,
         m.metal);
}

void addSeatAndBars(MeshBuilder& b, const Bicycle& m, bool racing) {
  b.tube({-0.22F, 0.0F, 0.83F}, {-0.25F, 0.0F, 0.95F}, 0.013F, 0.013F, 6, m.metal);
  b.ellipsoid({-0.29F, 0.0F, 0.97F}, {0.1F, 0.075F, 0.032F}, 8, 5, m.saddle);
  b.ellipsoid({-0.17F, 0.0F, 0.97F}, {0.1F, 0.028F, 0.024F}, 7, 4, m.saddle);
  const Vec3 stem(0.365F, 0.0F, 0.93F);
  b.tube(stem, stem + Vec3(0.05F, 0.0F, 0.08F), 0.014F, 0.014F, 6, m.metal);
  const Vec3 bar = stem + Vec3(0.05F, 0.0F, 0.08F);
  for (float side : {1.0F, -1.0F}) {
    const Vec3 wide = bar + Vec3(racing ? 0.1F : -0.02F, side * 0.22F, 0.03F);
    const Vec3 grip =
        wide + (racing ? Vec3(0.0F, side * 0.01F, -0.13F) : Vec3(-0.13F, side * 0.06F, 0.0F));
    b.pipe({bar, bar + Vec3(0.0F, side * 0.1F, 0.015F), wide}, {0.012F, 0.012F, 0.012F}, 5,
           m.metal);
    b.tube(wide, grip, 0.016F, 0.016F, 6, m.rubber);
  }
}

void addBasket(MeshBuilder& b, int material) {
  const Vec3 low(0.46F, -0.17F, 0.78F), high(0.74F, 0.17F, 0.99F);
  constexpr float kSheet = 0.008F;
  b.box(low, {high.x(), high.y(), low.z() + kSheet}, material);
  b.box(low, {low.x() + kSheet, high.y(), high.z()}, material);
  b.box({high.x() - kSheet, low.y(), low.z()}, high, material);
  b.box(low, {high.x(), low.y() + kSheet, high.z()}, material);
  b.box({low.x(), high.y() - kSheet, low.z()}, high, material);
}

}  // namespace

Mesh makeBicycle(const Order& order) {
  Dice dice(order.look_seed ^ 0xB1CULL);
  const std::string shape = chosenShape(order, "bicycle", {"city", "racing"});
  MeshBuilder b;
  Bicycle m{};
  m.frame = b.material(plain(paintColour(dice), 0.5F));
  m.rubber = b.material(rubber());
  m.metal = b.material(chrome());
  Material strips = chrome();
  strips.two_sided = true;
  m.spokes = b.material(strips);
  m.saddle = b.material(plain(Vec3(0.05F, 0.03F, 0.02F) * dice.uniform(0.3F, 3.0F), 0.2F));
  addWheel(b, m, -0.52F);
  addWheel(b, m, 0.55F);
  addFrame(b, m, shape == "city" ? dice.uniform(0.0F, 0.5F) : 0.0F);
  addSeatAndBars(b, m, shape == "racing");
  if (shape == "city" && dice.chance(0.4F)) addBasket(b, b.material(plain({0.25F, 0.17F, 0.1F})));
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes
