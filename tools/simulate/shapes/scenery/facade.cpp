#include <algorithm>
#include <cmath>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
namespace {

constexpr float kOverhang = 0.16F;  // metres from the wall to the front of cornice and ledges

struct Look {
  int wall, base, frame, ledge, door, roof;
  std::array<int, 3> panes;
  int sign, shutter;
  float storey, bay, window_width, window_height, sill, recess;
  bool ledges, bars, bands, shutters, shop;
};

/// One side of the house: u points right (seen from outside), z up, out away from the house.
class Side {
 public:
  Side(MeshBuilder& b, const Look& look, const Vec3& origin, const Vec3& right, float width,
       float height, Dice& dice)
      : b_(b),
        l_(look),
        o_(origin),
        r_(right),
        out_(right.cross(Vec3::UnitZ())),
        w_(width),
        h_(height),
        dice_(dice) {}

  void addBlind() {
    b_.begin();
    panel(0.0F, w_, 0.0F, h_, 0.0F, l_.wall);
    ledge(-kOverhang, w_ + kOverhang, h_ - 0.3F, 0.3F, kOverhang);
  }

  void add(bool front) {
    front_ = front;
    const int bays = std::max(1, static_cast<int>(std::lround(w_ / l_.bay)));
    const int storeys = std::max(1, static_cast<int>(std::lround(h_ / l_.storey)));
    const float bay = w_ / static_cast<float>(bays), storey = h_ / static_cast<float>(storeys);
    const int door = dice_.below(bays);
    for (int s = 0; s < storeys; ++s) {
      for (int i = 0; i < bays; ++i) {
        cell(bay * static_cast<float>(i), storey * static_cast<float>(s), bay, storey,
             s == 0 && i == door, s == 0);
      }
      if (s > 0 && l_.bands) ledge(0.0F, w_, storey * static_cast<float>(s), 0.12F, 0.06F);
    }
    if (shop()) shopFront(storey);
    ledge(-kOverhang, w_ + kOverhang, h_ - 0.3F, 0.3F, kOverhang);
    ledge(0.0F, w_, 0.0F, std::min(0.5F, 0.2F * h_), 0.05F, l_.base);
  }

 private:
  Vec3 at(float u, float z, float out = 0.0F) const {
    return o_ + u * r_ + Vec3(0.0F, 0.0F, z) + out * out_;
  }

  void panel(float u0, float u1, float z0, float z1, float out, int material) {
    b_.quad(at(u0, z0, out), at(u1, z0, out), at(u1, z1, out), at(u0, z1, out), material);
  }

  void block(float u0, float u1, float z0, float z1, float from, float to, int material) {
    b_.begin();
    panel(u0, u1, z0, z1, to, material);
    b_.quad(at(u0, z1, to), at(u1, z1, to), at(u1, z1, from), at(u0, z1, from), material);
    b_.quad(at(u0, z0, from), at(u1, z0, from), at(u1, z0, to), at(u0, z0, to), material);
    b_.quad(at(u0, z0, from), at(u0, z0, to), at(u0, z1, to), at(u0, z1, from), material);
    b_.quad(at(u1, z0, to), at(u1, z0, from), at(u1, z1, from), at(u1, z1, to), material);
  }

  void ledge(float u0, float u1, float z, float tall, float out, int material = -1) {
    block(u0, u1, z, z + tall, 0.0F, out, material < 0 ? l_.ledge : material);
  }

  bool shop() const { return front_ && l_.shop && w_ > 5.0F; }

  void shopFront(float storey) {
    const float z = std::min(2.75F, storey - 0.55F), from = 0.06F * w_, to = 0.94F * w_;
    block(from, to, z, z + 0.5F, 0.0F, 0.08F, l_.frame);
    b_.begin();
    b_.picture(at(from + 0.1F, z + 0.04F, 0.085F), at(to - 0.1F, z + 0.04F, 0.085F),
               at(to - 0.1F, z + 0.46F, 0.085F), at(from + 0.1F, z + 0.46F, 0.085F), l_.sign);
  }

  void cell(float u, float z, float bay, float storey, bool door, bool ground) {
    const bool display = ground && shop() && !door;
    const float half = 0.5F * (door      ? 1.15F
                               : display ? 0.86F * bay
                                         : std::min(l_.window_width, 0.75F * bay));
    const float u0 = u + 0.5F * bay - half, u1 = u + 0.5F * bay + half;
    const float z0 = z + (door ? 0.02F : display ? 0.55F : l_.sill);
    const float z1 = std::min(z + (door      ? 2.3F
                                   : display ? 2.6F
                                             : l_.sill + l_.window_height),
                              z + storey - (display ? 0.6F : 0.25F));
    const int wall = ground ? l_.base : l_.wall;
    b_.begin();
    if (z1 - z0 < 0.4F || bay < 0.9F) return panel(u, u + bay, z, z + storey, 0.0F, l_.wall);
    panel(u, u0, z, z + storey, 0.0F, wall);
    panel(u1, u + bay, z, z + storey, 0.0F, wall);
    panel(u0, u1, z, z0, 0.0F, wall);
    panel(u0, u1, z1, z + storey, 0.0F, wall);
    reveal(u0, u1, z0, z1);
    if (door) return doorIn(u0, u1, z0, z1);
    windowIn(u0, u1, z0, z1);
    if (!l_.shutters || display || ground) return;
    const float wide = std::min(0.5F * (u1 - u0), u0 - u - 0.05F);
    if (wide < 0.2F) return;
    block(u0 - wide, u0 - 0.02F, z0, z1, 0.0F, 0.04F, l_.shutter);
    block(u1 + 0.02F, u1 + wide, z0, z1, 0.0F, 0.04F, l_.shutter);
  }

  void reveal(float u0, float u1, float z0, float z1) {
    const float in = -l_.recess;
    b_.begin();
    b_.quad(at(u0, z0, 0.0F), at(u0, z0, in), at(u0, z1, in), at(u0, z1, 0.0F), l_.ledge);
    b_.quad(at(u1, z0, in), at(u1, z0, 0.0F), at(u1, z1, 0.0F), at(u1, z1, in), l_.ledge);
    b_.quad(at(u0, z1, in), at(u1, z1, in), at(u1, z1, 0.0F), at(u0, z1, 0.0F), l_.ledge);
    b_.quad(at(u0, z0, 0.0F), at(u1, z0, 0.0F), at(u1, z0, in), at(u0, z0, in), l_.ledge);
  }

  void windowIn(float u0, float u1, float z0, float z1) {
    constexpr float kFrame = 0.07F;
    const float glass = -l_.recess, front = glass + 0.05F;
    b_.begin();
    b_.picture(at(u0, z0, glass), at(u1, z0, glass), at(u1, z1, glass), at(u0, z1, glass),
               dice_.pick(l_.panes));
    block(u0, u0 + kFrame, z0, z1, glass, front, l_.frame);
    block(u1 - kFrame, u1, z0, z1, glass, front, l_.frame);
    block(u0, u1, z0, z0 + kFrame, glass, front, l_.frame);
    block(u0, u1, z1 - kFrame, z1, glass, front, l_.frame);
    const float middle = 0.5F * (u0 + u1);
    if (l_.bars) block(middle - 0.03F, middle + 0.03F, z0, z1, glass, front, l_.frame);
    const float bar = z0 + 0.68F * (z1 - z0);
    if (l_.bars) block(u0, u1, bar - 0.025F, bar + 0.025F, glass, front, l_.frame);
    block(u0 - 0.08F, u1 + 0.08F, z0 - 0.07F, z0, -0.02F, 0.1F, l_.ledge);
    if (l_.ledges) block(u0 - 0.12F, u1 + 0.12F, z1 + 0.04F, z1 + 0.16F, 0.0F, 0.09F, l_.ledge);
  }

  void doorIn(float u0, float u1, float z0, float z1) {
    const float in = -l_.recess;
    b_.begin();
    panel(u0, u1, z0, z1, in, l_.door);
    const float middle = 0.5F * (u0 + u1), inset = 0.12F * (u1 - u0);
    for (float z : {z0 + 0.2F, z0 + 1.15F}) {
      block(u0 + inset, middle - 0.4F * inset, z, z + 0.8F, in, in + 0.025F, l_.door);
      block(middle + 0.4F * inset, u1 - inset, z, z + 0.8F, in, in + 0.025F, l_.door);
    }
    block(u0 - 0.12F, u0, z0, z1 + 0.12F, 0.0F, 0.05F, l_.ledge);
    block(u1, u1 + 0.12F, z0, z1 + 0.12F, 0.0F, 0.05F, l_.ledge);
    block(u0, u1, z1, z1 + 0.14F, 0.0F, 0.07F, l_.ledge);
    block(u0 - 0.1F, u1 + 0.1F, 0.0F, z0 + 0.08F, 0.0F, 0.14F, l_.base);
  }

  MeshBuilder& b_;
  const Look& l_;
  Vec3 o_, r_, out_;
  float w_, h_;
  Dice& dice_;
  bool front_ = false;
};

int wallMaterial(MeshBuilder& b, const Order& order, Dice& dice) {
  if (dice.chance(0.4F)) {
    const auto brick = sharedTexture(TextureKind::kBrick, order.look_seed, dice, 512);
    return b.material(textured(Vec3::Ones(), brick), 1.25F);
  }
  const auto plaster = sharedTexture(TextureKind::kPlaster, order.look_seed, dice, 512);
  return b.material(textured(plasterColour(dice), plaster), 3.2F);
}

Look lookOf(MeshBuilder& b, const Order& order, Dice& dice) {
  Look l{};
  l.wall = wallMaterial(b, order, dice);
  l.base = dice.chance(0.5F) ? l.wall : wallMaterial(b, order, dice);
  const auto plaster = sharedTexture(TextureKind::kPlaster, order.look_seed, dice, 512);
  l.ledge = b.material(textured(Vec3::Constant(dice.uniform(0.35F, 0.85F)), plaster), 1.1F);
  l.frame = b.material(
      plain(dice.chance(0.7F) ? Vec3(0.75F, 0.74F, 0.72F) : Vec3(0.08F, 0.06F, 0.05F), 0.2F));
  const auto wood = sharedTexture(TextureKind::kTimber, order.look_seed, dice, 256);
  l.door = b.material(textured(0.9F * woodColour(dice), wood, 0.1F), 1.0F);
  l.roof = b.material(plain({0.12F, 0.11F, 0.11F}));
  for (int& pane : l.panes) {
    pane = b.material(textured(
        Vec3::Ones(), sharedTexture(TextureKind::kWindows, order.look_seed, dice, 128), 0.8F));
  }
  l.sign =
      b.material(textured(paintColour(dice).cwiseMax(0.15F),
                          sharedTexture(TextureKind::kSign, order.look_seed, dice, 256), 0.1F));
  l.shutter = b.material(
      textured(paintColour(dice), sharedTexture(TextureKind::kMetal, order.look_seed, dice, 128)),
      0.25F);
  l.storey = dice.uniform(2.9F, 3.7F);
  l.bay = dice.uniform(2.0F, 3.4F);
  l.window_width = dice.uniform(0.95F, 1.5F);
  l.window_height = dice.uniform(1.25F, 1.8F);
  l.sill = dice.uniform(0.8F, 1.0F);
  l.recess = dice.uniform(0.1F, 0.22F);
  l.ledges = dice.chance(0.5F);
  l.bars = dice.chance(0.7F);
  l.bands = dice.chance(0.5F);
  l.shutters = dice.chance(0.3F);
  l.shop = dice.chance(0.35F);
  return l;
}

}  // namespace

Mesh makeFacade(const Order& order) {
  if (!order.shape.empty()) chosenShape(order, "facade", {""});
  Dice dice(order.look_seed ^ 0xFACADEULL);
  MeshBuilder b;
  const Look look = lookOf(b, order, dice);
  const Vec3 s = order.size.cast<float>();
  const float x = std::max(0.5F * s.x() - kOverhang, 0.3F * s.x());
  const float y = std::max(0.5F * s.y() - kOverhang, 0.3F * s.y());
  Side(b, look, {-x, -y, 0.0F}, Vec3::UnitX(), 2.0F * x, s.z(), dice).add(true);
  Side(b, look, {x, -y, 0.0F}, Vec3::UnitY(), 2.0F * y, s.z(), dice).add(false);
  Side(b, look, {x, y, 0.0F}, -Vec3::UnitX(), 2.0F * x, s.z(), dice).addBlind();
  Side(b, look, {-x, y, 0.0F}, -Vec3::UnitY(), 2.0F * y, s.z(), dice).add(false);
  b.begin();
  b.quad({-x, -y, s.z()}, {x, -y, s.z()}, {x, y, s.z()}, {-x, y, s.z()}, look.roof);
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes
